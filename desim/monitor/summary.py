"""The summary of a run: the numbers of summary.json, and the tables of the time series."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from desim.monitor.belief_metrics import Sample
from desim.monitor.coverage import ExplorationScore, evaluate
from desim.monitor.monitor import Monitor
from desim.monitor.traffic import by_kind, totals
from desim.monitor.utilisation import utilisation
from desim.robot.tiles import raster
from desim.units import NS_PER_S


def judged_robot(monitor: Monitor) -> str | None:
    """The robot whose map the metrics are about: the first to know 99 %, else the one that knows
    most (the first by name among equals); None in a fleet without software."""
    first, known = monitor.explored.first_robot, monitor.coverage.known
    if not known:
        return None
    # A robot whose host stopped since then has no map left to judge.
    if first is None or monitor.maps[monitor.explorers[first]] is None:
        first = known.index(max(known))
    return monitor.explorers[first]

_MANY_FRAMES = 100  # fewer may be on their way when a run ends


def summarize(monitor: Monitor, now_ns: int) -> Sample:
    """The summary of a run that ended at ``now_ns``, after ``monitor.finish``.

    Times count from when the first robot's software started (the paper, 3.3.1). They are None
    where the instant was not reached: the run is censored.
    """
    judged = judged_robot(monitor)
    last, robots = monitor.samples[-1], _robots(monitor, now_ns)
    first_ns = {name: None if instant_ns is None else instant_ns - monitor.started_ns
                for name, instant_ns in monitor.explored.first_ns.items()}
    traffic = totals(monitor.graph)
    return {
        "stop_reason": monitor.stop_reason,
        "simulated_s": now_ns / NS_PER_S,
        "censored": first_ns["any"] is None,
        "exploration_time_s": _seconds(first_ns["any"]),
        "union_time_s": _seconds(first_ns["union"]),
        "fleet_time_s": _seconds(first_ns["all"]),
        **{name: last[name] for name in ("explored", "explored_union", "explored_all")},
        "reachable_area_m2": monitor.coverage.cells * monitor.ground.cell_m2,
        "judged_robot": judged,
        **asdict(_exploration(monitor, judged)),
        "collisions": monitor.collisions,
        "recoveries": sum(monitor.recoveries_of),
        "messages_published": traffic.sent + traffic.unmatched,
        "messages_unmatched": traffic.unmatched,
        "messages_sent": traffic.sent,
        "messages_delivered": traffic.delivered,
        "messages_dropped": dict(sorted(traffic.dropped.items())),
        "messages_in_flight": traffic.in_flight,
        "bytes_on_air": traffic.bytes_on_air,
        "utilisation": {medium.name: utilisation(medium, now_ns)
                        for medium in monitor.graph.media},
        "control_bytes": sum(medium.control_bytes for medium in monitor.graph.media),
        "partitions": monitor.partitions.summary(),
        **monitor.belief_metrics.summary(monitor.samples),
        **monitor.overlap.measures(monitor.maps),
        "map_age_s": _mean_map_age_s(monitor.samples),
        "traffic": by_kind(monitor.graph),
        "messages_by_topic": monitor.families.fates(),
        "latency_by_topic": monitor.families.latency(),
        **_fleet_means(robots),
        "robots": robots,
        "warnings": warnings(monitor),
    }


def warnings(monitor: Monitor) -> list[str]:
    """Warnings before anybody trusts the numbers: of networks that settle nothing, and of fleets
    that never move."""
    said = []
    for medium in monitor.graph.media:
        waiting = medium.in_flight()
        settles = medium.delivered or medium.dropped
        if waiting >= (_MANY_FRAMES if settles else 1) and 2 * waiting > medium.intended:
            said.append(f"medium {medium.name}: {waiting} of {medium.intended} frames are neither "
                        "delivered nor dropped at the end: does its model settle every frame?")
    if monitor.explorers and not monitor.travelled_m().any():
        said.append("no robot has moved: does the strategy choose goals, and do commands arrive?")
    return said


def _mean_map_age_s(samples: list[Sample]) -> float | None:
    """Over the samples."""
    ages_s = [row["map_age_s"] for row in samples if row["map_age_s"] is not None]
    return sum(ages_s) / len(ages_s) if ages_s else None


def known_map(monitor: Monitor, robot: str | None) -> np.ndarray:
    """int16 [height, width]: the log-odds in the map of ``robot``; zeros without a map."""
    robot_map = None if robot is None else monitor.maps[robot]
    grid = monitor.ground.grid
    return (np.zeros((grid.height, grid.width), np.int16) if robot_map is None
            else raster(grid, robot_map.fused))


def _seconds(time_ns: int | None) -> float | None:
    return None if time_ns is None else time_ns / NS_PER_S


def _exploration(monitor: Monitor, judged: str | None) -> ExplorationScore:
    return evaluate(monitor.ground, known_map(monitor, judged), monitor.travelled_m().tolist(),
                    sum(monitor.collisions_of), monitor.safety_scale)


def _robots(monitor: Monitor, now_ns: int) -> dict[str, Sample]:
    """Per robot; kB are 1000 bytes, means over the whole run."""
    kilo_s = max(now_ns, 1) / NS_PER_S * 1000.0
    travelled_m = monitor.travelled_m().tolist()
    shares = dict(zip(monitor.explorers, monitor.coverage.known, strict=True))
    return {name: {
        "explored": monitor.coverage.share(shares[name]) if name in shares else None,
        "distance_m": travelled_m[i],
        "collisions": monitor.collisions_of[i],
        "recoveries": monitor.recoveries_of[i],
        "rx_kBps": host.rx_bytes / kilo_s,
        "tx_kBps": host.tx_bytes / kilo_s,
    } for i, (name, host) in enumerate(zip(monitor.robots, monitor.hosts, strict=True))}


def _fleet_means(robots: dict[str, Sample]) -> dict[str, float]:
    """Equation 8: the mean over the robots of their means over the run."""
    return {f"mean_{key}": sum(robot[key] for robot in robots.values()) / len(robots)
            for key in ("rx_kBps", "tx_kBps")}


def samples_table(monitor: Monitor) -> dict[str, list]:
    """The time series: quantities, cause, and bytes/s by topic family since the row before."""
    rows = monitor.samples
    table = {name: [row[name] for row in rows] for name in rows[0] if name != "bytes"}
    for topic in sorted({topic for row in rows for topic in row["bytes"]}):
        total = np.array([row["bytes"].get(topic, 0) for row in rows], np.float64)
        steps_s = np.diff(table["time_s"], prepend=0.0)
        rate = np.divide(np.diff(total, prepend=0.0), steps_s, out=np.zeros(len(rows)),
                         where=steps_s > 0.0)
        # A second sample of one instant has the rate of the first.
        latest = np.maximum.accumulate(np.where(steps_s > 0.0, np.arange(len(rows)), 0))
        table[f"bytes_per_s:{topic}"] = rate[latest].tolist()
    return table


def robots_table(monitor: Monitor) -> Sample:
    """One row per second and robot: where it was, what it knew, what it sent and heard."""
    tracks, count = monitor.tracks, len(monitor.robots)
    poses = np.concatenate([track.poses for track in tracks]) if tracks else np.zeros((0, 3))
    known = np.full((len(tracks), count), np.nan)
    columns = [monitor.robots.index(name) for name in monitor.explorers]
    for k, track in enumerate(tracks):
        known[k, columns] = [monitor.coverage.share(cells) for cells in track.known]
    union = [monitor.coverage.share(track.union_known) for track in tracks]
    return {
        "time_s": np.repeat([track.time_ns / NS_PER_S for track in tracks], count),
        "robot": list(monitor.robots) * len(tracks),
        "x_m": poses[:, 0], "y_m": poses[:, 1], "yaw_rad": poses[:, 2],
        "explored": known.ravel(),
        "explored_union": np.repeat(union, count),
        **{name: np.array([getattr(track, name) for track in tracks]).ravel()
           for name in ("distance_m", "rx_bytes", "tx_bytes")},
    }

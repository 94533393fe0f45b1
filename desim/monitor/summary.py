"""The summary of a run: the numbers of summary.json, and the tables of the time series."""

from __future__ import annotations

import json
from collections.abc import Mapping

import numpy as np

from desim.errors import ModelError, class_of
from desim.monitor import energy_use, interface_rates, memory_use, processor_load
from desim.monitor.coverage import evaluate
from desim.monitor.localization_errors import wall_errors
from desim.monitor.monitor import BYTES, Monitor
from desim.monitor.samples import LEAST_WINDOW_NS, Sample, mean, mean_over
from desim.monitor.traffic import background, by_kind, packets_lost, replaced, totals
from desim.monitor.utilisation import utilisation, utilisation_inside
from desim.robot.mapping.tiles import raster
from desim.units import NS_PER_S

# The metrics of a map and of ways: None without robots.
OF_ROBOTS = (
    "explored", "explored_union", "explored_all", "reachable_area_m2", "explored_area_m2",
    "exploration_cost_m", "exploration_cost", "safety", "map_completeness", "map_quality",
    "map_error_cells")


def summarize(monitor: Monitor, now_ns: int) -> Sample:
    """The summary of a run that ended at ``now_ns``, after ``monitor.finish``."""
    judged = monitor.judged_robot()
    belief = known_map(monitor, judged)
    last, robots = monitor.latest, _robots(monitor, now_ns)
    traffic = totals(monitor.graph)
    own = _of_task(monitor)
    general: Sample = {
        "stop_reason": monitor.stop_reason,
        "simulated_s": now_ns / NS_PER_S,
        "task": monitor.task_name,
        "task_metrics": list(own),
        **{name: last[name] for name in ("explored", "explored_union", "explored_all")},
        "reachable_area_m2": monitor.coverage.cells * monitor.ground.cell_m2,
        "judged_robot": judged,
        **evaluate(monitor.ground, belief, monitor.travelled_m().tolist(),
                   sum(monitor.collisions_of), monitor.safety_scale, monitor.cost()),
        "collisions": monitor.collisions,
        "recoveries": sum(monitor.recoveries_of),
        "messages_published": traffic.sent + traffic.unmatched,
        "messages_unmatched": traffic.unmatched,
        "messages_sent": traffic.sent,
        "messages_delivered": traffic.delivered,
        "messages_dropped": dict(sorted(traffic.dropped.items())),
        "messages_in_flight": traffic.in_flight,
        "messages_replaced": replaced(monitor.graph),
        "bytes_on_air": traffic.bytes_on_air,
        "packets_lost": packets_lost(monitor.graph),
        "background": background(monitor.graph),
        "utilisation": {**{medium.name: utilisation(medium, now_ns)
                           for medium in monitor.graph.media},
                        **utilisation_inside(monitor.graph.inside, now_ns)},
        "control_bytes": sum(medium.control_bytes for medium in monitor.graph.media),
        "partitions": monitor.partitions.summary(),
        **monitor.belief_metrics.summary(monitor.samples),
        **monitor.overlap.measures(monitor.maps),
        **monitor.outdated_goals.summary(),
        **monitor.localization_errors.summary(),
        **monitor.relative_poses.summary(),
        **wall_errors(monitor.ground, belief),
        "map_age_s": mean_over(monitor.samples, "map_age_s"),
        "traffic": by_kind(monitor.graph),
        "messages_by_topic": monitor.families.fates(),
        "latency_by_topic": monitor.families.latency(),
        # Equation 8: the mean over the robots of their means over the run.
        **{f"mean_{key}": mean([robot[key] for robot in robots.values()
                                if robot[key] is not None]) for key in ("rx_kBps", "tx_kBps")},
        **monitor.processor_load.summary(now_ns),
        **memory_use.fleet_summary(list(robots.values())),
        **energy_use.fleet_summary(list(robots.values())),
        **monitor.bottlenecks.summary(),
        "robots": robots,
        "hosts": monitor.stationary_hosts.summary(now_ns),
    }
    if not monitor.robots:
        general |= dict.fromkeys(OF_ROBOTS)
    twice = sorted(own.keys() & general.keys())
    if twice:
        raise ModelError(f"{class_of(monitor.task)} has metrics that every run has: "
                         f"{', '.join(twice)}; choose other names")
    return {key: general[key] for key in ("stop_reason", "simulated_s")} | own | general


def _of_task(monitor: Monitor) -> Sample:
    """The metrics of the task. Raises ``ModelError`` for what JSON cannot hold."""
    metrics = monitor.task.metrics()
    if not isinstance(metrics, Mapping):
        raise ModelError(f"{class_of(monitor.task)} has {metrics!r} as its metrics; wanted: values "
                         "by names")
    for name, value in metrics.items():
        try:
            json.dumps(value, allow_nan=False)
        except (TypeError, ValueError) as error:
            raise ModelError(f"{class_of(monitor.task)} has the metric {name} = {value!r}; wanted: "
                             "finite numbers, words, None, lists and mappings of them") from error
    return dict(metrics)


def known_map(monitor: Monitor, robot: str | None) -> np.ndarray:
    """int16 [height, width]: the log-odds in the map of ``robot``; zeros without a map."""
    robot_map = None if robot is None else monitor.maps[robot]
    grid = monitor.ground.grid
    return (np.zeros((grid.height, grid.width), np.int16) if robot_map is None
            else raster(grid, robot_map.fused))


def _robots(monitor: Monitor, now_ns: int) -> dict[str, Sample]:
    """Per robot; kB are 1000 bytes, means over the whole run. Without software it has no loads."""
    travelled_m = monitor.travelled_m().tolist()
    shares = dict(zip(monitor.explorers, monitor.coverage.known, strict=True))
    memory = monitor.memory_use.summary()
    energy = monitor.energy_use.summary(now_ns)
    in_vain = {name: monitor.outdated_goals.of(i) for i, name in enumerate(monitor.explorers)}
    return {name: {
        "explored": monitor.coverage.share(shares[name]) if name in shares else None,
        "distance_m": travelled_m[i],
        **in_vain.get(name, {"outdated_goal_s": None, "outdated_goal_m": None}),
        "collisions": monitor.collisions_of[i],
        "recoveries": monitor.recoveries_of[i],
        **(interface_rates.mean_rates(host, now_ns) | monitor.processor_load.of(host, now_ns)
           if name in monitor.maps else
           interface_rates.NOT_MEASURED | processor_load.NOT_MEASURED),
        **memory.get(name, memory_use.NOT_MEASURED),
        **energy[i],
    } for i, (name, host) in enumerate(zip(monitor.robots, monitor.hosts, strict=True))}


def samples_table(monitor: Monitor) -> dict[str, list]:
    """The time series: quantities, cause, and bytes/s by topic family since they were taken before.
    What was not due is null, and so is a rate over less than ``LEAST_WINDOW_NS``, but for that of
    time 0, which is 0."""
    rows = monitor.samples
    table = {name: [row[name] if monitor.robots or name not in OF_ROBOTS else None for row in rows]
             for name in rows[0] if name != BYTES}
    taken, times_ns = [], [0]  # the rows with rates, and the ends of their windows
    for i, row in enumerate(rows):
        now_ns = round(row["time_s"] * NS_PER_S)
        if row[BYTES] is not None and now_ns - times_ns[-1] >= LEAST_WINDOW_NS:
            taken.append(i)
            times_ns.append(now_ns)
    steps_s = np.diff(times_ns) / NS_PER_S
    for topic in sorted({topic for row in rows for topic in row[BYTES] or ()}):
        totals_ = [rows[i][BYTES].get(topic, 0) for i in taken]
        column = [None if row["time_s"] or row[BYTES] is None else 0.0 for row in rows]
        for i, value in zip(taken, (np.diff(totals_, prepend=0) / steps_s).tolist(), strict=True):
            column[i] = value
        table[f"{BYTES}:{topic}"] = column
    return table


def robots_table(monitor: Monitor) -> Sample:
    """One row per second and robot: where it was, what it knew, what it sent and heard, and what
    its computer did where computers get busy."""
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
        **{name: _of_all(monitor, values) for name, values in _loads(monitor).items()},
        **monitor.energy_use.columns([track.joules for track in tracks]),
    }


def _loads(monitor: Monitor) -> Sample:
    """[instants, robots with software] values by column; none where computers are ideal."""
    tracks = monitor.tracks
    busy_ns = np.array([track.busy_ns for track in tracks])
    if not busy_ns.size:
        return {}
    return {"cpu_s": busy_ns / NS_PER_S,
            "missed_ticks": np.array([track.missed_ticks for track in tracks]),
            **monitor.memory_use.columns([track.ram_bytes for track in tracks],
                                         [track.memory_kills for track in tracks])}


def _of_all(monitor: Monitor, values: np.ndarray) -> np.ndarray:
    """A column with a row for each instant and robot; without software it is NaN, of counts 0."""
    counts = values.dtype.kind == "i"
    column = np.full((len(values), len(monitor.robots)), 0 if counts else np.nan, values.dtype)
    column[:, [monitor.hosts.index(host) for host in monitor.loaded]] = values
    return column.ravel()

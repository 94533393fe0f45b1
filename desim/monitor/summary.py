"""The summary of a run: the numbers of summary.json, and the tables of the time series."""

from __future__ import annotations

import json
from collections.abc import Mapping

import numpy as np

from desim.errors import ModelError, class_of
from desim.monitor.coverage import evaluate
from desim.monitor.meters.meter import merged
from desim.monitor.meters.topic_families import BYTES
from desim.monitor.monitor import Monitor
from desim.monitor.samples import LEAST_WINDOW_NS, Sample
from desim.monitor.truth import Truth
from desim.plugins import bare
from desim.ports.tasks import TaskTraits
from desim.scenario.quantities import in_order
from desim.units import NS_PER_S

# The metrics of a map and of ways: None without robots.
OF_ROBOTS = (
    "explored", "explored_union", "explored_all", "reachable_area_m2", "explored_area_m2",
    "exploration_cost_m", "exploration_cost", "safety", "map_completeness", "map_quality",
    "map_error_cells")


def summarize(monitor: Monitor, now_ns: int) -> Sample:
    """The summary of a run until ``now_ns``, which is the present."""
    truth, coverage, incidents = monitor.truth, monitor.coverage, monitor.incidents
    own, by_host = _of_task(monitor), monitor.by_host()
    known = dict(zip(truth.explorers, coverage.known, strict=True))
    general: Sample = {
        "stop_reason": monitor.stop_reason,
        "simulated_s": now_ns / NS_PER_S,
        "task": bare(truth.scenario.task.model),
        "task_metrics": list(own),
        **{name: monitor.latest[name] for name in ("explored", "explored_union", "explored_all")},
        "reachable_area_m2": coverage.cells * truth.ground.cell_m2,
        "judged_robot": monitor.judged_robot(),
        **evaluate(truth.ground, monitor.judged_map(), truth.travelled_m().tolist(),
                   sum(incidents.collisions_of), truth.scenario.measure.safety_scale,
                   monitor.cost()),
        **incidents.quantities(now_ns),
        **merged([meter.summary(now_ns) for meter in monitor.meters]),
        "robots": {name: {"explored": coverage.share(known[name]) if name in known else None,
                          **by_host[name]} for name in truth.robots},
        "hosts": {host.name: by_host[host.name] for host in truth.stationary},
    }
    if not truth.robots:
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


def samples_table(monitor: Monitor) -> dict[str, list]:
    """The time series: quantities, cause, and bytes/s by topic family since they were taken before.
    What was not due is null, and so is a rate over less than ``LEAST_WINDOW_NS``, but for that of
    time 0, which is 0."""
    rows = monitor.samples
    of_task = TaskTraits.of(monitor.task).quantities
    table = {name: [row[name] if monitor.truth.robots or name not in OF_ROBOTS else None
                    for row in rows]
             for name in in_order(rows[0], of_task) if name != BYTES}
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
    tracks, truth, share = monitor.tracks, monitor.truth, monitor.coverage.share
    count = len(truth.robots)
    poses = np.concatenate([track.poses for track in tracks]) if tracks else np.zeros((0, 3))
    known = np.array([[share(cells) for cells in track.known] for track in tracks])
    return {
        "time_s": np.repeat([track.time_ns / NS_PER_S for track in tracks], count),
        "robot": list(truth.robots) * len(tracks),
        "x_m": poses[:, 0], "y_m": poses[:, 1], "yaw_rad": poses[:, 2],
        "explored": _of_all(truth, known),
        "explored_union": np.repeat([share(track.union_known) for track in tracks], count),
        **{name: _of_all(truth, np.array([track.measured[name] for track in tracks]))
           for name in (tracks[0].measured if tracks else ())},
    }


def _of_all(truth: Truth, values: np.ndarray) -> np.ndarray:
    """A column with a row for each instant and robot of [instants, robots or explorers] values;
    without software it is NaN, of counts 0."""
    counts = values.dtype.kind == "i"
    column = np.full((len(values), len(truth.robots)), 0 if counts else np.nan, values.dtype)
    if values.size:
        with_values = truth.hosts if values.shape[1] == len(truth.hosts) else truth.explorer_hosts
        column[:, [truth.hosts.index(host) for host in with_values]] = values
    return column.ravel()

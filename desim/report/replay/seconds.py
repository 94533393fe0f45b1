"""The robots once a second, for the replay of a run: ways, bytes, shares, computers."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from desim.report.replay.columns import Columns
from desim.results.file_names import ROBOTS
from desim.results.source import ReplaySource
from desim.units import MM_PER_M

Seconds = Mapping[str, np.ndarray]  # the columns of robots.parquet
_NONE: Seconds = {name: np.empty(0) for name in (
    "time_s", "explored", "explored_union", "distance_m", "rx_bytes", "tx_bytes")}
Computers = dict[str, list[float | None]]  # of each robot


def seconds_of(recording: ReplaySource) -> Seconds:
    """A row for each second and robot; none of a failed run."""
    return recording.run.robots if recording.run.has(ROBOTS) else _NONE


def add_seconds(columns: Columns, seconds: Seconds, robots: int) -> None:
    """Add each robot's explored share (1e-4, -1: it has no software), and its way [mm] and the
    bytes that it received and sent until then, once a second; the share that all together know."""
    columns.add("second.us", np.rint(seconds["time_s"][::max(robots, 1)] * 1e6).astype(np.int64))
    columns.add("second.union", _by_robot(seconds["explored_union"] * 1e4, max(robots, 1))[:1])
    for name, scale in (("explored", 1e4), ("distance_m", MM_PER_M), ("rx_bytes", 1.0),
                        ("tx_bytes", 1.0)):
        columns.add(f"second.{name}", _by_robot(seconds[name] * scale, robots))


def add_computers(columns: Columns, seconds: Seconds, recording: ReplaySource) -> Computers | None:
    """Add the time for which each robot's processors have been busy until then [ms], the ticks that
    it has missed, and its memory in use [kB], -1 where that is not known. Returns the numbers of
    processors, and the MB of memory where it is limited; None of a run with ideal computers."""
    if "cpu_s" not in seconds:
        return None
    robots = len(recording.robots)
    columns.add("computer.busy_ms", _by_robot(seconds["cpu_s"] * 1e3, robots))
    columns.add("computer.missed", _by_robot(seconds["missed_ticks"], robots))
    ram_mb = seconds.get("ram_mb", np.full(len(seconds["cpu_s"]), np.nan))
    columns.add("computer.ram_kb", _by_robot(ram_mb * 1e3, robots))
    computers = {host.name: host.computer for host in recording.hosts}
    own = [computers[robot] for robot in recording.robots]
    return {"processors": [computer.processors for computer in own],
            "memory_mb": [None if computer.memory_bytes is None
                          else computer.memory_bytes / 1e6 for computer in own]}


def _by_robot(values: np.ndarray, robots: int) -> np.ndarray:
    """[robots, seconds] whole numbers; -1 for NaN."""
    whole = np.rint(np.nan_to_num(values.astype(float), nan=-1.0)).astype(np.int64)
    return whole.reshape(-1, robots).T if robots else whole.reshape(0, 0)

"""The memory in use on the hosts, and the processes that were killed for it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from desim.middleware.busy.host import BusyHost
from desim.middleware.host import Host
from desim.monitor.samples import Sample

_MB = 1e6


class MemoryUse:
    """The memory of ``hosts``. Where computers are ideal there is none, and nothing is measured."""

    def __init__(self, hosts: Sequence[Host]) -> None:
        busy = [host for host in hosts if isinstance(host, BusyHost)]
        self._ideal = not busy
        self._memories = {host.name: host.memory for host in busy if host.memory is not None}
        self._seconds = 0  # so far, each with a sample
        self._sums = [0] * len(self._memories)  # of the bytes in use then
        self._peaks = [0] * len(self._memories)

    def each_second(self) -> list[int]:
        """A second has passed; returns the memory in use on each host."""
        used_bytes = self.used_bytes()
        self._seconds += 1
        self._sums = [total + now for total, now in zip(self._sums, used_bytes, strict=True)]
        self._peaks = list(map(max, self._peaks, used_bytes))
        return used_bytes

    def used_bytes(self) -> list[int]:
        """The memory in use on each host now."""
        return [memory.used_bytes() for memory in self._memories.values()]

    def kills(self) -> list[int]:
        """The processes that were killed on each host so far."""
        return [len(memory.kills) for memory in self._memories.values()]

    def quantities(self) -> dict[str, float]:
        """The memory in use now, as a mean over the hosts, and the processes that were killed so
        far, as expressions see them: 0 where the cost model knows no memory."""
        if self._ideal:
            return {}
        used_bytes = self.used_bytes() or [0]
        return {"ram_mb": sum(used_bytes) / len(used_bytes) / _MB,
                "memory_kills": sum(self.kills())}

    def sample(self) -> Sample:
        """The memory in use now, as a mean over the hosts."""
        if not self._memories:
            return {}
        return _means([self._of(name, used_bytes) for name, used_bytes in
                       zip(self._memories, self.used_bytes(), strict=True)])

    def summary(self) -> dict[str, Sample]:
        """By host: means and peak over the seconds, and the processes that were killed, by node."""
        summaries: dict[str, Sample] = {}
        for (name, memory), total, peak in zip(self._memories.items(), self._sums, self._peaks,
                                               strict=True):
            kills = memory.kills
            summaries[name] = {**self._of(name, total / max(self._seconds, 1)),
                               "peak_ram_mb": peak / _MB,
                               "killed": {node: kills.count(node) for node in sorted(set(kills))}}
        return summaries

    def columns(self, used: Sequence[Sequence[int]], kills: Sequence[Sequence[int]]) -> Sample:
        """[instants, hosts] values by column, from ``used_bytes`` and ``kills`` at these
        instants."""
        if not self._memories:
            return {}
        limits = np.array([memory.limit_bytes or np.nan for memory in self._memories.values()])
        used_bytes = np.array(used, np.float64)
        return {"ram_mb": used_bytes / _MB, "ram_percent": 100.0 * used_bytes / limits,
                "memory_kills": np.array(kills, np.int64)}

    def _of(self, name: str, used_bytes: float) -> Sample:
        limit_bytes = self._memories[name].limit_bytes
        return {"ram_mb": used_bytes / _MB,
                "ram_percent": None if limit_bytes is None else 100.0 * used_bytes / limit_bytes}


NOT_MEASURED: Sample = {"ram_mb": None, "ram_percent": None, "peak_ram_mb": None, "killed": {}}


def _means(samples: Sequence[Sample]) -> Sample:
    """Means over the hosts; of shares, over those that have a limit."""
    means: Sample = {}
    for key in ("ram_mb", "ram_percent"):
        known = [sample[key] for sample in samples if sample[key] is not None]
        means[key] = sum(known) / len(known) if known else None
    return means


def fleet_summary(robots: Sequence[Sample]) -> Sample:
    """The means over the robots (equation 8), and all processes that were killed."""
    measured = [robot for robot in robots if robot["ram_mb"] is not None]
    return {**{f"mean_{key}": mean for key, mean in _means(measured).items()},
            "memory_kills": sum(sum(robot["killed"].values()) for robot in robots)}

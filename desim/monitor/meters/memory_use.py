"""The memory in use on the hosts, and the processes that were killed for it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from desim.middleware.busy.memory import HostMemory
from desim.middleware.host import Host
from desim.monitor.meters.meter import Due, Meter, Second
from desim.monitor.samples import Sample, mean
from desim.monitor.truth import Truth

_MB = 1e6
_NOT_MEASURED: Sample = {"ram_mb": None, "ram_percent": None, "peak_ram_mb": None, "killed": {}}


class MemoryUse(Meter):
    """The memory of hosts. Where computers are ideal there is none, and nothing is measured."""

    def __init__(self, truth: Truth) -> None:
        self._truth = truth
        self._ideal = all(host.computer is None for host in truth.loaded)
        self._robots = _memories(truth.loaded)
        self._all = self._robots | _memories(truth.stationary)
        self._limits = np.array([memory.limit_bytes or np.nan for memory in self._robots.values()])
        self._seconds = 0  # so far, each with a sample
        self._sums = dict.fromkeys(self._all, 0)  # of the bytes in use then
        self._peaks = dict.fromkeys(self._all, 0)

    def each_second(self, second: Second) -> None:
        self._seconds += 1
        for name, memory in self._all.items():
            used_bytes = memory.used_bytes()
            self._sums[name] += used_bytes
            self._peaks[name] = max(self._peaks[name], used_bytes)

    def track(self, second: Second) -> Sample:
        if not self._robots:
            return {}
        used_bytes = np.array([memory.used_bytes() for memory in self._robots.values()])
        return {"ram_mb": used_bytes / _MB, "ram_percent": 100.0 * used_bytes / self._limits,
                "memory_kills": [len(memory.kills) for memory in self._robots.values()]}

    def quantities(self, now_ns: int) -> Sample:
        """The memory in use now, as a mean over the robots, and the processes that were killed so
        far: 0 where the cost model knows no memory."""
        if self._ideal:
            return {}
        used_bytes = [memory.used_bytes() for memory in self._robots.values()] or [0]
        return {"ram_mb": sum(used_bytes) / len(used_bytes) / _MB, "memory_kills": self._killed()}

    def _killed(self) -> int:
        return sum([len(memory.kills) for memory in self._robots.values()])

    def sample(self, now_ns: int, due: Due) -> Sample:
        """The memory in use now, as a mean over the robots."""
        if not self._robots:
            return {}
        return _means([self._of(name, memory.used_bytes())
                       for name, memory in self._robots.items()])

    def by_host(self, now_ns: int) -> dict[str, Sample]:
        """Means and peak over the seconds, and the processes that were killed, by node."""
        hosts = [*self._truth.robots, *(host.name for host in self._truth.stationary)]
        return {name: self._over_time(name) if name in self._all else _NOT_MEASURED
                for name in hosts}

    def summary(self, now_ns: int) -> Sample:
        """The means over the robots (equation 8), and all processes that were killed."""
        means = _means([self._over_time(name) for name in self._robots])
        return {**{f"mean_{key}": value for key, value in means.items()},
                "memory_kills": self._killed()}

    def _over_time(self, name: str) -> Sample:
        kills = self._all[name].kills
        return {**self._of(name, self._sums[name] / max(self._seconds, 1)),
                "peak_ram_mb": self._peaks[name] / _MB,
                "killed": {node: kills.count(node) for node in sorted(set(kills))}}

    def _of(self, name: str, used_bytes: float) -> Sample:
        limit_bytes = self._all[name].limit_bytes
        return {"ram_mb": used_bytes / _MB,
                "ram_percent": None if limit_bytes is None else 100.0 * used_bytes / limit_bytes}


def _memories(hosts: Sequence[Host]) -> dict[str, HostMemory]:
    return {host.name: host.memory for host in hosts if host.memory is not None}


def _means(samples: Sequence[Sample]) -> Sample:
    """Means over the hosts; of shares, over those that have a limit."""
    return {key: mean([sample[key] for sample in samples if sample[key] is not None])
            for key in ("ram_mb", "ram_percent")}

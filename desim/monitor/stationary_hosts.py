"""Hosts without a body: the loads of their processors, memory and interfaces."""

from __future__ import annotations

from collections.abc import Sequence

from desim.middleware.host import Host
from desim.monitor.interface_rates import mean_rates
from desim.monitor.memory_use import NOT_MEASURED, MemoryUse
from desim.monitor.processor_load import ProcessorLoad
from desim.monitor.samples import Sample


class StationaryHosts:
    """Watches ``hosts``: a workstation, a base. Memory is sampled each second."""

    def __init__(self, hosts: Sequence[Host]) -> None:
        self._hosts = hosts
        self._load, self._memory = ProcessorLoad(hosts, {}), MemoryUse(hosts)

    def each_second(self) -> None:
        """A second has passed: sample the memory in use."""
        self._memory.each_second()

    def memory(self) -> dict[str, Sample]:
        """By host, see ``MemoryUse.summary``."""
        return self._memory.summary()

    def summary(self, now_ns: int) -> dict[str, Sample]:
        """By host, over the whole run; null where something is not measured."""
        memory = self.memory()
        return {host.name: {**mean_rates(host, now_ns), **self._load.of(host, now_ns),
                            **memory.get(host.name, NOT_MEASURED)} for host in self._hosts}

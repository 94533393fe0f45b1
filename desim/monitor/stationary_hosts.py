"""The hosts without a body: their processors, their memory, and the bytes on their interfaces."""

from __future__ import annotations

from collections.abc import Sequence

from desim.middleware.host import Host
from desim.monitor.interface_rates import mean_rates
from desim.monitor.memory_use import NOT_MEASURED, MemoryUse
from desim.monitor.processor_load import ProcessorLoad
from desim.monitor.samples import Sample


class StationaryHosts:
    """Watches ``hosts``: a workstation, a base. Memory is as of each second."""

    def __init__(self, hosts: Sequence[Host]) -> None:
        self._hosts = hosts
        self._load, self._memory = ProcessorLoad(hosts, {}), MemoryUse(hosts)

    def each_second(self) -> None:
        """A second has passed: look at the memory in use."""
        self._memory.each_second()

    def memory(self) -> dict[str, Sample]:
        """By host, of the seconds, as ``MemoryUse.summary``."""
        return self._memory.summary()

    def summary(self, now_ns: int) -> dict[str, Sample]:
        """By host, over the whole run; what is not measured is null, as of robots."""
        memory = self.memory()
        return {host.name: {**mean_rates(host, now_ns), **self._load.of(host, now_ns),
                            **memory.get(host.name, NOT_MEASURED)} for host in self._hosts}

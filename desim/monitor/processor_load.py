"""The load of the hosts' processors: user and system time as one."""

from __future__ import annotations

from collections.abc import Sequence

from desim.middleware.busy_host import BusyHost
from desim.middleware.host import Host
from desim.monitor.belief_metrics import Sample
from desim.units import NS_PER_S


class ProcessorLoad:
    """The loads of ``hosts``. Where computers are ideal there are none, and nothing is measured."""

    def __init__(self, hosts: Sequence[Host]) -> None:
        self._hosts = [host for host in hosts if isinstance(host, BusyHost)]
        self._since_ns = 0  # of the last sample
        self._busy_ns = [0] * len(self._hosts)  # then

    def busy_ns(self) -> list[int]:
        """The time that processors of each host have been busy so far."""
        return [host.computer.processors.busy_ns() for host in self._hosts]

    def missed_ticks(self) -> list[int]:
        """The callbacks of timers that each host has left out so far."""
        return [host.missed_ticks for host in self._hosts]

    def sample(self, now_ns: int) -> Sample:
        """The share of all processors that was busy since the sample before, as a mean over the
        hosts; at the instant of that one it is null."""
        if not self._hosts:
            return {}
        busy_ns, elapsed_ns = self.busy_ns(), now_ns - self._since_ns
        shares = [self._percent(host, after - before, elapsed_ns) for host, before, after
                  in zip(self._hosts, self._busy_ns, busy_ns, strict=True)] if elapsed_ns else []
        self._busy_ns, self._since_ns = busy_ns, now_ns
        return {"cpu_percent": sum(shares) / len(shares) if shares else None}

    def of(self, host: Host, elapsed_ns: int) -> Sample:
        """The load of ``host`` over the whole run; null where there is none."""
        if not isinstance(host, BusyHost):
            return {"cpu_percent": None, "cpu_s": None, "missed_ticks": 0}
        busy_ns = host.computer.processors.busy_ns()
        return {"cpu_percent": self._percent(host, busy_ns, max(elapsed_ns, 1)),
                "cpu_s": busy_ns / NS_PER_S, "missed_ticks": host.missed_ticks}

    def summary(self, elapsed_ns: int) -> Sample:
        """The mean over the hosts (equation 8), and all missed ticks."""
        loads = [self.of(host, elapsed_ns)["cpu_percent"] for host in self._hosts]
        return {"mean_cpu_percent": sum(loads) / len(loads) if loads else None,
                "missed_ticks": sum(self.missed_ticks())}

    def _percent(self, host: BusyHost, busy_ns: int, elapsed_ns: int) -> float:
        return 100.0 * busy_ns / (elapsed_ns * host.computer.processors.count)

"""The bytes on the hosts' interfaces: as the paper's nicstat, in kB/s."""

from __future__ import annotations

from collections.abc import Sequence

from desim.middleware.host import Host
from desim.monitor.belief_metrics import Sample
from desim.units import NS_PER_S


class InterfaceRates:
    """The rates at which the interfaces of ``hosts`` receive and send; kB are 1000 bytes."""

    def __init__(self, hosts: Sequence[Host]) -> None:
        self._hosts = hosts
        self._since_ns = 0  # of the last sample
        self._bytes = 0, 0  # received and sent by then

    def sample(self, now_ns: int) -> Sample:
        """The rates since the sample before, as means over the hosts; at the instant of that one
        they are null."""
        now = (sum(host.rx_bytes for host in self._hosts),
               sum(host.tx_bytes for host in self._hosts))
        kilo_s = len(self._hosts) * (now_ns - self._since_ns) / NS_PER_S * 1e3
        rates = [(after - before) / kilo_s if kilo_s else None
                 for before, after in zip(self._bytes, now, strict=True)]
        self._since_ns, self._bytes = now_ns, now
        return dict(zip(("rx_kBps", "tx_kBps"), rates, strict=True))


def mean_rates(host: Host, elapsed_ns: int) -> Sample:
    """The rates of ``host`` over the whole run."""
    kilo_s = max(elapsed_ns, 1) / NS_PER_S * 1000.0
    return {"rx_kBps": host.rx_bytes / kilo_s, "tx_kBps": host.tx_bytes / kilo_s}

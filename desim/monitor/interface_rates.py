"""The bytes on the hosts' interfaces in kB/s, as the paper's nicstat measures them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from desim.middleware.host import Host
from desim.monitor.samples import LEAST_WINDOW_NS, Sample
from desim.units import NS_PER_S

NOT_MEASURED: Sample = {"rx_kBps": None, "tx_kBps": None}


class InterfaceRates:
    """The rates at which the interfaces of ``hosts`` receive and send; kB are 1000 bytes."""

    def __init__(self, hosts: Sequence[Host]) -> None:
        self._hosts = hosts
        # When each was sampled last, and the bytes by then.
        self._last = dict.fromkeys(("rx_kBps", "tx_kBps"), (0, 0))

    def sample(self, now_ns: int, due: Callable[[str], bool]) -> Sample:
        """The rates that are ``due`` now, each since it was taken before, as means over the hosts;
        null if that was less than ``LEAST_WINDOW_NS`` ago, and without hosts."""
        totals = {"rx_kBps": sum(host.rx_bytes for host in self._hosts),
                  "tx_kBps": sum(host.tx_bytes for host in self._hosts)}
        return {name: self._rate(name, total, now_ns) if due(name) else None
                for name, total in totals.items()}

    def _rate(self, name: str, bytes_: int, now_ns: int) -> float | None:
        since_ns, before = self._last[name]
        if not self._hosts or now_ns - since_ns < LEAST_WINDOW_NS:
            return None
        self._last[name] = now_ns, bytes_
        return (bytes_ - before) / (len(self._hosts) * (now_ns - since_ns) / NS_PER_S * 1e3)


def mean_rates(host: Host, elapsed_ns: int) -> Sample:
    """The rates of ``host`` over the whole run."""
    kilo_s = max(elapsed_ns, 1) / NS_PER_S * 1000.0
    return {"rx_kBps": host.rx_bytes / kilo_s, "tx_kBps": host.tx_bytes / kilo_s}

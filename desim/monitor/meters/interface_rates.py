"""The bytes on the hosts' interfaces in kB/s, as the paper's nicstat measures them."""

from __future__ import annotations

from desim.middleware.host import Host
from desim.monitor.meters.meter import Due, Meter, Second
from desim.monitor.samples import LEAST_WINDOW_NS, Sample, mean
from desim.monitor.truth import Truth
from desim.units import NS_PER_S

_NOT_MEASURED: Sample = {"rx_kBps": None, "tx_kBps": None}


class InterfaceRates(Meter):
    """The rates at which the hosts' interfaces receive and send; kB are 1000 bytes."""

    def __init__(self, truth: Truth) -> None:
        self._truth, self._hosts = truth, truth.loaded
        # When each was sampled last, and the bytes by then.
        self._last = dict.fromkeys(_NOT_MEASURED, (0, 0))

    def track(self, second: Second) -> Sample:
        return {"rx_bytes": [host.rx_bytes for host in self._truth.hosts],
                "tx_bytes": [host.tx_bytes for host in self._truth.hosts]}

    def sample(self, now_ns: int, due: Due) -> Sample:
        """The rates that are ``due`` now, each since it was taken before, as means over the hosts;
        null if that was less than ``LEAST_WINDOW_NS`` ago, and without hosts."""
        totals = {"rx_kBps": sum([host.rx_bytes for host in self._hosts]),
                  "tx_kBps": sum([host.tx_bytes for host in self._hosts])}
        return {name: self._rate(name, total, now_ns) if due(name) else None
                for name, total in totals.items()}

    def _rate(self, name: str, bytes_: int, now_ns: int) -> float | None:
        since_ns, before = self._last[name]
        if not self._hosts or now_ns - since_ns < LEAST_WINDOW_NS:
            return None
        self._last[name] = now_ns, bytes_
        return (bytes_ - before) / (len(self._hosts) * (now_ns - since_ns) / NS_PER_S * 1e3)

    def by_host(self, now_ns: int) -> dict[str, Sample]:
        """Over the whole run; None of robots without software."""
        return {**dict.fromkeys(self._truth.robots, _NOT_MEASURED), **{
            host.name: _mean_rates(host, now_ns) for host in self._truth.with_software}}

    def summary(self, now_ns: int) -> Sample:
        """The mean over the robots of their means over the run (equation 8)."""
        rates = [_mean_rates(host, now_ns) for host in self._truth.explorer_hosts]
        return {f"mean_{key}": mean([own[key] for own in rates]) for key in _NOT_MEASURED}


def _mean_rates(host: Host, elapsed_ns: int) -> Sample:
    """The rates of ``host`` over the whole run."""
    kilo_s = max(elapsed_ns, 1) / NS_PER_S * 1000.0
    return {"rx_kBps": host.rx_bytes / kilo_s, "tx_kBps": host.tx_bytes / kilo_s}

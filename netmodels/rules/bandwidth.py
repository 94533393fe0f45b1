"""No host sends faster than a rate."""

from __future__ import annotations

from pydantic import Field

from desim import ports
from desim.units import NS_PER_S, BitRate, ByteSize, airtime_ns


class Bandwidth:
    """A token bucket per sender: ``burst`` goes at once, the rest at ``rate``. A frame with more
    than ``backlog`` waiting (its own size included) is dropped. A broadcast is counted once. What
    waits at ``until`` leaves then, in order and as fast as the medium takes it.

    v = max(v, now - burst / rate) + size / rate is the instant at which everything sent is paid
    for; the last byte leaves at v, or now if that has passed (ITU-T I.371, virtual scheduling).

    Capabilities: KnowsDepartures, Queues, TakesBack.
    """

    class Params(ports.Params):
        rate_bps: BitRate = Field(examples=["4 Mb/s"], description="of each sender, all its frames")
        burst_bytes: ByteSize = Field("15 kB", ge=1, description="(ten full Ethernet packets)")
        backlog_bytes: ByteSize = Field("64 MB", description="(as the queue of ``link``)")

    reasons = ("rate_limited",)

    def __init__(self, params: Params) -> None:
        self._rate_bps = params.rate_bps
        self._burst_ns = params.burst_bytes * 8 * NS_PER_S // params.rate_bps
        self._backlog_ns = params.backlog_bytes * 8 * NS_PER_S // params.rate_bps

    def start(self, context: ports.RuleContext, hosts: tuple[str, ...]) -> None:
        self._context = context
        self._hosts = len(hosts)
        self.emptied()

    def emptied(self) -> None:
        """``ports.Queues``: each bucket is full."""
        self._paid_ns = [-self._burst_ns] * self._hosts

    def refused(self, host: int, size_bytes: int) -> None:
        """``ports.TakesBack``."""
        self._paid_ns[host] -= airtime_ns(size_bytes, self._rate_bps)

    def departure_ns(self, host: int) -> int:
        """``ports.KnowsDepartures``."""
        return self._paid_ns[host]

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> list[ports.Verdict] | None:
        now_ns = self._context.now_ns
        paid_ns = (max(self._paid_ns[frame.source], now_ns - self._burst_ns)
                   + airtime_ns(frame.size_bytes, self._rate_bps))
        wait_ns = paid_ns - now_ns
        if wait_ns > self._backlog_ns:
            return [ports.Drop("rate_limited")] * len(receivers)
        self._paid_ns[frame.source] = paid_ns
        return [ports.Deliver(wait_ns)] * len(receivers) if wait_ns > 0 else None

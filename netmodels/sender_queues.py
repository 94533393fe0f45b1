"""One unbounded FIFO per sender: a frame waits only for earlier frames of the same sender."""

from __future__ import annotations

from desim import ports
from desim.units import airtime_ns


class SenderQueues:
    """Each host's frames go out one after another at ``rate_bps``, and nobody hinders anybody else:
    delay = wait behind the sender's own earlier frames + size * 8 / rate."""

    def __init__(self, hosts: int, rate_bps: int) -> None:
        self._free_ns = [0] * hosts
        self._rate_bps = rate_bps

    def delay_ns(self, frame: ports.Frame, now_ns: int) -> int:
        """The time until all of ``frame``, which is sent now, is out."""
        source = frame.source
        end_ns = (max(now_ns, self._free_ns[source])
                  + airtime_ns(frame.size_bytes, self._rate_bps))
        self._free_ns[source] = end_ns
        return end_ns - now_ns

"""ALOHA: hosts send without listening first."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from itertools import accumulate

from pydantic import Field

from desim import ports
from desim.units import BitRate, Period, airtime_ns
from netmodels.itemized import FrameTimes, Itemized


class _Transmission:
    """A frame on the air: the ends of its packets, and those that others have corrupted."""

    def __init__(self, frame: ports.Frame, begin_ns: int, rate_bps: int) -> None:
        self.frame, self.begin_ns = frame, begin_ns
        sizes = accumulate(ports.packet_sizes(frame.size_bytes, frame.segments))
        self.ends_ns = [begin_ns + airtime_ns(size_bytes, rate_bps) for size_bytes in sizes]
        self.corrupted: set[int] = set()

    def spoil(self, begin_ns: int, end_ns: int) -> None:
        """Another host sends from ``begin_ns`` to ``end_ns``."""
        begins_ns = [self.begin_ns, *self.ends_ns[:-1]]
        self.corrupted.update(range(bisect_right(self.ends_ns, begin_ns),
                                 bisect_left(begins_ns, end_ns)))


class Aloha(Itemized):
    """Hosts send at once (Abramson 1970), or at the beginning of the next
    slot (Roberts 1975). Packets that overlap with others' are lost; nobody waits, acknowledges or
    repeats, and a host that begins another frame while it sends spoils both. A train's packets
    follow each other without a gap.

    Capabilities: Itemizes.
    """

    class Params(ports.Params):
        rate_bps: BitRate = Field("24 kb/s", description="of the one channel (ALOHAnet's, 1971)")
        slot_ns: Period | None = Field(None, description="from the beginning of one slot to that "
                                                         "of the next (null: no slots)")

    reasons = ("collision",)

    def __init__(self, params: Params) -> None:
        self._rate_bps = params.rate_bps
        self._slot_ns = params.slot_ns
        self._air: dict[int, _Transmission] = {}  # by frame

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self._context = context
        self._times = FrameTimes.of(self._ledger)

    def send(self, frame: ports.Frame) -> None:
        self._times.begin(frame, self._context.now_ns)
        if self._slot_ns is None:
            self._begin(frame)
        else:
            slots = -(-self._context.now_ns // self._slot_ns)
            self._context.at(slots * self._slot_ns, self._begin, frame)

    def _begin(self, frame: ports.Frame) -> None:
        now_ns = self._context.now_ns
        self._times.until(frame, ports.TimePart.CONTENTION, now_ns)
        own = _Transmission(frame, now_ns, self._rate_bps)
        end_ns = own.ends_ns[-1]
        for other in self._air.values():
            own.spoil(now_ns, other.ends_ns[-1])
            other.spoil(now_ns, end_ns)
        self._air[frame.id] = own
        self._context.at(end_ns, self._end, own)

    def _end(self, own: _Transmission) -> None:
        frame = own.frame
        del self._air[frame.id]
        self._times.until(frame, ports.TimePart.AIRTIME, self._context.now_ns)
        self._times.end(frame)
        if len(own.corrupted) == frame.segments:
            self._context.settle_many(frame, frame.receivers, ports.Drop("collision"))
            return
        if own.corrupted:
            self._context.settle_many(frame, frame.receivers,
                                      ports.Drop("collision", tuple(sorted(own.corrupted))))
        self._context.settle_many(frame, frame.receivers, ports.Deliver(0))

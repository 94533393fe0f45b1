"""Nobody listens before talking: the oldest way to share a medium."""

from __future__ import annotations

from pydantic import Field

from desim import ports
from desim.units import BitRate, Period, airtime_ns


class Aloha:
    """Who has something to say says it at once (Abramson 1970), or at the beginning of the next
    slot (Roberts 1975). Frames that overlap are lost; nobody waits, acknowledges or repeats, and a
    host that begins another frame while it sends spoils both. A train is one long frame.
    """

    class Params(ports.Params):
        rate_bps: BitRate = Field("24 kb/s", description="of the one channel (ALOHAnet's, 1971)")
        slot_ns: Period | None = Field(None, description="from the beginning of one slot to that "
                                                         "of the next (null: no slots)")

    reasons = ("collision",)

    def __init__(self, params: Params) -> None:
        self._rate_bps = params.rate_bps
        self._slot_ns = params.slot_ns
        self._spoilt: dict[int, bool] = {}  # by frame on the air

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self._context = context

    def send(self, frame: ports.Frame) -> None:
        if self._slot_ns is None:
            self._begin(frame)
        else:
            slots = -(-self._context.now_ns // self._slot_ns)
            self._context.at(slots * self._slot_ns, self._begin, frame)

    def _begin(self, frame: ports.Frame) -> None:
        overlaps = bool(self._spoilt)
        if overlaps:
            self._spoilt = dict.fromkeys(self._spoilt, True)
        self._spoilt[frame.id] = overlaps
        end_ns = self._context.now_ns + airtime_ns(frame.size_bytes, self._rate_bps)
        self._context.at(end_ns, self._end, frame)

    def _end(self, frame: ports.Frame) -> None:
        spoilt = self._spoilt.pop(frame.id)
        self._context.settle_many(frame, frame.receivers,
                                  ports.Drop("collision") if spoilt else ports.Deliver(0))

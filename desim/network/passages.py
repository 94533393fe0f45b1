"""Passages: single frames under way, with the parts of their time, where somebody keeps a ledger.

A run without a ledger has none of these objects. With one, ``ItemizedMedium`` puts an ``Escort``
between each frame's carrier and the medium; what happens is the same.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from desim.network.carrier import BroadcastCarrier, Carrier
from desim.ports import TimePart

if TYPE_CHECKING:
    from desim.network.medium import Medium


RELAYED = 1 << 16


class Stamp(NamedTuple):
    """A part of a frame's time, and where it was spent: at ``host`` (index), on the medium with
    that number (-1: above all media)."""

    part: TimePart
    medium: int
    host: int
    time_ns: int


class Passage:
    """One frame, from its carrier's hands to its fate at each receiver.

    What it carries was first sent at ``first_ns``; it was handed over at ``handed_ns`` and then,
    for another part of ``held``, not given to the medium before ``sent_ns``.
    """

    __slots__ = ("medium", "source", "first_ns", "handed_ns", "held", "sent_ns", "left", "_common",
                 "_own", "_model_ns", "_rules_ns", "_lost_at")

    def __init__(self, medium: int, source: int, first_ns: int, handed_ns: int, held: TimePart,
                 sent_ns: int, receivers: int) -> None:
        self.medium, self.source = medium, source
        self.first_ns, self.handed_ns, self.held, self.sent_ns = first_ns, handed_ns, held, sent_ns
        self.left = receivers  # without a fate
        self._common: list[Stamp] = []
        self._own: dict[int, list[Stamp]] = {}
        self._model_ns: dict[int, int] = {}
        self._rules_ns: dict[int, int] = {}
        self._lost_at: dict[int | None, int] = {}

    def spent(self, part: TimePart, time_ns: int, receiver: int | None, host: int | None) -> None:
        """See ``ports.Ledger``."""
        stamp = Stamp(part, self.medium, self.source if host is None else host, time_ns)
        if receiver is None:
            self._common.append(stamp)
        else:
            self._own.setdefault(receiver, []).append(stamp)

    def lost_at(self, host: int, receiver: int | None) -> None:
        """See ``ports.Ledger``."""
        self._lost_at[receiver] = host

    def settled(self, receiver: int, model_ns: int, rules_ns: int = 0) -> None:
        """The model delivers it after ``model_ns``, and rules ``rules_ns`` later."""
        self._model_ns[receiver] = model_ns
        if rules_ns:
            self._rules_ns[receiver] = rules_ns

    def stamps(self, receiver: int) -> list[Stamp]:
        """Its parts from ``sent_ns`` to its arrival at ``receiver``, in order of time."""
        stamps = self._common + self._own.get(receiver, [])
        if not stamps and (model_ns := self._model_ns.get(receiver, 0)):
            stamps = [Stamp(TimePart.MEDIUM, self.medium, self.source, model_ns)]
        if receiver in self._rules_ns:
            stamps = [*stamps, Stamp(TimePart.RULES, self.medium, self.source,
                                     self._rules_ns[receiver])]
        return stamps

    def place_of_loss(self, receiver: int) -> int:
        """The host at which it was lost on the way to ``receiver``."""
        return self._lost_at.get(receiver, self._lost_at.get(None, self.source))


class Passages:
    """The common part of all itemized media of a run, and the stamps of transports.

    ``arriving`` and ``losing``: the passage whose arrival or loss is being told to its carrier.
    ``expected``: those that nobody waits for, by token and receiver. ``relays``: with which passage
    and when a message came to a host that passes it on, for the last ``RELAYED`` of them.
    """

    def __init__(self) -> None:
        self.media: list[str] = []
        self.arriving: Passage | None = None
        self.losing: Passage | None = None
        self.expected: dict[tuple[object, int], Passage] = {}
        self.relays: dict[tuple[object, int], tuple[Passage, int]] = {}
        self._wait: tuple[TimePart, int] | None = None

    def waited(self, part: TimePart, since_ns: int) -> None:
        """The next frame that is given to a medium has waited for ``part`` since then."""
        self._wait = part, since_ns

    def relay(self, message: object, host: int, now_ns: int) -> None:
        """``host`` will pass on a message that arrives now."""
        if self.arriving is not None:
            if len(self.relays) == RELAYED:
                del self.relays[next(iter(self.relays))]
            self.relays[message, host] = self.arriving, now_ns

    def begin(self, medium: int, source: int, receivers: int, carrier: Carrier[Any], token: object,
              now_ns: int) -> Passage:
        """A frame is given to a medium."""
        held, handed_ns = self._wait or (TimePart.RESOLUTION, now_ns)
        self._wait = None
        first_ns = min(carrier.first_sent(token, now_ns), handed_ns)
        return Passage(medium, source, first_ns, handed_ns, held, now_ns, receivers)


class Escort(BroadcastCarrier[Any]):
    """The carrier that a medium sees of a frame with a passage. It passes everything on to the
    frame's own ``carrier``, and tells ``passages`` which passage it is about."""

    __slots__ = ("passage", "carrier", "_passages")

    def __init__(self, passage: Passage, carrier: Carrier[Any], passages: Passages) -> None:
        self.passage, self.carrier = passage, carrier
        self._passages = passages

    @property
    def ahead(self) -> bool:  # type: ignore[override] # read once, at the settlement
        return self.carrier.ahead

    @property
    def socket(self) -> object:
        return self.carrier.socket

    def expected(self, token: object, receiver: int, arrival_ns: int) -> None:
        self._passages.expected[token, receiver] = self.passage
        self.passage.left -= 1
        self.carrier.expected(token, receiver, arrival_ns)

    def arrived(self, token: object, receiver: int) -> None:
        self.passage.left -= 1
        passages = self._passages
        before, passages.arriving = passages.arriving, self.passage
        self.carrier.arrived(token, receiver)
        passages.arriving = before

    def arrived_many(self, token: object, receivers: Sequence[int]) -> None:
        self.passage.left -= len(receivers)
        passages = self._passages
        before, passages.arriving = passages.arriving, self.passage
        self._broadcasting().arrived_many(token, receivers)
        passages.arriving = before

    def arrived_in_part(self, token: object, receiver: int, lost: dict[int, str]) -> None:
        """Some of it may be delivered, and the rest be what loses a message."""
        self.passage.left -= 1
        passages = self._passages
        before = passages.arriving, passages.losing
        passages.arriving = passages.losing = self.passage
        self.carrier.arrived_in_part(token, receiver, lost)
        passages.arriving, passages.losing = before

    def lost(self, token: object, receiver: int, reason: str) -> None:
        self.passage.left -= 1
        passages = self._passages
        before, passages.losing = passages.losing, self.passage
        self.carrier.lost(token, receiver, reason)
        passages.losing = before

    def missed(self, token: object, receivers: Collection[int], reason: str,
               medium: Medium) -> None:
        self.passage.left -= len(receivers)
        passages = self._passages
        before, passages.losing = passages.losing, self.passage
        self._broadcasting().missed(token, receivers, reason, medium)
        passages.losing = before

    def repeated(self, token: object, receiver: int) -> None:
        self.carrier.repeated(token, receiver)

    def _broadcasting(self) -> BroadcastCarrier[Any]:
        assert isinstance(self.carrier, BroadcastCarrier)
        return self.carrier

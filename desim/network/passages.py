"""Frames under way: where the time of each goes, and where it is lost, for a run with a ledger.

A run without a ledger has none of these objects. With one, ``ItemizedMedium`` puts an
``ItemizedCarrier`` between each frame's carrier and the medium, which changes nothing else.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from desim.engine.kernel import Kernel
from desim.network.carrier import AnyCarrier, WrappedCarrier
from desim.ports import KnowsHandovers, TimePart

if TYPE_CHECKING:
    from desim.network.medium import Medium

RELAYED = 1 << 16  # messages whose arrival at a relay is remembered


class Stamp(NamedTuple):
    """A part of a frame's time, spent at ``host`` (index) on ``medium`` (its number; -1: above all
    media)."""

    part: TimePart
    medium: int
    host: int
    time_ns: int


class Passage:
    """The way of one frame, from its carrier to its fate at each receiver.

    ``first_ns``: the first transmission of the data that it carries. ``handed_ns``: its carrier
    sends this frame. ``sent_ns``: the medium takes it; until then it waited for ``held`` (for
    ``RESOLUTION``, if the receiver's address was not known). ``queued_ns``: it waits for so long in
    queues of rules before the model gets it. ``before``: the passage over which a
    frame came to ``source``, which forwards it.
    """

    __slots__ = ("medium", "source", "first_ns", "handed_ns", "held", "sent_ns", "left", "before",
                 "queued_ns",
                 "_common", "_own", "_model_ns", "_rules_ns", "_lost_at")

    def __init__(self, medium: int, source: int, first_ns: int, handed_ns: int, held: TimePart,
                 sent_ns: int, receivers: int, before: Passage | None = None) -> None:
        self.before = before
        self.medium, self.source = medium, source
        self.first_ns, self.handed_ns, self.held, self.sent_ns = first_ns, handed_ns, held, sent_ns
        self.queued_ns = 0
        self.left = receivers  # that it has no fate at yet
        self._common: list[Stamp] = []
        self._own: dict[int, list[Stamp]] = {}
        self._model_ns: dict[int, int] = {}
        self._rules_ns: dict[int, int] = {}
        self._lost_at: dict[int | None, int] = {}

    @property
    def first(self) -> Passage:
        """The passage with which the frame set out at its sender."""
        return self if self.before is None else self.before.first

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
        """The parts from ``first.sent_ns`` to its arrival at ``receiver``, in order of time."""
        stamps = self._common + self._own.get(receiver, [])
        if not stamps and (model_ns := self._model_ns.get(receiver, 0)):
            stamps = [Stamp(TimePart.MEDIUM, self.medium, self.source, model_ns)]
        if self.queued_ns:
            stamps = [Stamp(TimePart.RULES, self.medium, self.source, self.queued_ns), *stamps]
        if receiver in self._rules_ns:
            stamps = [*stamps, Stamp(TimePart.RULES, self.medium, self.source,
                                     self._rules_ns[receiver])]
        return stamps if self.before is None else [*self.before.stamps(self.source), *stamps]

    def place_of_loss(self, receiver: int) -> int:
        """The host at which it was lost on the way to ``receiver``."""
        return self._lost_at.get(receiver, self._lost_at.get(None, self.source))


class FrameLoss(NamedTuple):
    """A frame, or packets of it, that did not come from ``source`` to ``receiver`` (indices): lost
    at ``host`` of ``medium``, as in ``Stamp``, when ``people`` stood on the line between the two
    (not counted under access points)."""

    time_ns: int
    source: int
    receiver: int
    reason: str
    medium: int
    host: int
    people: int = 0


class KnownMedium(NamedTuple):
    """An itemized medium: its ``places`` are its hosts, and behind them the access points of its
    model, of which ``associations`` says who hung on which (None: there are none)."""

    name: str
    places: tuple[str, ...]
    associations: KnowsHandovers | None


class Passages:
    """The passages of all itemized media of a run, and what transports add to them.

    ``arriving`` and ``losing``: the passage of whose arrival or loss a carrier is being notified.
    ``expected``, by token and receiver: passages of ``Carrier.expected``, which end without a call.
    ``relays``, by message and host that passes it on: the passage with which the message came
    there, and when; of the last ``RELAYED`` messages. ``losses``: of frames, in order of time;
    those that a broadcast missed are not among them.
    """

    def __init__(self) -> None:
        self.media: list[KnownMedium] = []
        self.arriving: Passage | None = None
        self.losing: Passage | None = None
        self.expected: dict[tuple[object, int], Passage] = {}
        self.relays: dict[tuple[object, int], tuple[Passage, int]] = {}
        self.losses: list[FrameLoss] = []
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

    def begin(self, medium: int, source: int, receivers: int, carrier: AnyCarrier, token: object,
              now_ns: int) -> Passage:
        """A frame is given to a medium."""
        held, handed_ns = self._wait or (TimePart.RESOLUTION, now_ns)
        self._wait = None
        first_ns = min(carrier.first_sent(token, now_ns), handed_ns)
        return Passage(medium, source, first_ns, handed_ns, held, now_ns, receivers,
                       self.arriving if carrier.continues else None)


class ItemizedCarrier(WrappedCarrier[Any]):
    """The carrier of a frame on an ``ItemizedMedium``. It passes each fate on to the frame's own
    ``carrier``; meanwhile ``passages`` has this frame's ``passage`` as arriving or losing."""

    __slots__ = ("passage", "_passages", "_kernel", "_people")

    def __init__(self, passage: Passage, carrier: AnyCarrier, passages: Passages, kernel: Kernel,
                 people: Callable[[int, int], int]) -> None:
        """``people`` counts those who stand between two hosts."""
        self.passage, self._carrier = passage, carrier
        self._passages, self._kernel, self._people = passages, kernel, people

    @property
    def ahead(self) -> bool:  # type: ignore[override] # read once, at the settlement
        return self._carrier.ahead

    def expected(self, token: object, receiver: int, arrival_ns: int) -> None:
        self._passages.expected[token, receiver] = self.passage
        self.passage.left -= 1
        self._carrier.expected(token, receiver, arrival_ns)

    def arrived(self, token: object, receiver: int) -> None:
        self.passage.left -= 1
        passages = self._passages
        before, passages.arriving = passages.arriving, self.passage
        self._carrier.arrived(token, receiver)
        passages.arriving = before

    def arrived_many(self, token: object, receivers: Sequence[int]) -> None:
        self.passage.left -= len(receivers)
        passages = self._passages
        before, passages.arriving = passages.arriving, self.passage
        self._carrier.arrived_many(token, receivers)
        passages.arriving = before

    def arrived_in_part(self, token: object, receiver: int, lost: dict[int, str]) -> None:
        """The packets that arrive may deliver messages, and the ``lost`` ones lose others."""
        self.passage.left -= 1
        passages = self._passages
        before = passages.arriving, passages.losing
        passages.arriving = passages.losing = self.passage
        for reason in sorted(set(lost.values())):
            self._lose(receiver, reason)
        self._carrier.arrived_in_part(token, receiver, lost)
        passages.arriving, passages.losing = before

    def lost(self, token: object, receiver: int, reason: str) -> None:
        self.passage.left -= 1
        passages = self._passages
        before, passages.losing = passages.losing, self.passage
        self._lose(receiver, reason)
        self._carrier.lost(token, receiver, reason)
        passages.losing = before

    def missed(self, token: object, receivers: Collection[int], reason: str,
               medium: Medium) -> None:
        self.passage.left -= len(receivers)
        passages = self._passages
        before, passages.losing = passages.losing, self.passage
        self._carrier.missed(token, receivers, reason, medium)
        passages.losing = before

    def _lose(self, receiver: int, reason: str) -> None:
        passage = self.passage
        self._passages.losses.append(FrameLoss(
            self._kernel.now_ns, passage.source, receiver, reason, passage.medium,
            passage.place_of_loss(receiver), self._people(passage.source, receiver)))

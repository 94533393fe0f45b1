"""A medium that keeps the parts of each frame's time, for a run with a ledger."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from typing import Any, TypeVar

from desim.network.carrier import Carrier
from desim.network.flights import Flights
from desim.network.held_frames import HeldFrames
from desim.network.medium import Medium
from desim.network.passages import ItemizedCarrier, KnownMedium, Passage, Passages
from desim.network.terms import Claim
from desim.ports import Frame, Itemizes, KnowsHandovers, NetworkModel, TimePart

T = TypeVar("T")


class FrameLedger:
    """The ``ports.Ledger`` of one medium: its passages by frame."""

    def __init__(self) -> None:
        self.open: dict[int, Passage] = {}

    def spent(self, frame: Frame, part: TimePart, time_ns: int, receiver: int | None = None,
              host: int | None = None) -> None:
        if time_ns and frame.id in self.open:
            self.open[frame.id].spent(part, time_ns, receiver, host)

    def lost_at(self, frame: Frame, host: int, receiver: int | None = None) -> None:
        if frame.id in self.open:
            self.open[frame.id].lost_at(host, receiver)

    def forget(self) -> None:
        """Forget the passages that have all their fates."""
        self.open = {number: passage for number, passage in self.open.items() if passage.left > 0}


class ItemizedFlights(Flights):
    """Flights that enter in each passage when it will be over."""

    __slots__ = ()

    def begin(self, source: int, claim: Claim, delay_ns: int) -> None:
        carrier, _, receiver, *_ = claim
        self._enter(carrier, receiver, delay_ns)
        super().begin(source, claim, delay_ns)

    def begin_on_terms(self, source: int, claim: Claim, delay_ns: int) -> None:
        carrier, _, receiver, _, _, terms = claim
        self._enter(carrier, receiver, delay_ns, terms.delay_ns)
        super().begin_on_terms(source, claim, delay_ns)

    def begin_all(self, source: int, carrier: Carrier[T], token: T,
                  receivers: Collection[int], size_bytes: int, segments: int, delay_ns: int
                  ) -> None:
        for receiver in receivers:
            self._enter(carrier, receiver, delay_ns)
        super().begin_all(source, carrier, token, receivers, size_bytes, segments, delay_ns)

    def _enter(self, carrier: Carrier[Any], receiver: int, delay_ns: int, rules_ns: int = 0
               ) -> None:
        assert isinstance(carrier, ItemizedCarrier)
        passage = carrier.passage
        begin_ns = passage.sent_ns + passage.queued_ns
        passage.settled(receiver, self._kernel.now_ns + delay_ns - begin_ns, rules_ns)


class ItemizedHeldFrames(HeldFrames):
    """Held frames that enter in each passage how long they are held."""

    __slots__ = ()

    def hold(self, wait_ns: int, frame: Frame, claims: Sequence[Claim], send: Callable[[], object]
             ) -> None:
        carrier = claims[0][0]
        assert isinstance(carrier, ItemizedCarrier)
        carrier.passage.queued_ns = wait_ns
        super().hold(wait_ns, frame, claims, send)


class ItemizedMedium(Medium):
    """A ``Medium`` whose frames have passages. ``itemized``: whether its model enters their
    parts."""

    __slots__ = ("itemized", "_passages", "_number", "_ledger", "_due")

    Flights, HeldFrames = ItemizedFlights, ItemizedHeldFrames

    def __init__(self, passages: Passages, name: str, model: NetworkModel, *args: Any,
                 **kwargs: Any) -> None:
        self._passages, self._ledger = passages, FrameLedger()
        self._number, self._due = len(passages.media), 1 << 10
        self.itemized = isinstance(model, Itemizes)
        if isinstance(model, Itemizes):
            model.itemize(self._ledger)
        super().__init__(name, model, *args, **kwargs)
        associations = model if isinstance(model, KnowsHandovers) else None
        points = () if associations is None else [one.name for one in associations.access_points]
        passages.media.append(KnownMedium(name, (*self.hosts, *points), associations))

    def transmit(self, source: int, receivers: tuple[int, ...], size_bytes: int, segments: int,
                 broadcast: bool, carrier: Carrier[T], token: T, at_once: bool = False
                 ) -> int | None:
        passage = self._passages.begin(self._number, source, len(receivers), carrier, token,
                                       self._kernel.now_ns)
        ledger = self._ledger
        if len(ledger.open) >= self._due:
            ledger.forget()
            self._due = 2 * len(ledger.open) + (1 << 10)
        ledger.open[self.frames + 1] = passage
        itemized = ItemizedCarrier(passage, carrier, self._passages, self._kernel,
                                   self._people_between)
        due_ns = super().transmit(source, receivers, size_bytes, segments, broadcast, itemized,
                                  token, at_once)
        if at_once and due_ns is not None:
            passage.left = 0
        return due_ns

    def _people_between(self, host: int, other: int) -> int:
        """The number of people on the line between two hosts; 0 under access points."""
        place, ends = self._place, [host, other]
        if place.obstacles.people is None or len(self._passages.media[self._number].places) > len(
                self.hosts):
            return 0
        line_m = place.positions(self._kernel.now_ns)[ends].reshape(1, 4)
        return int(place.obstacles.people_on(line_m, place.antennas.height_m[ends][None])[0])

    def lets_pass(self, source: int, receivers: tuple[int, ...], size_bytes: int, segments: int
                  ) -> bool:
        """False: each frame has a passage of its own."""
        return False


"""A medium on a kernel of its own, with a log of every fate."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np

from desim import ports
from desim.engine.kernel import Kernel, Phase
from desim.engine.streams import Streams
from desim.engine.trace import Names
from desim.network.carrier import Carrier
from desim.network.itemized_medium import ItemizedMedium
from desim.network.medium import Medium
from desim.network.passages import Passages, Stamp
from desim.network.surroundings import Still
from desim.units import NS_PER_S

T = TypeVar("T")

HOUR_NS = 3600 * NS_PER_S

Fate = tuple[int, object, str, str, str]  # time_ns, label, source, receiver, fate
Token = tuple[object, str]  # label, source


class Bench(Carrier[Token]):
    """A medium on a kernel of its own, with named hosts at fixed places and a log of every fate.

    ``places``: host name to x, y in m (NaN: none), or a number of hosts without a place, called
    ``host_1``, ``host_2``, ... ``log`` has (time_ns, label, source, receiver, fate), the fate being
    ``"arrived"`` or the reason of a drop; ``"arrived in part"`` for a train that lost some packets,
    which ``parts`` names (label, receiver, packet number to reason); ``"repeated"`` for a copy
    behind an arrival.

    With ``passages`` a ledger is kept: ``spent`` then has the parts of the time of each
    frame that arrived (label, source, receiver, ns from sending to arrival, stamps).
    """

    def __init__(self, model: ports.NetworkModel,
                 places: dict[str, tuple[float, float]] | int = 4, *,
                 rules: Sequence[ports.Rule] = (), seed: int = 0,
                 passages: Passages | None = None) -> None:
        if isinstance(places, int):
            places = {f"host_{i}": (np.nan, np.nan) for i in range(1, places + 1)}
        self.hosts = tuple(sorted(places, key=ports.natural_key))
        self.kernel = Kernel()
        self.names = Names()
        self.log: list[Fate] = []
        self.parts: list[tuple[object, str, dict[int, str]]] = []
        self.spent: list[tuple[object, str, str, int, list[Stamp]]] = []
        self._passages = passages
        place = Still(np.array([places[host] for host in self.hosts]))
        new_medium = Medium if passages is None else partial(ItemizedMedium, passages)
        self.medium = new_medium("bench", model, rules, kernel=self.kernel, names=self.names,
                                 streams=Streams(seed), hosts=self.hosts, place=place)

    def send(self, time_ns: int, source: str, receivers: str | Sequence[str], size_bytes: int,
             segments: int = 1, label: object = None, broadcast: bool = False) -> None:
        """Book a frame. It is logged under ``label``."""
        receivers = (receivers,) if isinstance(receivers, str) else tuple(receivers)
        indices = tuple(sorted(map(self.hosts.index, receivers)))

        def transmit(_: object) -> None:
            self.medium.transmit(self.hosts.index(source), indices, size_bytes, segments, broadcast,
                                 self, (label, source))

        self.kernel.at(time_ns, Phase.CONTROL, self.names.id(source), transmit)

    def send_burst(self, time_ns: int, source: str, receivers: Sequence[str], size_bytes: int,
                   segments: int, label: object, singly: bool) -> None:
        """Book frames of ``source``, one to each of ``receivers``: ``singly``, or at once, where
        the rules let all of them pass."""
        medium, own = self.medium, self.hosts.index(source)
        indices = tuple(sorted(map(self.hosts.index, receivers)))

        def transmit(_: object) -> None:
            if singly or not medium.lets_pass(own, indices, size_bytes, segments):
                for receiver in indices:
                    medium.transmit(own, (receiver,), size_bytes, segments, False, self,
                                    (label, source))
            else:
                medium.transmit_many(own, indices, size_bytes, segments,
                                     _Burst(self, own, indices, size_bytes, segments),
                                     (label, source))

        self.kernel.at(time_ns, Phase.CONTROL, self.names.id(source), transmit)

    def book(self, time_ns: int, fn: Callable[[T], object], arg: T) -> None:
        """Call ``fn(arg)`` at ``time_ns``, before any frame of that instant."""
        self.kernel.at(time_ns, Phase.WORLD, 0, fn, arg)

    def run(self, until_ns: int = HOUR_NS) -> list[Fate]:
        """Play what is booked; returns ``log``."""
        self.kernel.run(until_ns)
        return self.log

    def topics(self, token: Token) -> tuple[str, ...]:
        """A host sends messages of one topic."""
        return (f"/{token[1]}/frames",)

    def arrived(self, token: Token, receiver: int) -> None:
        self._note(token, receiver, "arrived")

    def arrived_in_part(self, token: Token, receiver: int, lost: dict[int, str]) -> None:
        self.parts.append((token[0], self.hosts[receiver], lost))
        self._note(token, receiver, "arrived in part")

    def lost(self, token: Token, receiver: int, reason: str) -> None:
        self._note(token, receiver, reason)

    def missed(self, token: Token, receivers: Collection[int], reason: str,
               medium: Medium) -> None:
        for receiver in receivers:
            self._note(token, receiver, reason)

    def repeated(self, token: Token, receiver: int) -> None:
        self._note(token, receiver, "repeated")

    def _note(self, token: Token, receiver: int, fate: str) -> None:
        if self._passages is not None and self._passages.arriving is not None \
                and fate.startswith("arrived"):
            passage = self._passages.arriving
            self.spent.append((*token, self.hosts[receiver],
                               self.kernel.now_ns - passage.sent_ns, passage.stamps(receiver)))
        self.log.append((self.kernel.now_ns, *token, self.hosts[receiver], fate))


@dataclass(frozen=True)
class _Burst:
    """Frames that set out together; ``bench`` logs the fate of each."""

    bench: Bench
    source: int
    receivers: tuple[int, ...]
    size_bytes: int
    segments: int

    @property
    def members(self) -> list[Bench]:
        return [self.bench] * len(self.receivers)

    def expected_many(self, token: Token, delays_ns: Sequence[int]) -> None:
        """Book the arrivals."""
        now_ns, flights = self.bench.kernel.now_ns, self.bench.medium.flights
        for receiver, delay_ns in zip(self.receivers, delays_ns, strict=False):
            flights.book(self.source, receiver, self.size_bytes, self.segments, self.bench, token,
                         now_ns + delay_ns)


class ImmediateNetwork:
    """The network model behind a rule under test: everything arrives at once."""

    Params = ports.Params
    reasons: tuple[str, ...] = ()

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self._context = context

    def send(self, frame: ports.Frame) -> None:
        self._context.settle_many(frame, frame.receivers, ports.Deliver(0))

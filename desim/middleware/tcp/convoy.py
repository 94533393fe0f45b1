"""Convoys: one message to several hosts, by express over connections that are all at rest.

A robot that says where it is says so to all others in one instant. Each of them could be sent its
message by itself (``Express.send``), with the same outcome; here the network model is asked once
for all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from desim.middleware.arp import AddressedCarrier
from desim.middleware.transports import on_wire

if TYPE_CHECKING:
    from desim.middleware.tcp.connection import Connection
    from desim.middleware.tcp.implied_acknowledgements import Express, Flight
    from desim.ports.middleware import Route


class Convoy:
    """``expresses`` of one host over connections to several others by one ``medium``. It stands for
    the carriers of frames that set out together (``desim.network.carrier.Carriers``)."""

    __slots__ = ("_medium", "_kernel", "_host", "_receivers", "_members", "_expected")

    def __init__(self, medium: Route, expresses: Sequence[Express]) -> None:
        end = expresses[0].end
        self._medium, self._kernel = medium, end.connection.tcp.context.kernel
        self._host = end.host
        self._receivers = tuple(express.end.peer for express in expresses)
        self._members = [_Member(number, express) for number, express in enumerate(expresses)]
        self._expected = 0  # how many of the first members' arrivals are known

    def __getitem__(self, i: int) -> _Member:
        return self._members[i]

    def is_free(self, size_bytes: int) -> bool:
        """Whether a message of ``size_bytes`` may go to all at once: nothing is under way, all
        addresses are known, and no rule of the medium has anything to say."""
        for member in self._members:
            if not member.express.may_begin(size_bytes):
                return False
        return self._medium.lets_pass(self._host, self._receivers, *on_wire(size_bytes))

    def send(self, flights: Sequence[Flight]) -> None:
        """Send the message, which is of one size, to each: ``flights`` are in order of the senders.
        """
        on_wire_bytes, segments = on_wire(flights[0][0])
        for member, flight in zip(self._members, flights, strict=True):
            member.express.begin(flight, on_wire_bytes)
            member.express.way.used_ns = flight[4]
        self._expected = 0
        self._medium.transmit_many(self._host, self._receivers, on_wire_bytes, segments, self,
                                   flights)
        for member in self._members[self._expected:]:
            member.express.watch(None)

    def expected_many(self, flights: Sequence[Flight], delays_ns: Sequence[int]) -> None:
        """See ``desim.network.carrier.Carriers``."""
        self._expected = len(delays_ns)
        now_ns, book = self._kernel.now_ns, self._medium.book
        frame = on_wire(flights[0][0])
        for member, flight, delay_ns in zip(self._members, flights, delays_ns, strict=False):
            express, arrival_ns = member.express, now_ns + delay_ns
            book(self._host, self._receivers[member.number], *frame, express, flight, arrival_ns)
            express.watch(arrival_ns)


class _Member(AddressedCarrier["Sequence[Flight]"]):
    """The carrier of one sender's frames where the network does not know their fate at once."""

    protocol = "tcp"
    __slots__ = ("number", "express")

    def __init__(self, number: int, express: Express) -> None:
        self.number, self.express = number, express

    @property
    def socket(self) -> Express:
        return self.express

    @property
    def conversation(self) -> Connection:
        return self.express.conversation

    def first_sent(self, flights: Sequence[Flight], now_ns: int) -> int:
        return self.express.first_sent(flights[self.number], now_ns)

    def arrived(self, flights: Sequence[Flight], receiver: int) -> None:
        self.express.arrived(flights[self.number], receiver)

    def arrived_in_part(self, flights: Sequence[Flight], receiver: int, lost: dict[int, str]
                        ) -> None:
        self.express.arrived_in_part(flights[self.number], receiver, lost)

    def lost(self, flights: Sequence[Flight], receiver: int, reason: str) -> None:
        self.express.lost(flights[self.number], receiver, reason)

    def repeated(self, flights: Sequence[Flight], receiver: int) -> None:
        self.express.repeated(flights[self.number], receiver)

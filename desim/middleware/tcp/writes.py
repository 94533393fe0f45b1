"""A train of small packets: pieces that were written one by one, without Nagle's algorithm."""

from __future__ import annotations

from typing import TYPE_CHECKING

from desim.middleware.arp import AddressedCarrier

if TYPE_CHECKING:
    from desim.middleware.tcp.receiver import Receiver, Train


class Writes(AddressedCarrier["Train"]):
    """The carrier of a train of ``packets`` equal pieces (to a byte) to ``socket``."""

    __slots__ = ("socket", "_packets")
    socket: Receiver

    def __init__(self, socket: Receiver, packets: int) -> None:
        self.socket = socket
        self._packets = packets

    def arrived(self, train: Train, receiver: int) -> None:
        self.socket.arrived(train, receiver)

    def arrived_in_part(self, train: Train, receiver: int, lost: dict[int, str]) -> None:
        start, size, packets = train[0], train[1] - train[0], self._packets
        self.socket.arrived_in_part(train, receiver, lost, [
            start + size * number // packets for number in range(packets + 1)])

    def lost(self, train: Train, receiver: int, reason: str) -> None:
        self.socket.lost(train, receiver, reason)

    def repeated(self, train: Train, receiver: int) -> None:
        self.socket.repeated(train, receiver)

    def unresolved(self, train: Train) -> None:
        self.socket.unresolved(train)

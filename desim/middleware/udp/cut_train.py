"""A train of datagrams that goes out in parts, because its socket has no room for all of it."""

from __future__ import annotations

from collections.abc import Collection

from desim.network.carrier import AnyCarrier, WrappedCarrier
from desim.ports import packet_sizes


class CutTrain(WrappedCarrier[range]):
    """The carrier of the parts of a train; the token of each is its packets, by their numbers. The
    train's own ``carrier`` hears of its fate at a receiver when all parts have one there."""

    __slots__ = ("_token", "_packets", "_left", "_lost")

    def __init__(self, carrier: AnyCarrier, token: object, receivers: Collection[int], packets: int,
                 parts: int) -> None:
        self._carrier, self._token, self._packets = carrier, token, packets
        self._left = dict.fromkeys(receivers, parts)
        self._lost: dict[int, dict[int, str]] = {receiver: {} for receiver in receivers}

    def topics(self, token: range) -> tuple[str, ...]:
        return self._carrier.topics(self._token)

    def first_sent(self, token: range, now_ns: int) -> int:
        return self._carrier.first_sent(self._token, now_ns)

    def unresolved(self, token: range) -> None:
        self._carrier.unresolved(self._token)

    def arrived(self, token: range, receiver: int) -> None:
        left = self._left
        left[receiver] -= 1
        if not left[receiver]:
            self._carrier.settled(self._token, receiver, self._packets, self._lost[receiver])

    def arrived_in_part(self, token: range, receiver: int, lost: dict[int, str]) -> None:
        self._settle(receiver, {token[number]: reason for number, reason in lost.items()})

    def lost(self, token: range, receiver: int, reason: str) -> None:
        self._settle(receiver, dict.fromkeys(token, reason))

    def missed(self, token: range, receivers: Collection[int], reason: str, medium: object) -> None:
        for receiver in receivers:
            self.lost(token, receiver, reason)

    def repeated(self, token: range, receiver: int) -> None:
        """The train is repeated with its last part."""
        if token.stop == self._packets:
            self._carrier.repeated(self._token, receiver)

    def _settle(self, receiver: int, lost: dict[int, str]) -> None:
        """A part has lost some of its packets."""
        self._lost[receiver] |= lost
        self.arrived(range(0), receiver)


def parts_of(size_bytes: int, packets: int, each: int, most: int) -> list[tuple[range, int]]:
    """A train of datagrams of ``each`` packets, in parts of whole datagrams and about ``most``
    packets: the packets and bytes of each part."""
    step = max(1, most // each) * each
    sizes = packet_sizes(size_bytes, packets)
    return [(range(start, min(packets, start + step)), sum(sizes[start:start + step]))
            for start in range(0, packets, step)]

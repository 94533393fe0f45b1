"""Ways of frames that may change during a run, or lead over several media through other hosts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from desim.network.carrier import AnyCarrier, WrappedCarrier
from desim.network.medium import Medium
from desim.ports import packet_sizes

# The legs of a way: the medium of each, and the host (index) at its end.
Path = tuple[tuple[Medium, int], ...]
# Notes a forwarded frame: the forwarding host, sender, receiver (indices), and the frame's bytes.
OnForward = Callable[[int, int, int, int], object]


class Way:
    """The way between two hosts, in both directions: what ``Medium.transmit`` does, over the path
    that ``path(source, receiver)`` gives now."""

    flights = None  # of no one medium
    refuses: frozenset[str] = frozenset()

    def __init__(self, path: Callable[[int, int], Path], on_forward: OnForward, id_: int) -> None:
        self._path, self._on_forward = path, on_forward
        self.id = id_

    def transmit(self, source: int, receivers: tuple[int, ...], size_bytes: int, segments: int,
                 broadcast: bool, carrier: AnyCarrier, token: Any) -> int | None:
        """As ``Medium.transmit``. Over several media a frame goes to its one receiver, and none
        knows when it will arrive."""
        (receiver,) = receivers
        path = self._path(source, receiver)
        if len(path) == 1:
            return path[0][0].transmit(source, receivers, size_bytes, segments, broadcast, carrier,
                                       token)
        ForwardedFrame(path, source, size_bytes, segments, carrier, token, self._on_forward).go()
        return None

    def first(self, source: int, receiver: int) -> Medium:
        """The medium of the first leg now."""
        return self._path(source, receiver)[0][0]

    def post(self, source: int, receivers: tuple[int], size_bytes: int, carrier: AnyCarrier,
             token: Any) -> int | None:
        """As ``Medium.post``."""
        path = self._path(source, receivers[0])
        if len(path) == 1:
            return path[0][0].post(source, receivers, size_bytes, carrier, token)
        self.transmit(source, receivers, size_bytes, 1, False, carrier, token)
        return None


class ForwardedFrame(WrappedCarrier[Any]):
    """The carrier of one frame that other hosts pass on, on each leg of its ``path``. It is stored
    and forwarded, without a time of its own, as IP does. Packets that one leg has lost do not go
    over the next. What rules copy on the way to a forwarding host ends there.

    Its sender's ``carrier`` hears of its fate at the end of the path.
    """

    __slots__ = ("_path", "_leg", "_source", "_receiver", "_from", "_size_bytes", "_packets",
                 "_lost", "_token", "_on_forward")

    def __init__(self, path: Path, source: int, size_bytes: int, segments: int,
                 carrier: AnyCarrier, token: Any, on_forward: OnForward) -> None:
        self._path, self._leg = path, 0
        self._source, self._from, self._receiver = source, source, path[-1][1]
        self._size_bytes = size_bytes
        self._packets = tuple(range(segments))  # that are left, by their numbers
        self._lost: dict[int, str] = {}
        self._carrier, self._token, self._on_forward = carrier, token, on_forward

    def go(self) -> None:
        """Send it over the present leg."""
        medium, to = self._path[self._leg]
        medium.transmit(self._from, (to,), self._size_bytes, len(self._packets), False, self,
                        self._token)

    @property
    def continues(self) -> bool:  # type: ignore[override] # from the second leg on
        return self._leg > 0

    def arrived(self, token: Any, host: int) -> None:
        if self._leg + 1 < len(self._path):
            self._leg += 1
            self._from = host
            self._on_forward(host, self._source, self._receiver, self._size_bytes)
            self.go()
        else:
            self._carrier.settled(token, host, len(self._packets) + len(self._lost), self._lost)

    def arrived_in_part(self, token: Any, host: int, lost: dict[int, str]) -> None:
        sizes = packet_sizes(self._size_bytes, len(self._packets))
        self._size_bytes -= sum(sizes[number] for number in lost)
        self._lost |= {self._packets[number]: reason for number, reason in lost.items()}
        self._packets = tuple(number for number in self._packets if number not in self._lost)
        self.arrived(token, host)

    def lost(self, token: Any, host: int, reason: str) -> None:
        self._carrier.lost(token, self._receiver, reason)

    def repeated(self, token: Any, host: int) -> None:
        if host == self._receiver:
            self._carrier.repeated(token, host)

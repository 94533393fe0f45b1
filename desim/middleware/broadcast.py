"""The account of one broadcast frame: at whom of its receivers it is settled already.

It costs nothing for those whom no settlement names, most of a large fleet: they are counted when
the rest is settled at once, and looked for only by who asks.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Collection, Iterator, Sequence
from typing import Any


class Broadcast:
    """A frame for ``receivers`` (ascending); ``carrier`` and ``token`` are its sender's, and
    ``delays_ns`` by receiver are what rules add (None: nothing)."""

    __slots__ = ("carrier", "token", "size_bytes", "receivers", "delays_ns", "left", "_settled")

    def __init__(self, carrier: Any, token: Any, size_bytes: int, receivers: tuple[int, ...],
                 delays_ns: dict[int, int] | None) -> None:
        self.carrier = carrier
        self.token = token
        self.size_bytes = size_bytes
        self.receivers = receivers
        self.delays_ns = delays_ns
        self.left = len(receivers)
        self._settled: set[int] = set()

    def settle(self, receivers: Sequence[int] | None) -> Collection[int]:
        """It is settled at ``receivers`` now, None: at all that are left. Returns them. Raises
        ``KeyError`` for one at whom it is settled already, or whom it was not meant for."""
        if receivers is None or receivers is self.receivers and not self._settled:
            rest = Rest(self) if self._settled else self.receivers
            self.left = 0
            return rest
        for receiver in receivers:
            if receiver in self._settled or not self._meant_for(receiver):
                raise KeyError(receiver)
            self._settled.add(receiver)
        self.left -= len(receivers)
        return tuple(receivers)

    def claim(self, receiver: int) -> tuple[Any, Any, int, int, int]:
        """A medium's ``Claim`` of one receiver."""
        delay_ns = self.delays_ns[receiver] if self.delays_ns else 0
        return self.carrier, self.token, receiver, self.size_bytes, delay_ns

    def _meant_for(self, receiver: int) -> bool:
        place = bisect_left(self.receivers, receiver)
        return place < len(self.receivers) and self.receivers[place] == receiver


class Rest:
    """The receivers whom no settlement of a broadcast has named."""

    __slots__ = ("_receivers", "_others")

    def __init__(self, broadcast: Broadcast) -> None:
        self._receivers = broadcast.receivers
        self._others = broadcast._settled

    def __len__(self) -> int:
        return len(self._receivers) - len(self._others)

    def __iter__(self) -> Iterator[int]:
        return (receiver for receiver in self._receivers if receiver not in self._others)

    def __contains__(self, receiver: object) -> bool:
        return receiver in self._receivers and receiver not in self._others

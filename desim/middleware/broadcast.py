"""The account of one broadcast frame: at whom of its receivers it is settled already.

It costs nothing for those whom no settlement names, most of a large fleet: they are counted when
the rest is settled at once, and looked for only by who asks.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from typing import Any

from desim.ports import Frame


class Broadcast:
    """``carrier`` and ``token`` are its sender's; ``delays_ns`` by receiver are what rules add
    (None: nothing). It is not settled yet at so many as are ``left``."""

    __slots__ = ("carrier", "token", "frame", "delays_ns", "left", "_settled")

    def __init__(self, carrier: Any, token: Any, frame: Frame,
                 delays_ns: dict[int, int] | None) -> None:
        self.carrier = carrier
        self.token = token
        self.frame = frame
        self.delays_ns = delays_ns
        self.left = len(frame.receivers)
        self._settled: set[int] = set()

    def settle(self, receivers: Sequence[int] | None) -> Collection[int]:
        """It is settled at ``receivers`` now, None: at all that are left. Returns them. Raises
        ``KeyError`` if it is settled at one of them already, or was not meant for one."""
        frame, settled = self.frame, self._settled
        if receivers is None or receivers is frame.receivers and not settled:
            self.left = 0
            return Rest(frame.receivers, settled) if settled else frame.receivers
        before, count = len(settled), len(receivers)
        settled.update(receivers)
        if len(settled) < before + count or len(frame.among(receivers)) < count:
            raise KeyError(receivers)
        self.left -= count
        return tuple(receivers)

    def claim(self, receiver: int) -> tuple[Any, Any, int, int, int]:
        """A medium's ``Claim`` of one receiver."""
        delay_ns = self.delays_ns[receiver] if self.delays_ns else 0
        return self.carrier, self.token, receiver, self.frame.size_bytes, delay_ns


class Rest:
    """The receivers whom no settlement of a broadcast has named."""

    __slots__ = ("_receivers", "_others")

    def __init__(self, receivers: tuple[int, ...], others: set[int]) -> None:
        self._receivers = receivers
        self._others = others

    def __len__(self) -> int:
        return len(self._receivers) - len(self._others)

    def __iter__(self) -> Iterator[int]:
        return (receiver for receiver in self._receivers if receiver not in self._others)

    def __contains__(self, receiver: object) -> bool:
        return receiver in self._receivers and receiver not in self._others

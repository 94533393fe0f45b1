"""The account of one broadcast frame: at whom of its receivers it is settled already.

It costs nothing for those whom no settlement names, most of a large fleet: they are counted when
the rest is settled at once, and looked for only by who asks.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from typing import Any

from desim.ports import Frame

# What the rules say of a frame at one receiver: delay_ns to add, and how much later copies come.
Terms = tuple[int, tuple[int, ...]]

PLAIN: Terms = (0, ())  # the terms where no rule has anything to say


class Broadcast:
    """``carrier`` and ``token`` are its sender's; ``terms`` by receiver are those of the rules
    (None: plain ones). It is not settled yet at so many as are ``left``."""

    __slots__ = ("carrier", "token", "frame", "terms", "left", "_settled")

    def __init__(self, carrier: Any, token: Any, frame: Frame,
                 terms: dict[int, Terms] | None) -> None:
        self.carrier = carrier
        self.token = token
        self.frame = frame
        self.terms = terms
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

    def claim(self, receiver: int) -> tuple[Any, Any, int, int, Terms]:
        """A medium's ``Claim`` of one receiver."""
        terms = PLAIN if self.terms is None else self.terms[receiver]
        return self.carrier, self.token, receiver, self.frame.size_bytes, terms


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

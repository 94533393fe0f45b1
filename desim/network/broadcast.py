"""An open broadcast: the receivers at which it is not settled yet.

Receivers that no settlement names, most of a large fleet, cost nothing: they are counted when the
rest is settled at once, and listed only on demand.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence

from desim.network.carrier import AnyCarrier
from desim.network.terms import PLAIN, Claim, Terms
from desim.ports import Frame


class Broadcast:
    """A frame that is not settled yet at ``left`` receivers. ``carrier`` and ``token`` are its
    sender's; ``terms`` are by receiver (None: plain ones)."""

    __slots__ = ("carrier", "token", "frame", "terms", "left", "_settled", "_dropped")

    def __init__(self, carrier: AnyCarrier, token: object, frame: Frame,
                 terms: dict[int, Terms] | None) -> None:
        self.carrier = carrier
        self.token = token
        self.frame = frame
        self.terms = terms
        self.left = len(frame.receivers)
        self._settled: set[int] = set()
        self._dropped: dict[int, set[int]] = {}  # by receiver: packets, by the model

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
        return receivers

    def claim(self, receiver: int) -> Claim:
        """The claim of one receiver."""
        terms = PLAIN if self.terms is None else self.terms[receiver]
        frame = self.frame
        return self.carrier, self.token, receiver, frame.size_bytes, frame.segments, terms

    def lacking(self, receivers: Collection[int]) -> int:
        """The number of packets that are lost at ``receivers``, taken together."""
        return 0 if self.terms is None else sum(len(self.terms[receiver].lost)
                                                for receiver in receivers)

    def lose(self, receiver: int, terms: Terms) -> None:
        """Packets are lost at a receiver at whom it is not settled yet."""
        if self.terms is None:
            self.terms = dict.fromkeys(self.frame.receivers, PLAIN)
        self.terms[receiver] = terms

    def all_dropped(self, receiver: int, packets: Iterable[int]) -> bool:
        """The model drops ``packets`` at a receiver. Returns whether it has dropped all there."""
        dropped = self._dropped.setdefault(receiver, set())
        dropped.update(packets)
        return len(dropped) == self.frame.segments

    def awaits(self, receiver: int) -> bool:
        """Whether it was meant for ``receiver`` and is not settled there."""
        return bool(self.left and receiver not in self._settled
                    and self.frame.among((receiver,)))


class Rest:
    """The receivers that no settlement of a broadcast has named."""

    __slots__ = ("_receivers", "_others", "_count")

    def __init__(self, receivers: tuple[int, ...], others: set[int]) -> None:
        self._receivers = receivers
        self._others = others
        self._count = len(receivers) - len(others)

    def __len__(self) -> int:
        return self._count

    def __iter__(self) -> Iterator[int]:
        return (receiver for receiver in self._receivers if receiver not in self._others)

    def __contains__(self, receiver: object) -> bool:
        return receiver in self._receivers and receiver not in self._others

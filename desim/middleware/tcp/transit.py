"""One direction of a connection: what is on the wire, and what the network does to it."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, TypeAlias

from desim.middleware.arp import AddressedCarrier
from desim.middleware.tcp.parameters import runs
from desim.middleware.transports import MSS_BYTES

if TYPE_CHECKING:
    from desim.middleware.tcp.receiver import Receiver
    from desim.middleware.tcp.sender import Sender

FIN = "fin"  # the kind of a FIN, which takes a byte of the stream as a message does

Token: TypeAlias = Any  # its user's: a ``Cargo`` where the kind is None, else anything
Entry = tuple[int, Callable[..., object], Token, "str | None"]  # end, arrived, token, kind

# A train. In its header: first byte, end, the first byte that its sender has not received, when it
# was sent, the time that it echoes (-1: none, for it acknowledges nothing new), whether it ends
# with a FIN. Then the number of equal pieces (to a byte) that were written one by one (0: all its
# segments are full but for the last one).
Train = tuple[int, int, int, int, int, bool, int]


class Transit(AddressedCarrier[Train]):
    """One direction of a connection, the one thing that its two ends share.

    The sender appends ``messages`` and removes acknowledged ones; the receiver counts how many of
    them, from the first, it has ``delivered``. ``express_ns``: when the last express message
    arrived. As the carrier of trains it hands what arrives to the receiver, and what only the
    network knows, the losses, to the account and the sender's timer.
    """

    __slots__ = ("messages", "delivered", "express_ns", "sender", "receiver", "arrived", "repeated")
    arrived: Callable[..., object]
    repeated: Callable[..., object]  # a copy is a segment like any other

    def __init__(self, sender: Sender) -> None:
        self.messages: deque[Entry] = deque()
        self.delivered = self.express_ns = 0
        self.sender = sender

    def lead_to(self, receiver: Receiver) -> None:
        """``receiver`` is at the other end."""
        self.receiver = receiver
        self.arrived = self.repeated = receiver.arrived
        receiver.transit = self

    def arrived_in_part(self, train: Train, receiver: int, lost: dict[int, str]) -> None:
        """Some segments have arrived, which the acknowledgement tells."""
        start, end, *_, pieces = train
        bounds = ([start + (end - start) * number // pieces for number in range(pieces + 1)]
                  if pieces else [*range(start, end, MSS_BYTES), end])
        for number, reason in lost.items():
            self.sender.end.lost_train(bounds[number], bounds[number + 1], reason)
        self.sender.retransmission.hide(end)
        self.receiver.take_parts(
            [(bounds[first], bounds[last]) for first, last in runs(len(bounds) - 1, lost)], train)

    def lost(self, train: Train, receiver: int, reason: str) -> None:
        """The medium lost it, which the sender does not know."""
        self.sender.end.lost_train(train[0], train[1], reason)
        self.sender.retransmission.hide(train[1])

    def unresolved(self, train: Train) -> None:
        """The train could not leave: only a retransmission counts (``RetransmissionTimer``)."""
        self.sender.retransmission.unresolved(train[0])

    def clear(self) -> None:
        """Forget all messages."""
        self.messages.clear()
        self.delivered = 0


def parts(entries: Iterable[Entry], begin: int, start: int,
          end: int) -> list[tuple[Token, str | None, int]]:
    """Token, kind and bytes of each message in bytes ``start`` to ``end`` of the stream; the first
    of ``entries`` begins (or is taken to begin) at ``begin``."""
    found = []
    for ends, _, token, kind in entries:
        if begin >= end:
            break
        if ends > start:
            found.append((token, kind, min(ends, end) - max(begin, start)))
        begin = ends
    return found

"""One direction of a connection: its trains, and what its two ends share."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    from desim.middleware.tcp.receiver import Receiver
    from desim.middleware.tcp.sender import Sender

FIN = "fin"  # the kind of a FIN, which takes a byte of the stream as a message does

Token: TypeAlias = Any  # its user's: a ``StreamMessage`` where the kind is None, else anything
Entry = tuple[int, Callable[..., object], Token, "str | None"]  # end, arrived, token, kind

# A train. In its header: first byte, end, the first byte that its sender has not received, when it
# was sent, the time that it echoes (-1: none, for it acknowledges nothing new), whether it ends
# with a FIN. Then the number of equal pieces (to a byte) that were written one by one (0: all its
# segments are full but for the last one).
Train = tuple[int, int, int, int, int, bool, int]


class Transit:
    """One direction of a connection, and the one thing that its two ends share.

    The ``sender`` appends ``messages`` and removes acknowledged ones; the ``receiver`` counts how
    many of them, from the first, it has ``delivered``. ``firsts``, where a ledger is kept: the end
    of each train of new bytes that are not acknowledged, and when it was sent.
    """

    __slots__ = ("messages", "delivered", "firsts", "sender", "receiver")
    receiver: Receiver

    def __init__(self, sender: Sender) -> None:
        self.messages: deque[Entry] = deque()
        self.delivered = 0
        self.firsts: deque[tuple[int, int]] | None = None
        self.sender = sender

    def lose(self, losses: Iterable[tuple[int, int, str]], end: int) -> None:
        """The network has lost bytes (first, end, reason) of a train up to ``end``. Neither end
        knows: they are for the account, and for the sender's model of Linux's timer."""
        for start, stop, reason in losses:
            self.sender.end.lost_train(start, stop, reason)
        self.sender.retransmission.lost_unnoticed(end)

    def first_sent(self, start: int, end: int, now_ns: int) -> int:
        """The time when bytes ``start`` to ``end``, which are sent now, were sent first."""
        firsts, una = self.firsts, self.sender.snd_una
        if firsts is None:
            firsts = self.firsts = deque()
        while firsts and firsts[0][0] <= una:
            firsts.popleft()
        if not firsts or end > firsts[-1][0]:
            firsts.append((end, now_ns))
        return next(sent_ns for stop, sent_ns in firsts if stop > start)

    def topics(self, start: int, end: int) -> tuple[str, ...]:
        """The topics of the messages of data in bytes ``start`` to ``end``."""
        return tuple([message.topic for message, kind, _ in parts(
            self.messages, self.sender.snd_una, start, end) if kind is None])

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

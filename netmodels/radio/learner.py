"""Rate control, as the radio knows it."""

from __future__ import annotations

from typing import NamedTuple, Protocol


class Choice(NamedTuple):
    """The next attempt: the index of its rate among the standard's; a packet of an
    aggregate ``alone``, behind an RTS (``rts``)."""

    rate: int
    alone: bool = False
    rts: bool = False


class Learner(Protocol):
    """The rates of each pair of a sender and a receiver. ``first``: the index of the
    rate that pairs begin with."""

    first: int

    def sent(self, sender: int, receiver: int, packets: int, acknowledged: int, now_ns: int
             ) -> Choice:
        """An attempt is over: ``acknowledged`` of its ``packets`` were. Returns the next one."""
        ...

"""Piggybacked heartbeats: which messages of a writer carry one.

The two rules take messages by their bytes: ``new`` those of a new sample, ``again`` those that are
sent once more.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import accumulate
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from desim.middleware.dds.participant import Participant


class Always:
    """A heartbeat on the last message of each sample, and of each repetition (Cyclone DDS)."""

    def new(self, sizes: Sequence[int]) -> tuple[bool, ...]:
        return (False,) * (len(sizes) - 1) + (True,)

    again = new


class Spent:
    """The bytes, of ``limit_bytes``, that a writer of Fast DDS may still send without a heartbeat.

    As in Fast DDS 2.9.1 (StatefulWriter.cpp, send_heartbeat_piggyback_nts_): behind each message it
    takes off all that its sender has sent *so far*. For a new sample that is the sample up to
    there; repetitions have one sender for a whole participant, which counts since its start.
    """

    def __init__(self, limit_bytes: int) -> None:
        self._limit = self._left = limit_bytes

    def over(self, so_far_bytes: int) -> bool:
        """Whether a heartbeat has to ride now."""
        self._left -= so_far_bytes
        if self._left >= 0:
            return False
        self.sent()
        return True

    def sent(self) -> None:
        """The writer sends a heartbeat, of whatever kind."""
        self._left = self._limit


class WhenFull:
    """A heartbeat on each message while the writer's history is full, otherwise now and then (Fast
    DDS). ``full(count)``: whether the history is full with ``count`` more samples."""

    def __init__(self, full: Callable[[int], bool], limit_bytes: int, sender: Participant) -> None:
        self._full, self._spent, self._sender = full, Spent(limit_bytes), sender

    def new(self, sizes: Sequence[int]) -> tuple[bool, ...]:
        if self._full(1):
            return (True,) * len(sizes)
        return tuple([self._spent.over(so_far) for so_far in accumulate(sizes)])

    def again(self, sizes: Sequence[int]) -> tuple[bool, ...]:
        full, out = self._full(0), []
        for size in sizes:
            self._sender.resent_bytes += size
            out.append(full or self._spent.over(self._sender.resent_bytes))
        return tuple(out)

"""Piggybacked heartbeats: which messages of a writer carry one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Protocol


class HeartbeatPiggyback(Protocol):
    """The rule by which a message, given by its bytes, carries a heartbeat: ``new`` for messages of
    a new sample, ``again`` for those that are sent once more."""

    def new(self, sizes: Sequence[int]) -> tuple[bool, ...]: ...

    def again(self, sizes: Sequence[int]) -> tuple[bool, ...]: ...


class Always:
    """A heartbeat on the last message of each sample, and of each repetition (Cyclone DDS)."""

    def new(self, sizes: Sequence[int]) -> tuple[bool, ...]:
        return _last(len(sizes))

    again = new


@lru_cache(1 << 10)
def _last(count: int) -> tuple[bool, ...]:
    return (False,) * (count - 1) + (True,)


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
        self._left = self._limit
        return True


class Resent:
    """The bytes that a participant has retransmitted since its start."""

    def __init__(self) -> None:
        self.bytes = 0


class WhenFull:
    """A heartbeat on each message while the writer's history is full, otherwise now and then (Fast
    DDS). ``full(count)``: whether the history is full with ``count`` more samples."""

    def __init__(self, full: Callable[[int], bool], limit_bytes: int, resent: Resent) -> None:
        self._full, self._spent, self._resent = full, Spent(limit_bytes), resent

    def new(self, sizes: Sequence[int]) -> tuple[bool, ...]:
        if self._full(1):
            return (True,) * len(sizes)
        so_far = 0
        out: list[bool] = []
        for size in sizes:
            so_far += size
            out.append(self._spent.over(so_far))
        return tuple(out)

    def again(self, sizes: Sequence[int]) -> tuple[bool, ...]:
        full, out = self._full(0), []
        for size in sizes:
            self._resent.bytes += size
            out.append(full or self._spent.over(self._resent.bytes))
        return tuple(out)

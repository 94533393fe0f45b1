"""The instants of messages that come again and again."""

from __future__ import annotations

from collections.abc import Iterator

from desim.results.source import ReplaySource
from desim.units import NS_PER_S

REPEAT_NS = 5 * NS_PER_S  # who joins late sees what stands still


def seconds(recording: ReplaySource) -> Iterator[tuple[int, int]]:
    """The number and the instant of every full second, and of the end."""
    first, end_ns = -(-recording.begin_ns // NS_PER_S), recording.end_ns
    last = -(-end_ns // NS_PER_S)
    yield from ((second, second * NS_PER_S) for second in range(first, last))
    yield last, end_ns


def repeated(instants: list[int], recording: ReplaySource) -> Iterator[int]:
    """``instants``, and each of them again and again until the next one: those of ``recording``."""
    end_ns = recording.end_ns
    inside = [time_ns for time_ns in instants if time_ns <= end_ns]
    for time_ns, next_ns in zip(inside, [*inside[1:], end_ns + 1], strict=True):
        every = range(time_ns, max(next_ns, time_ns + 1), REPEAT_NS)
        yield from (again_ns for again_ns in every if again_ns >= recording.begin_ns)

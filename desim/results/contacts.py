"""The contacts of robots in a recording."""

from __future__ import annotations

from collections.abc import Iterator

from desim.results.source import ReplaySource


def contacts(recording: ReplaySource) -> Iterator[tuple[int, str]]:
    """The instants (ns) at which contacts of robots begin, by time: of both where two meet, as
    their bumpers feel it."""
    for event in recording.events:
        if event.kind == "collision":
            yield event.time_ns, event.entity
            other = event.detail.split()[0]
            if other in recording.robots:
                yield event.time_ns, other

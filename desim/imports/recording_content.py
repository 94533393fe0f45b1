"""The content of a recording that desim can show, whatever its format."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from desim.export.ros.message_types import Message
from desim.imports.trajectories import Trajectory

Corners = tuple[float, float, float, float]


class LinkEntry(NamedTuple):
    """An entry of a recording's log of links: the messages since the entry before, their bytes
    together and their mean latency, and whether frames get through (``linked``; None: it does not
    say)."""

    time_ns: int
    host: str
    other: str
    linked: bool | None
    messages: int
    size_bytes: int
    dropped: int
    latency_ns: int


@dataclass
class RecordingContent:
    """Trajectories by robot, and what else was recorded of them. ``notes`` say what was taken for
    granted, and what was left out."""

    tracks: dict[str, Trajectory] = field(default_factory=dict)
    grids: dict[str, list[tuple[int, Message]]] = field(default_factory=dict)  # by topic
    plans: list[tuple[int, str, str, np.ndarray]] = field(default_factory=list)  # ns, topic, kind,
    links: list[LinkEntry] = field(default_factory=list)                         # [n, 2] m
    # standing from ns on: material and height of walls
    walls: list[tuple[int, dict[Corners, tuple[str, float]]]] = field(default_factory=list)
    explored: list[tuple[int, float]] = field(default_factory=list)  # ns, share
    broken: str | None = None
    notes: list[str] = field(default_factory=list)

    def span_ns(self) -> tuple[int, int]:
        """The first and the last instant. What may have been published long before the recording
        began, such as a map, does not count for the first."""
        begins = [*(int(track.times_ns[0]) for track in self.tracks.values()),
                  *(entry.time_ns for entry in self.links)]
        ends = [*begins, *(int(track.times_ns[-1]) for track in self.tracks.values()),
                *(time_ns for grids in self.grids.values() for time_ns, _ in grids),
                *(row[0] for row in self.plans), *(row[0] for row in self.walls),
                *(row[0] for row in self.explored)]
        return min(begins), max(ends)

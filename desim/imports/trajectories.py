"""The trajectories of a ROS recording: whose they are, and all of them at common times."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from desim.errors import InputError
from desim.imports.frame_tree import FrameTree
from desim.ports import natural_key
from desim.units import NS_PER_S

_STEP_NS = NS_PER_S // 10  # between poses, where robots do not have them at the same times
BASES = ("base_link", "base_footprint", "base")


class Trajectory(NamedTuple):
    """The poses of one robot in the root frame: ``times_ns`` [n] ascending, ``poses`` [n, 3] x m,
    y m, yaw rad. ``source`` is the topic, or the frame, that they come from."""

    source: str
    times_ns: np.ndarray
    poses: np.ndarray


class TopicPoses(NamedTuple):
    """Poses as a topic has them: rows of time ns, x m, y m, yaw rad, in ``frame``."""

    frame: str
    rows: list[tuple[int, float, float, float]]


def tracks(path: Path, topics: Mapping[str, TopicPoses], frames: FrameTree, by_frames: bool
           ) -> dict[str, Trajectory]:
    """The robots of ``path`` by name, in natural order: one for each of ``topics``; where there is
    none, and ``by_frames``, one for each frame that moves, is called base_link or alike, and has no
    such frame above it. Raises ``InputError`` for two of one name."""
    found = {}
    for topic, (frame, rows) in topics.items():
        times_ns, poses = in_order([row[0] for row in rows], np.array(rows, float)[:, 1:])
        found[topic] = Trajectory(topic, times_ns, frames.within(frame, poses, times_ns))
    for frame in frames.children() if by_frames and not topics else ():
        times_ns = np.unique(frames.times_ns(frame))
        if is_base(frame) and len(times_ns) and not any(map(is_base, frames.ancestors(frame))):
            found[frame] = Trajectory(frame, times_ns, frames.within(
                frame, np.zeros((len(times_ns), 3)), times_ns))
    named: dict[str, Trajectory] = {}
    for name, track in zip(_names([source.strip("/").split("/") for source in found]),
                           found.values(), strict=True):
        if name in named:
            raise InputError(f"{path}: {named[name].source} and {track.source} would both be the "
                             f"robot {name}; --topic takes one of them")
        named[name] = track
    return dict(sorted(named.items(), key=lambda item: natural_key(item[0])))


def in_order(times_ns: Sequence[int], poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Poses by ascending times; of those at one time, the first."""
    times, first = np.unique(np.array(times_ns, np.int64), return_index=True)
    return times, poses[first]


def is_base(frame: str) -> bool:
    """Whether a frame is called as that of a robot."""
    return frame.rpartition("/")[2] in BASES


def _names(paths: list[list[str]]) -> list[str]:
    """A name for each path: its first part, if they differ; else what differs between them, or all
    of it."""
    firsts = [path[0] if len(path) > 1 else "robot" for path in paths]
    same = 0
    while len({path[same] for path in paths if len(path) > same}) == 1:
        same += 1
    rest = [path[same:] for path in paths]
    while len({path[-1] for path in rest if len(path) > 1}) == 1 and all(
            len(path) > 1 for path in rest):
        rest = [path[:-1] for path in rest]
    for choice in (firsts, map("_".join, rest)):
        names = list(map(plain_name, choice))
        if len(set(names)) == len(names):
            return names
    return [plain_name("_".join(path)) for path in paths]


def plain_name(name: str) -> str:
    """A name as scenarios have them."""
    name = re.sub(r"\W", "_", name, flags=re.ASCII)
    return name if name[:1].isalpha() else f"robot_{name}"


def together(found: Mapping[str, Trajectory], start_ns: int) -> tuple[np.ndarray, np.ndarray]:
    """``times_ns`` [n] from 0, and [n, robots, 3] the poses of all robots then: as they were given
    where all robots have theirs at the same times, else ten a second, on straight lines between the
    given ones. A robot stands at its first pose before it, and at its last one after it."""
    all_times = [track.times_ns for track in found.values()]
    if all(np.array_equal(times, all_times[0]) for times in all_times):
        times_ns = all_times[0]
    else:
        first, last = (min(times[0] for times in all_times), max(times[-1] for times in all_times))
        times_ns = np.append(np.arange(first, last, _STEP_NS), last)
    columns = []
    for track in found.values():
        since = track.times_ns - times_ns[0]  # floats hold these exactly
        yaw = np.unwrap(track.poses[:, 2])
        columns.append(np.column_stack([np.interp(times_ns - times_ns[0], since, values) for values
                                        in (track.poses[:, 0], track.poses[:, 1], yaw)]))
    poses = np.stack(columns, axis=1)
    if times_ns[0] > start_ns:  # something else was recorded before
        times_ns, poses = np.insert(times_ns, 0, start_ns), np.insert(poses, 0, poses[0], axis=0)
    return times_ns - start_ns, poses

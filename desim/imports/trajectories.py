"""The trajectories of a ROS recording: whose they are, and all of them at common times."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from desim.imports.frame_tree import FrameTree
from desim.ports import natural_key
from desim.units import NS_PER_S

_STEP_NS = NS_PER_S // 10  # between poses, where robots do not have them at the same times
_BASES = ("base_link", "base_footprint", "base")


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


def tracks(topics: Mapping[str, TopicPoses], frames: FrameTree) -> dict[str, Trajectory]:
    """The robots by name, in natural order: one for each of ``topics``; where there is none, one
    for each frame that is called base_link or alike."""
    if topics:
        sources, names = list(topics), _names([topic.split("/")[1:] for topic in topics])
    else:
        sources = [frame for frame in frames.children() if frame.split("/")[-1] in _BASES]
        names = _names([frame.split("/") for frame in sources])
    found = {}
    for name, source in zip(names, sources, strict=True):
        if topics:
            frame, rows = topics[source]
            table = np.array(sorted(rows), float).reshape(-1, 4)
            times_ns, poses = np.array(sorted(row[0] for row in rows), np.int64), table[:, 1:]
        else:
            frame, times_ns = source, np.sort(frames.times_ns(source))
            poses = np.zeros((len(times_ns), 3))
        times_ns, first = np.unique(times_ns, return_index=True)
        found[name] = Trajectory(source, times_ns, frames.in_root(frame, poses[first], times_ns))
    return dict(sorted(found.items(), key=lambda item: natural_key(item[0])))


def _names(paths: list[list[str]]) -> list[str]:
    """A name for each path: its first part, if they differ; else what differs between them."""
    firsts = [path[0] if len(path) > 1 else "robot" for path in paths]
    if len(set(firsts)) == len(firsts):
        return list(map(plain_name, firsts))
    same = 0
    while len({path[same] for path in paths if len(path) > same}) == 1:
        same += 1
    rest = [path[same:] for path in paths]
    while len({path[-1] for path in rest if len(path) > 1}) == 1 and all(
            len(path) > 1 for path in rest):
        rest = [path[:-1] for path in rest]
    return [plain_name("_".join(path)) for path in rest]


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

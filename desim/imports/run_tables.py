"""The tables of a replayed fleet, made of a ROS recording."""

from __future__ import annotations

import numpy as np
import pyarrow as pa

from desim.imports.growing_maps import map_growths
from desim.imports.recording_content import Corners, LinkEntry, RecordingContent
from desim.imports.trajectories import together
from desim.monitor.recorder import ShownPlan, StandingWall
from desim.results.message_log import DELIVERED, DROPPED
from desim.results.parquet import MESSAGE_SCHEMA, TRACE_SCHEMA
from desim.results.recording_tables import (
    growth_table,
    in_mm,
    obstacles_table,
    plans_table,
    poses_table,
    walls_table,
)
from desim.units import MM_PER_M, NS_PER_S

# The topic, and the reason of drops, of messages of which only a log of links knows.
LOGGED, LOGGED_DROP = "/logged", "logged"

Tables = dict[str, pa.Table]


class ReplayedFleet:
    """The robots of a recording, with their poses at common times from 0; the other hosts that its
    log of links names."""

    def __init__(self, content: RecordingContent) -> None:
        self.content, self.tracks = content, content.tracks
        self.robots = tuple(content.tracks)
        named = {host: None for entry in content.links for host in (entry.host, entry.other)}
        self.stations = [host for host in named if host not in self.tracks]
        self._start_ns, end_ns = content.span_ns()
        self.end_ns = end_ns - self._start_ns
        self.times_ns, self.poses = together(content.tracks, self._start_ns)

    def since(self, time_ns: int) -> int:
        """The time from the beginning of the recording on; 0 of what is older."""
        return max(time_ns - self._start_ns, 0)

    def robot_of(self, topic: str) -> str | None:
        """The robot whose poses are recorded in the namespace of ``topic`` (``/robot_0`` of
        ``/robot_0/map``); None: there is none. Without namespaces, a robot that is alone."""
        for robot, track in self.tracks.items():
            stem = "/" + track.source.lstrip("/").rpartition("/")[0]
            if topic.startswith(stem.rstrip("/") + "/") and (
                    stem != "/" or len(self.robots) == 1):
                return robot
        return None


def tables(fleet: ReplayedFleet) -> Tables:
    """All tables by name, as a run leaves them; without trace rows, events and samples."""
    content = fleet.content
    grids = {topic: [(fleet.since(time_ns), grid) for time_ns, grid in own]
             for topic, own in content.grids.items()}
    growths = map_growths(fleet.robots, fleet.end_ns, grids, fleet.robot_of)
    times_ns, shares = _explored(fleet)
    return {"poses": _poses(fleet),
            "moving_obstacles": obstacles_table(np.empty(0, np.int64), np.empty((0, 0, 3))),
            "growth": growth_table(growths), "plans": plans_table(_plans(fleet)),
            "walls": walls_table(_walls(fleet)), "links": _links(fleet),
            "messages": _messages(fleet), "robots": _robots(fleet),
            "events": TRACE_SCHEMA.empty_table(),
            "samples": pa.table({"time_s": pa.array(times_ns / NS_PER_S, pa.float64()),
                                 "explored_union": pa.array(shares, pa.float64())})}


def _poses(fleet: ReplayedFleet) -> pa.Table:
    """The poses; as a run's, they last to the end."""
    times_ns, poses = fleet.times_ns, fleet.poses.copy()
    if times_ns[-1] < fleet.end_ns:
        times_ns, poses = np.append(times_ns, fleet.end_ns), np.append(poses, poses[-1:], axis=0)
    poses[..., 2] = (poses[..., 2] + np.pi) % (2 * np.pi) - np.pi
    return poses_table(times_ns, fleet.robots, poses)


def _plans(fleet: ReplayedFleet) -> list[ShownPlan]:
    return [ShownPlan(fleet.since(time_ns), robot, kind, in_mm(places.reshape(-1, 2)))
            for time_ns, topic, kind, places in fleet.content.plans
            if (robot := fleet.robot_of(topic)) is not None]


def _walls(fleet: ReplayedFleet) -> list[StandingWall]:
    """Each wall, from the first message that shows it to the first one without it."""
    rows: list[StandingWall] = []
    since: dict[Corners, tuple[int, str, float]] = {}
    shown = [(fleet.since(time_ns), standing) for time_ns, standing in fleet.content.walls]
    for time_ns, standing in [*shown, (fleet.end_ns + 1, {})]:
        for corners in [corners for corners in since if corners not in standing]:
            from_ns, material, height_m = since.pop(corners)
            x1, y1, x2, y2 = (round(place * MM_PER_M) for place in corners)
            rows.append(StandingWall(from_ns, time_ns, x1, y1, x2, y2, material,
                                     round(height_m * MM_PER_M)))
        for corners, (material, height_m) in standing.items():
            since.setdefault(corners, (time_ns, material, height_m))
    return rows


def _links(fleet: ReplayedFleet) -> pa.Table:
    """The changes of links."""
    state: dict[tuple[str, str], bool] = {}
    rows = []
    for entry in sorted(fleet.content.links, key=lambda one: one.time_ns):
        pair = entry.host, entry.other
        if entry.linked is not None and entry.linked != state.get(pair, False):
            state[pair] = entry.linked
            rows.append((fleet.since(entry.time_ns) / NS_PER_S, *pair, entry.linked))
    return pa.table({"time_s": pa.array([row[0] for row in rows], pa.float64()),
                     "host": pa.array([row[1] for row in rows], pa.string()),
                     "other": pa.array([row[2] for row in rows], pa.string()),
                     "linked": pa.array([row[3] for row in rows], pa.bool_())})


def _messages(fleet: ReplayedFleet) -> pa.Table:
    """A row for what a link delivered, and one for what it dropped, in each entry of the log: their
    bytes together, and their mean latency."""
    rows: list[tuple[LinkEntry, int, int, str, str | None, int, int | None]] = []
    for entry in fleet.content.links:
        end_ns = max(fleet.since(entry.time_ns) - 1, 0)  # an entry is about the time before it
        born_ns = max(end_ns - entry.latency_ns, 0)
        if entry.messages:
            rows.append((entry, entry.size_bytes, born_ns, DELIVERED, None, end_ns,
                         end_ns - born_ns))
        if entry.dropped:
            rows.append((entry, 0, end_ns, DROPPED, LOGGED_DROP, end_ns, None))
    born = [row[2] for row in rows]
    columns = [range(1, len(rows) + 1), [LOGGED] * len(rows), [row[0].host for row in rows],
               [row[0].other for row in rows], [row[1] for row in rows], born, born, born,
               *([row[i] for row in rows] for i in (3, 4, 5, 6))]
    return pa.table([pa.array(list(column), pa.string()).dictionary_encode()
                     if pa.types.is_dictionary(field.type) else pa.array(list(column), field.type)
                     for column, field in zip(columns, MESSAGE_SCHEMA, strict=True)],
                    schema=MESSAGE_SCHEMA)


def _robots(fleet: ReplayedFleet) -> pa.Table:
    """A row a second and robot: its pose, and the way that it has gone. What it knew is unknown."""
    seconds = np.arange(0, fleet.end_ns + 1, NS_PER_S)
    count, robots = len(seconds), len(fleet.robots)
    steps_m = np.hypot(*np.diff(fleet.poses[..., :2], axis=0).transpose(2, 0, 1))
    ways_m = np.concatenate([np.zeros((1, robots)), np.cumsum(steps_m, axis=0)])

    def at(values: np.ndarray) -> np.ndarray:
        return np.stack([np.interp(seconds, fleet.times_ns, values[:, i])
                         for i in range(robots)], axis=1).ravel()

    unknown = np.full(count * robots, np.nan)
    times_ns, shares = _explored(fleet)
    union = np.interp(seconds, times_ns, shares) if len(times_ns) else np.full(count, np.nan)
    received, sent = _bytes(fleet, seconds)
    return pa.table({
        "time_s": np.repeat(seconds / NS_PER_S, robots), "robot": list(fleet.robots) * count,
        "x_m": at(fleet.poses[..., 0]), "y_m": at(fleet.poses[..., 1]),
        "yaw_rad": at(fleet.poses[..., 2]), "explored": unknown,
        "explored_union": np.repeat(union, robots), "distance_m": at(ways_m),
        "rx_bytes": received.ravel(), "tx_bytes": sent.ravel()})


def _explored(fleet: ReplayedFleet) -> tuple[np.ndarray, np.ndarray]:
    """The instants at which the explored share was recorded, and the shares."""
    rows = [(fleet.since(time_ns), share) for time_ns, share in fleet.content.explored]
    return (np.array([row[0] for row in rows], np.int64), np.array([row[1] for row in rows], float))


def _bytes(fleet: ReplayedFleet, seconds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """[seconds, robots] each: the bytes of messages that a robot has received and sent by then."""
    number = {robot: i for i, robot in enumerate(fleet.robots)}
    both = np.zeros((2, len(seconds), len(fleet.robots)), np.int64)
    for entry in fleet.content.links:
        second = np.searchsorted(seconds, fleet.since(entry.time_ns))
        for way, host in enumerate((entry.other, entry.host)):
            if host in number and second < len(seconds):
                both[way, second, number[host]] += entry.size_bytes
    received, sent = both.cumsum(axis=1)
    return received, sent

"""The topics of a recording: what a fleet with ROS would have recorded, message by message."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from heapq import merge

import numpy as np

from desim.export.link_loads import LinkLoads
from desim.export.ros.laser_scans import Scanner
from desim.export.ros.link_diagnostics import link_log
from desim.export.ros.markers import MAP_FRAME, Markers
from desim.export.ros.message_times import repeated
from desim.export.ros.message_types import (
    DIAGNOSTIC_ARRAY,
    FLOAT64,
    LASER_SCAN,
    MARKER_ARRAY,
    OCCUPANCY_GRID,
    ODOMETRY,
    PATH,
    POSE_STAMPED,
    TF_MESSAGE,
    Message,
    RosTypes,
    Timed,
    TopicMessage,
)
from desim.export.ros.near_by import bumps, sonar_frames, sonar_readings
from desim.monitor.map_growth import MapGrowth
from desim.monitor.recorder import ShownPlan
from desim.results.file_names import SAMPLES
from desim.results.merged_map import known_at
from desim.results.samples import measured
from desim.results.source import ReplaySource
from desim.scenario.schema.robot import SCAN
from desim.units import MM_PER_M, NS_PER_S

EXPLORED = "/explored"  # the topic of the explored share
_LATCHED = ("tf_static", "terrain", "robots", "map")  # last parts of topics
MAP_EVERY_NS = 15 * NS_PER_S  # between maps, if they have grown
_MAP_AGAIN_NS = 60 * NS_PER_S  # if not


def topic_messages(recording: ReplaySource, types: RosTypes, scanner: Scanner | None
            ) -> Iterator[TopicMessage]:
    """All messages of a recording, by time; ``scanner`` is that of its scenario. None: nothing is
    known of its lasers, and there are no scans."""
    markers, loads = Markers(recording, types), LinkLoads(recording)
    streams: list[Iterator[TopicMessage]] = [
        _on("/tf_static", TF_MESSAGE, _fixed(recording, types, scanner)),
        _moving(recording, types),
        _on("/terrain", MARKER_ARRAY, markers.terrain()),
        _on("/robots", MARKER_ARRAY, markers.robots()),
        _on("/links", MARKER_ARRAY, markers.links(loads)),
        _on("/diagnostics", DIAGNOSTIC_ARRAY, link_log(recording, loads, types)),
        _plans(recording, types),
        _on("/map", OCCUPANCY_GRID, _grids(recording.growths, recording, types)),
        _on(EXPLORED, FLOAT64, _explored(recording, types)),
    ]
    if scanner is not None:
        streams += [_scans(recording, types, scanner), sonar_readings(recording, types, scanner),
                    bumps(recording, types, scanner)]
    for robot in recording.robots:
        own = [growth for growth in recording.growths if growth.robot == robot]
        if own:
            streams.append(_on(f"/{robot}/map", OCCUPANCY_GRID, _grids(own, recording, types)))
    return merge(*streams, key=lambda sample: sample.time_ns)


def is_latched(topic: str) -> bool:
    """Whether who subscribes late gets the last message at once."""
    return topic.rpartition("/")[2] in _LATCHED


def _on(topic: str, kind: str, messages: Iterator[Timed]) -> Iterator[TopicMessage]:
    return (TopicMessage(time_ns, topic, kind, message) for time_ns, message in messages)


def _transform(types: RosTypes, time_ns: int, parent: str, child: str,
               pose: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Message:
    x_m, y_m, yaw_rad = pose
    moved = types.make("geometry_msgs/msg/Transform", translation=types.vector(x_m, y_m),
                       rotation=types.turned(yaw_rad))
    return types.make("geometry_msgs/msg/TransformStamped", header=types.header(time_ns, parent),
                      child_frame_id=child, transform=moved)


def _fixed(recording: ReplaySource, types: RosTypes, scanner: Scanner | None) -> Iterator[Timed]:
    """The frames that do not move: odometry starts at the map's origin, lasers and sonars are where
    they are mounted on their robot. Repeated for those who join late."""
    frames: list[tuple[str, str, tuple[float, float, float]]] = []
    for number, robot in enumerate(recording.robots):
        frames.append((MAP_FRAME, f"{robot}/odom", (0.0, 0.0, 0.0)))
        for topic, laser in scanner.lasers[number].items() if scanner else ():
            frames.append((f"{robot}/base_link", _laser_frame(robot, topic),
                           (laser.x_m, laser.y_m, laser.yaw_rad)))
        frames += [(f"{robot}/base_link", *frame) for frame in sonar_frames(
            robot, scanner.sonars[number] if scanner else None)]
    for time_ns in repeated([0], recording):
        yield time_ns, types.make(TF_MESSAGE, transforms=[
            _transform(types, time_ns, *frame) for frame in frames])


def _laser_frame(robot: str, topic: str) -> str:
    """``robot_0/laser`` of ``scan``, ``robot_0/low/laser`` of ``low/scan``."""
    return f"{robot}/{topic.removesuffix(SCAN)}laser"


def _moving(recording: ReplaySource, types: RosTypes) -> Iterator[TopicMessage]:
    """Transforms and odometry at each recorded pose."""
    names, poses, before = recording.robots, recording.poses, 0
    for k, time_ns in enumerate(poses.times_ns.tolist()):
        now, then = poses.of_instant(k), poses.of_instant(before)
        speeds = _speeds(then, now, (time_ns - int(poses.times_ns[before])) / NS_PER_S)
        before = k
        places = [(x, y, yaw) for x, y, yaw in now.tolist()]
        yield TopicMessage(time_ns, "/tf", TF_MESSAGE, types.make(TF_MESSAGE, transforms=[
            _transform(types, time_ns, f"{name}/odom", f"{name}/base_link", place)
            for name, place in zip(names, places, strict=True)]))
        for name, place, speed in zip(names, places, speeds.tolist(), strict=True):
            yield TopicMessage(time_ns, f"/{name}/odom", ODOMETRY,
                               _odometry(types, time_ns, name, place, speed))


def _scans(recording: ReplaySource, types: RosTypes, scanner: Scanner) -> Iterator[TopicMessage]:
    """Scans at recorded poses, no oftener than the rate of each laser."""
    lasers = {(robot, number): (recording.robots[robot], topic, laser)
              for robot, own in enumerate(scanner.lasers)
              for number, (topic, laser) in enumerate(own.items())}
    due_ns = dict.fromkeys(lasers, 0)
    for k, time_ns in enumerate(recording.poses.times_ns.tolist()):
        due = [which for which, then_ns in due_ns.items() if time_ns >= then_ns]
        for which, ranges in zip(due, scanner.ranges_m(recording, k, due), strict=True):
            name, topic, laser = lasers[which]
            due_ns[which] = time_ns + round(NS_PER_S / laser.rate_hz)
            yield TopicMessage(time_ns, f"/{name}/{topic}", LASER_SCAN, types.make(
                LASER_SCAN, header=types.header(time_ns, _laser_frame(name, topic)),
                angle_min=-laser.field_of_view_rad / 2, angle_max=laser.field_of_view_rad / 2,
                angle_increment=laser.increment_rad, range_max=laser.max_range_m, ranges=ranges))


def _speeds(then: np.ndarray, now: np.ndarray, seconds: float) -> np.ndarray:
    """[robots, 3] forward and left m/s, turn rad/s, in the frames of the robots: the mean since the
    pose before."""
    if seconds <= 0.0:
        return np.zeros_like(now)
    east, north = (now[:, :2] - then[:, :2]).T / seconds
    turn = (now[:, 2] - then[:, 2] + np.pi) % (2 * np.pi) - np.pi
    cos, sin = np.cos(now[:, 2]), np.sin(now[:, 2])
    return np.column_stack([cos * east + sin * north, cos * north - sin * east, turn / seconds])


def _odometry(types: RosTypes, time_ns: int, name: str, place: tuple[float, float, float],
              speed: list[float]) -> Message:
    forward, left, turn = speed
    twist = types.make("geometry_msgs/msg/Twist", linear=types.vector(forward, left),
                       angular=types.vector(0.0, 0.0, turn))
    return types.make(
        ODOMETRY, header=types.header(time_ns, f"{name}/odom"), child_frame_id=f"{name}/base_link",
        pose=types.make("geometry_msgs/msg/PoseWithCovariance", pose=types.pose(*place)),
        twist=types.make("geometry_msgs/msg/TwistWithCovariance", twist=twist))


def _plans(recording: ReplaySource, types: RosTypes) -> Iterator[TopicMessage]:
    """Paths, and goals; a goal that was reached or given up has no message."""
    made: dict[str, tuple[str, Callable[[RosTypes, ShownPlan], Message]]] = {
        "plan": (PATH, _path), "goal": (POSE_STAMPED, _goal)}
    for plan in recording.plans:
        if plan.kind in made and (plan.kind != "goal" or len(plan.xy_mm)):
            kind, make = made[plan.kind]
            yield TopicMessage(plan.time_ns, f"/{plan.robot}/{plan.kind}", kind, make(types, plan))


def _goal(types: RosTypes, plan: ShownPlan) -> Message:
    x_m, y_m = (plan.xy_mm[0] / MM_PER_M).tolist()
    return types.make(POSE_STAMPED, header=types.header(plan.time_ns, MAP_FRAME),
                      pose=types.pose(x_m, y_m))


def _path(types: RosTypes, plan: ShownPlan) -> Message:
    header = types.header(plan.time_ns, MAP_FRAME)
    return types.make(PATH, header=header, poses=[
        types.make(POSE_STAMPED, header=header, pose=types.pose(x_m, y_m))
        for x_m, y_m in (plan.xy_mm / MM_PER_M).tolist()])


def _grids(growths: Sequence[MapGrowth], recording: ReplaySource, types: RosTypes
           ) -> Iterator[Timed]:
    """The map of one robot, or of all together, a few times a minute while it grows."""
    shown: np.ndarray | None = None
    shown_ns = 0
    begin_ns = -(-recording.begin_ns // MAP_EVERY_NS) * MAP_EVERY_NS
    end_ns = recording.end_ns
    for time_ns in sorted({*range(begin_ns, end_ns, MAP_EVERY_NS), end_ns}):
        cells = known_at(growths, time_ns)
        if cells is None:
            continue
        old = time_ns - shown_ns >= _MAP_AGAIN_NS
        if shown is not None and not old and np.array_equal(shown, cells):
            continue
        shown, shown_ns = cells, time_ns
        grid = growths[0].grid
        info = types.make("nav_msgs/msg/MapMetaData", map_load_time=types.time(time_ns),
                          resolution=grid.resolution_m, width=grid.width, height=grid.height,
                          origin=types.pose(grid.x_m, grid.y_m))
        yield time_ns, types.make(
            OCCUPANCY_GRID, header=types.header(time_ns, MAP_FRAME), info=info,
            data=cells.ravel())


def _explored(recording: ReplaySource, types: RosTypes) -> Iterator[Timed]:
    """The share of the terrain that some robot knows, as the monitor has sampled it, if it has."""
    if not recording.run.has(SAMPLES):
        return
    times_s, shares = measured(recording.run.samples, "explored_union")
    for time_s, share in zip(times_s.tolist(), shares.tolist(), strict=True):
        yield round(time_s * NS_PER_S), types.make(FLOAT64, data=share)

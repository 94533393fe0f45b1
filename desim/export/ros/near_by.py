"""The topics of a robot's sonar and of its bumper."""

from __future__ import annotations

from collections.abc import Iterator

from desim.export.ros.laser_scans import Scanner
from desim.export.ros.message_types import RANGE, RosTypes, TopicMessage
from desim.results.contacts import contacts
from desim.results.source import ReplaySource
from desim.scenario.schema.robot import Sonar
from desim.units import NS_PER_S

_CENTER, _PRESSED = 1, 1  # of kobuki_msgs/BumperEvent
_Frame = tuple[str, tuple[float, float, float]]  # its name, and its pose on the robot


def sonar_frames(robot: str, sonar: Sonar | None) -> list[_Frame]:
    """The frames of the transducers of a robot; none without a sonar."""
    mounts = () if sonar is None else sonar.transducers
    return [(_frame(robot, number), mount) for number, mount in enumerate(mounts)]


def sonar_readings(recording: ReplaySource, types: RosTypes, scanner: Scanner
                   ) -> Iterator[TopicMessage]:
    """Each transducer's range at recorded poses, no oftener than the sonar fires."""
    due_ns = {robot: 0 for robot, sonar in enumerate(scanner.sonars) if sonar is not None}
    for k, time_ns in enumerate(recording.poses.times_ns.tolist() if due_ns else ()):
        due = [robot for robot, then_ns in due_ns.items() if time_ns >= then_ns]
        for robot, ranges_m in zip(due, scanner.sonar_m(recording, k, due), strict=True):
            sonar, name = scanner.sonars[robot], recording.robots[robot]
            assert sonar is not None
            due_ns[robot] = time_ns + round(NS_PER_S / sonar.rate_hz)
            for number, range_m in enumerate(ranges_m.tolist()):
                yield TopicMessage(time_ns, f"/{name}/sonar", RANGE, types.make(
                    RANGE, header=types.header(time_ns, _frame(name, number)),
                    radiation_type=0, field_of_view=sonar.cone_rad,  # 0: ultrasound
                    min_range=sonar.min_range_m, max_range=sonar.max_range_m, range=range_m))


def bumps(recording: ReplaySource, types: RosTypes, scanner: Scanner) -> Iterator[TopicMessage]:
    """A press at each begin of a contact of a robot with a bumper, which does not tell where."""
    has_bumper = {name for name, has in zip(recording.robots, scanner.bumpers, strict=True) if has}
    for time_ns, robot in contacts(recording):
        if robot in has_bumper:
            yield TopicMessage(time_ns, f"/{robot}/bumper", types.bumper_event, types.make(
                types.bumper_event, bumper=_CENTER, state=_PRESSED))


def _frame(robot: str, number: int) -> str:
    return f"{robot}/sonar_{number}"

"""Meetings of robots: an agreed place and time, and who is missing."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

from pydantic import Field

from desim import ports
from desim.units import NS_PER_S, Duration, Length, Period, Speed


class MeetingParams(ports.Params):
    """The times of meetings, and the patience with those who do not come."""

    interval_ns: Period = Field("60 s", description=(
        "from one meeting to the next (maze_8 with minpos takes 130 s)"))
    speed_mps: Speed = Field("0.6 m/s", gt=0, description=(
        "at which it expects to get there (half of a pioneer3dx's)"))
    near_m: Length = Field("5 m", description="so near to the place it waits")
    fresh_ns: Duration = Field("3 s", description=(
        "who was heard of within it is there (three periods of the team's state)"))
    linger_ns: Duration = Field("6 s", description=(
        "time together, to exchange maps (a period of the exchange, and 1 s)"))
    failsafe_after_ns: Duration = Field("20 s", description=(
        "wait for those who do not come: then go on alone (24 m of way at 1.2 m/s)"))


class Meeting(NamedTuple):
    """An agreed place and time."""

    place: ports.Place
    time_ns: int

    def is_due(self, robot: ports.StrategyContext, speed_mps: float) -> bool:
        """Whether a robot of this speed has to leave now to be in time, and knows a path."""
        way_m = float(robot.path_lengths_m([self.place])[0])
        left_s = (self.time_ns - robot.now_ns) / NS_PER_S
        return way_m < math.inf and way_m / speed_mps >= left_s

    def shown(self, robot: ports.StrategyContext) -> Meeting:
        """Show the meeting in the replay from now on. Returns it."""
        text = f"{robot.name} meets at {self.time_ns / NS_PER_S:.0f} s"
        robot.show("meeting", [ports.Mark(*self.place, text)])
        return self

    def drive(self, robot: ports.StrategyContext, near_m: float) -> None:
        """Drive there, and stop once the robot is near, since one place has no room for all."""
        drive_near(robot, self.place, near_m)


def drive_near(robot: ports.StrategyContext, place: ports.Place, near_m: float) -> None:
    """Drive to ``place``, and stop once the robot is near."""
    if is_near(robot, place, near_m):
        if robot.goal is not None:
            robot.stop()
    elif robot.goal != place:
        robot.go(place)


def is_near(robot: ports.StrategyContext, place: ports.Place, near_m: float) -> bool:
    """Whether the robot is within ``near_m`` of ``place``."""
    return robot.pose is not None and math.dist(robot.pose[:2], place) <= near_m


def silent(robot: ports.StrategyContext, names: Iterable[str], for_ns: int) -> list[str]:
    """The names of the robots (of ``names``) that were not heard of within the last ``for_ns``."""
    links = robot.links()
    return [name for name in names
            if name not in links or robot.now_ns - links[name].heard_ns > for_ns]

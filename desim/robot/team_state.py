"""The node through which a robot announces its pose and its goal to its team."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import ClassVar

from desim.errors import below
from desim.middleware.contents import POSE_STAMPED_BYTES, Goal
from desim.middleware.host import Host
from desim.middleware.message import Message
from desim.middleware.node import Node
from desim.middleware.topics import PolledSubscription
from desim.ports import Place
from desim.robot.team import Team
from desim.scenario.schema.communication import TeamStateParams
from desim.units import NS_PER_S


@dataclass(frozen=True, slots=True)
class TeamState:
    """A robot's pose and goal: two geometry_msgs/PoseStamped."""

    x_m: float
    y_m: float
    yaw_rad: float
    goal: Place | None
    size_bytes: ClassVar[int] = 2 * POSE_STAMPED_BYTES


class TeamStateNode(Node):
    """Publishes a ``TeamState`` every ``period_ns``, and keeps those of the others in ``team``.
    A host without a body only listens."""

    def __init__(self, host: Host, params: TeamStateParams, team: Team, robots: tuple[str, ...],
                 has_body: bool) -> None:
        super().__init__(host, "team_state")
        self._params, self._team, self._robots = params, team, robots
        self._has_body = has_body
        self._pose: PolledSubscription  # of a host with a body
        self._goal: Place | None = None

    def start(self) -> None:
        for robot in self._robots:
            self.subscribe(f"/{robot}/team_state", self._on_state)
        if not self._has_body:
            return
        self._pose = self.latest("pose")
        self.subscribe("goal", self._on_goal)
        self.subscribe("goal_result", self._on_result)
        with below("coordination.team_state"):
            self.advertise("team_state", transport=self._params.transport, via=self._params.via)
        self.timer(Fraction(NS_PER_S, self._params.period_ns), self._on_period, name="period")

    def _on_goal(self, message: Message) -> None:
        goal: Goal = message.content
        self._goal = None if math.isnan(goal.x_m) else Place(goal.x_m, goal.y_m)

    def _on_result(self, _: Message) -> None:
        self._goal = None

    def _on_period(self, _: int) -> None:
        message = self._pose.read()
        if message is not None:
            pose = message.content
            self.publish("team_state", TeamState(pose.x_m, pose.y_m, pose.yaw_rad, self._goal))

    def _on_state(self, message: Message) -> None:
        state: TeamState = message.content
        name = message.origin.name
        self._team.received(message)
        self._team.note_pose(name, state.x_m, state.y_m, state.yaw_rad, message.stamp_ns,
                             self.now_ns)
        self._team.note_goal(name, state.goal)

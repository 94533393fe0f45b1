"""Leader and followers: a formation that is kept by messages of the leader's pose."""

import math

from pydantic import Field

from desim import ports
from desim.ports.tasks import Formation
from desim.units import NS_PER_S, Period

_AHEAD_M = 0.3  # of the point that a follower steers, before its axle: a robot's radius or so
_STEP_NS = NS_PER_S // 10  # of control
_GAIN_PER_S = 1.0  # closing speed in m/s for each metre of distance
_LIMIT_MPS = 1.0  # of a follower; its body may be slower
_SILENT_PERIODS = 10  # without a pose


class LeaderFollower:
    """The leader drives to its places and publishes its pose; each follower steers to its place
    beside the leader (Desai, Ostrowski, Kumar 2001).

    A follower knows the leader's speed and rate of turn from its last two poses, and counts on them
    until the next comes. A point before its axle is driven by feedback linearization: the wanted
    velocity of that point, the place's own and 1 m/s for each metre to it, gives speed and rate of
    turn. Failsafe: a follower that hears nothing for ten periods stands.
    """

    class Params(ports.Params):
        period_ns: Period = Field("100 ms", description="of the leader's poses")

    traits = ports.StrategyTraits(needs=Formation)

    def __init__(self, params: Params) -> None:
        self._params = params
        self._next = 0  # of the leader's places
        self._heard: list[tuple[int, ports.Pose2D]] = []  # the last two poses: when, where

    def on_start(self, robot: ports.StrategyContext) -> None:
        formation: Formation = robot.task
        if robot.name == formation.leader:
            robot.advertise("leader")
            robot.every(self._params.period_ns, self._lead)
        elif robot.name in formation.offsets:
            robot.subscribe("leader", self._on_leader, queue=1)
            robot.every(_STEP_NS, self._follow)

    def on_goal(self, robot: ports.StrategyContext, place: ports.Place, end: ports.GoalEnd) -> None:
        if end is ports.GoalEnd.FAILED:
            self._next += 1  # it cannot get there

    def choose(self, robot: ports.StrategyContext) -> ports.Place | None:
        formation: Formation = robot.task
        if robot.name != formation.leader or self._next >= len(formation.places):
            return None
        return formation.places[self._next]

    def _lead(self, robot: ports.StrategyContext) -> None:
        pose, places = robot.pose, robot.task.places
        if pose is None:
            return
        robot.publish("leader", [round(value, 4) for value in pose])
        if self._next < len(places) and \
                math.dist(pose[:2], places[self._next]) <= 0.8 * robot.task.within_m:
            self._next += 1
            if self._next < len(places):
                robot.go(places[self._next])

    def _on_leader(self, robot: ports.StrategyContext, message: ports.StrategyMessage) -> None:
        pose = ports.Pose2D(*message.content)
        if not self._heard or message.sent_ns > self._heard[-1][0]:
            self._heard = [*self._heard[-1:], (message.sent_ns, pose)]

    def _follow(self, robot: ports.StrategyContext) -> None:
        if robot.pose is None or len(self._heard) < 2:
            return
        (before_ns, before), (sent_ns, last) = self._heard
        age_ns = robot.now_ns - sent_ns
        if age_ns > _SILENT_PERIODS * self._params.period_ns:
            robot.drive(0.0, 0.0, 0.0)
            return
        step_s = (sent_ns - before_ns) / NS_PER_S
        turn = math.remainder(last.yaw_rad - before.yaw_rad, math.tau) / step_s
        vx, vy = ((a - b) / step_s for a, b in zip(last[:2], before[:2], strict=True))
        age_s = age_ns / NS_PER_S
        yaw = last.yaw_rad + turn * age_s
        ahead_m, aside_m = robot.task.offsets[robot.name]
        dx = ahead_m * math.cos(yaw) - aside_m * math.sin(yaw)
        dy = ahead_m * math.sin(yaw) + aside_m * math.cos(yaw)
        place = last.x_m + vx * age_s + dx, last.y_m + vy * age_s + dy
        self._steer(robot, place, (vx - turn * dy, vy + turn * dx))

    def _steer(self, robot: ports.StrategyContext, place: tuple[float, float],
               velocity: tuple[float, float]) -> None:
        """Drive so that the point before the axle gets to ``place``, which has this velocity."""
        assert robot.pose is not None
        x_m, y_m, yaw = robot.pose
        forward, gain = (math.cos(yaw), math.sin(yaw)), _GAIN_PER_S
        wanted = [own + gain * (to - at) for own, to, at in zip(
            velocity, place, (x_m, y_m), strict=True)]
        scale = min(1.0, _LIMIT_MPS / max(math.hypot(*wanted), 1e-9))
        along = wanted[0] * forward[0] + wanted[1] * forward[1]
        across = wanted[1] * forward[0] - wanted[0] * forward[1]
        robot.drive(scale * along, 0.0, scale * across / _AHEAD_M)

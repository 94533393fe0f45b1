"""The node that drives: plans a way to each goal, follows it, and tries to get free when stuck."""

from __future__ import annotations

import math

from desim.engine.trace import bits
from desim.middleware.graph import Host, Message, Node
from desim.middleware.messages import Goal, GoalResult, Twist
from desim.middleware.topics import Latest
from desim.robot.navigation.global_costmap import Costmap
from desim.robot.navigation.global_planner import Wavefront
from desim.robot.navigation.local_planner import LocalPlanner
from desim.robot.navigation.recovery import Progress, Recovery, Spin, retreat
from desim.robot.tiles import Belief
from desim.scenario.schema.fleet import BodyType
from desim.scenario.schema.robot import Laser, Navigation
from desim.units import NS_PER_S

_RETREAT_NS = 4 * NS_PER_S  # no retreat takes longer
_STOP = Twist(0.0, 0.0, 0.0)


class MoveBase(Node):
    """Drives to one goal at a time. Publishes its global costmap, live, for others on its host."""

    __slots__ = ("_navigation", "_body", "_sensor_timeout_ns", "_local", "_progress", "_scan",
                 "_pose", "_map", "_costmap", "_wavefront", "_goal", "_spin", "_retreat_until_ns",
                 "_recoveries", "_arriving")

    def __init__(self, host: Host, navigation: Navigation, body: BodyType, laser: Laser) -> None:
        super().__init__(host, "move_base")
        self._navigation, self._body = navigation, body
        self._sensor_timeout_ns = max(navigation.sensor_timeout_ns,
                                      int(2 * NS_PER_S / laser.rate_hz))
        self._local = LocalPlanner(navigation, body)
        self._progress = Progress()
        self._scan = self._pose = self._map = Latest()
        self._costmap: Costmap | None = None
        self._wavefront: Wavefront | None = None
        self._goal: Goal | None = None
        self._spin: Spin | None = None
        self._retreat_until_ns = 0  # 0: not in retreat
        self._recoveries = 0  # for this goal
        self._arriving = False  # the goal is reached when the present turn is complete

    def start(self) -> None:
        for topic in ("cmd_vel", "goal_result"):
            self.advertise(topic)
        self.advertise("costmap", latch=True)
        self._scan, self._pose = self.latest("scan"), self.latest("pose")
        self._map = self.latest("map")
        self.subscribe("goal", self._on_goal)
        self.timer(self._navigation.control_rate_hz, self._control)
        self.timer(self._navigation.local_rate_hz, self._look)

    # ---------------------------------------------------------------------------- what comes in

    def _on_goal(self, message: Message) -> None:
        goal = message.content
        if self._spin is not None:
            self._progress.restart(self.now_ns)
        self._spin, self._arriving, self._retreat_until_ns, self._recoveries = None, False, 0, 0
        if goal.x_m is None:
            self._halt()
            return
        self._goal = goal
        if not self._plan():
            self._finish(False)
        elif self._distance_m(goal) <= self._navigation.goal_tolerance_m:
            self._arriving = True  # the robot is there already: it looks around
            self._begin_spin()

    def _look(self, _: int) -> None:
        """Take the newest scan into the local layer."""
        if self._costmap is None and self._map.message is not None:
            self._survey(self._map.message.content)
        scan, pose = self._scan.message, self._pose.message
        if self._goal is not None and scan is not None and pose is not None:
            sweep = scan.content
            self._local.sight.look(
                sweep, *self._local.extrapolate(pose.content, sweep.stamp_ns))

    def _survey(self, belief: Belief) -> None:
        """The first map is here. It is live: there is never another one."""
        self._costmap = Costmap(belief, self._body.radius_m, self._navigation.inflation_radius_m,
                                self._navigation.inflation_scaling)
        self._wavefront = Wavefront(self._costmap)
        self._local.sight.use(self._costmap)
        self.publish("costmap", self._costmap)

    # ---------------------------------------------------------------------------- what it does

    def _control(self, _: int) -> None:
        if self._goal is None:
            return
        now_ns, scan, pose = self.now_ns, self._scan.message, self._pose.message
        if scan is None or now_ns - min(scan.born_ns, pose.born_ns) > self._sensor_timeout_ns:
            self._drive(0.0, 0.0)
            return
        x_m, y_m, yaw_rad = self._local.extrapolate(pose.content, now_ns)
        if self._spin is not None:
            turn_radps = self._spin.turn_radps(yaw_rad, now_ns)
            if turn_radps is not None:
                self._drive(0.0, turn_radps)
                return
            self._end_spin(now_ns)
        elif self._retreat_until_ns:
            self._retreat(x_m, y_m, yaw_rad, now_ns)
        else:
            self._approach(x_m, y_m, yaw_rad, now_ns)

    def _approach(self, x_m: float, y_m: float, yaw_rad: float, now_ns: int) -> None:
        goal = self._goal
        if math.hypot(goal.x_m - x_m, goal.y_m - y_m) <= self._navigation.goal_tolerance_m:
            self._finish(True)
            return
        speed_mps, turn_radps, togo_m = self._local.steer(x_m, y_m, yaw_rad)
        self._progress.note(now_ns, togo_m)
        if now_ns - self._progress.since_ns > self._navigation.stuck_after_ns:
            self._recover(x_m, y_m, yaw_rad, now_ns)
        else:
            self._drive(speed_mps, turn_radps)

    def _recover(self, x_m: float, y_m: float, yaw_rad: float, now_ns: int) -> None:
        """The next thing to try, or the end of trying."""
        self._recoveries += 1
        if self._recoveries > self._navigation.give_up_after or not self._plan():
            self._finish(False)
            return
        kind = Recovery((self._recoveries - 1) % len(Recovery))
        self.record("recovery", self._recoveries, int(kind))
        self._progress.restart(now_ns)
        if kind is Recovery.ROTATE:
            self._begin_spin()
        elif kind is Recovery.RETREAT:
            way = retreat(self._costmap, x_m, y_m, yaw_rad, self.stream("retreat"))
            if way is not None:
                self._local.follow(way)
                self._retreat_until_ns = now_ns + _RETREAT_NS
        self._drive(0.0, 0.0)

    def _retreat(self, x_m: float, y_m: float, yaw_rad: float, now_ns: int) -> None:
        speed_mps, turn_radps, togo_m = self._local.steer(x_m, y_m, yaw_rad)
        if togo_m > self._body.radius_m and now_ns < self._retreat_until_ns:
            self._drive(speed_mps, turn_radps)
            return
        self._retreat_until_ns = 0
        self._progress.restart(now_ns)
        if not self._plan():
            self._finish(False)

    def _begin_spin(self) -> None:
        body = self._body
        self._spin = Spin(body.max_turn_radps, body.turn_acceleration_radps2,
                          self._pose.message.content.yaw_rad, self.now_ns)

    def _end_spin(self, now_ns: int) -> None:
        self._spin = None
        self._progress.restart(now_ns)
        if self._arriving:
            self._finish(True)

    def _plan(self) -> bool:
        """Find a way to the goal; False if there is none."""
        if self._pose.message is None or self._wavefront is None:
            return False
        pose, goal = self._pose.message.content, self._goal
        way = self._wavefront.plan((pose.x_m, pose.y_m), (goal.x_m, goal.y_m),
                                   self._navigation.goal_tolerance_m)
        if way is None:
            return False
        self._local.follow(way)
        self._progress.begin(self.now_ns, pose.x_m, pose.y_m)
        return True

    def _distance_m(self, goal: Goal) -> float:
        pose = self._pose.message.content
        return math.hypot(goal.x_m - pose.x_m, goal.y_m - pose.y_m)

    def _drive(self, speed_mps: float, turn_radps: float) -> None:
        self._local.drove(speed_mps, turn_radps)
        self.publish("cmd_vel", Twist(speed_mps, 0.0, turn_radps))

    def _halt(self) -> None:
        """Nowhere to go: stop, and say nothing more."""
        self._goal = None
        self._local.drove(0.0, 0.0)
        self.publish("cmd_vel", _STOP)

    def _finish(self, reached: bool) -> None:
        goal = self._goal
        self.record("goal_reached" if reached else "goal_aborted", bits(goal.x_m), bits(goal.y_m))
        self._halt()
        self.publish("goal_result", GoalResult(goal.x_m, goal.y_m, reached))

"""The node that drives: plans a path to each goal, follows it, and tries to get free when stuck."""

from __future__ import annotations

import math

import numpy as np

from desim.engine.trace import bits
from desim.middleware.contents import EMPTY, Goal, GoalResult, Pose
from desim.middleware.host import Host
from desim.middleware.message import Message
from desim.middleware.node import Node
from desim.middleware.topics import PolledSubscription
from desim.ports.local_planners import LocalPlanner
from desim.robot.navigation.global_costmap import GlobalCostmap
from desim.robot.navigation.global_planner import GlobalPlanner
from desim.robot.navigation.moving_bodies import MovingBodies
from desim.robot.navigation.patience import patience
from desim.robot.navigation.recovery import Recovery, Spin, retreat
from desim.robot.navigation.scan_points import PlacedScan
from desim.robot.navigation.situation import Position, Situation
from desim.robot.navigation.standing import LONG_NS, Standing
from desim.scenario.schema.fleet import BodyType
from desim.scenario.schema.robot import Equipment
from desim.units import NS_PER_S

_NOWHERE = np.empty((0, 2))
_RETREAT_NS = 4 * NS_PER_S  # no retreat takes longer; maze_8: same
_AGGRESSIVE_RADII = 4  # move_base.cpp: aggressive_reset clears outside of 4 circumscribed radii


class MoveBase(Node):
    """Drives to one goal at a time.

    The event ``costmap`` announces to other nodes of its host, once, that ``costmap`` can be used:
    the first map is there.
    """

    def __init__(self, host: Host, robot: Equipment, body: BodyType, costmap: GlobalCostmap,
                 steering: LocalPlanner, moving: MovingBodies | None = None) -> None:
        super().__init__(host, "move_base")
        navigation, lasers = robot.navigation, robot.lasers_by_topic
        self._robot, self._navigation, self._body = robot, navigation, body
        self._sensor_timeout_ns = max(navigation.constants.sensor_timeout_ns,
                                      *(int(2 * NS_PER_S / laser.rate_hz)
                                        for laser in lasers.values()))
        self._beams = sum(laser.beams for laser in lasers.values())
        self._costmap, self._planner = costmap, GlobalPlanner(costmap)
        self._local = Situation(self, navigation, body, costmap, moving)
        self._steering = steering
        self._patience = patience(navigation)
        self._standing, self._stood_ns = Standing(), 0
        self._ticks = math.ceil(navigation.control_rate_hz)  # of the control, in a second
        self._sonar: PolledSubscription | None = None
        self._scans: list[PolledSubscription] = []
        self._mapped = False
        self._goal: Goal | None = None
        self._spin: Spin | None = None
        self._retreat_until_ns = 0  # 0: not in retreat
        self._pathless = False  # there is no path to the goal, and it waits for one
        self._arriving = False  # the goal is reached when the present turn is complete

    def start(self) -> None:
        self._send = self.advertise("cmd_vel").publish
        self.advertise("goal_result")
        self.advertise("costmap", latch=True)
        self._scans = [self.latest(topic) for topic in self._robot.lasers_by_topic]
        self._pose, self._map = self.latest("pose"), self.latest("map")
        self._sensors = self._pose, *self._scans
        self.subscribe("goal", self._on_goal)
        if self._robot.sonar is not None:
            self._sonar = self.latest("sonar")
        if self._robot.bumper:
            self.subscribe("bumper", self._on_bump)
        self._steering.start(self._local)
        self.timer(self._navigation.control_rate_hz, self._control, name="control")
        self.timer(self._navigation.local_rate_hz, self._observe, name="observe")

    def kept(self) -> dict[str, int]:
        """See ``Node.kept``: the costmap."""
        return {"cells": self._costmap.spec.cells}

    # ---------------------------------------------------------------------------- what comes in

    def _on_goal(self, order: Message) -> None:
        goal: Goal = order.content
        if self._spin is not None:
            self._patience.restart(self.now_ns)
        self._spin, self._arriving, self._retreat_until_ns = None, False, 0
        self._patience.begin_goal(self.now_ns, self._stood_ns)
        if math.isnan(goal.x_m):
            self._halt()
            return
        self._goal, message = goal, self._pose.read()
        if message is None:
            self._finish(goal, False)
            return
        pose = message.content
        if self._plan(goal, pose) and math.hypot(
                goal.x_m - pose.x_m, goal.y_m - pose.y_m) <= self._local.goal_tolerance_m:
            self._arriving = True  # the robot is there already: it turns once to see what is around
            self._begin_spin(pose)

    def _on_bump(self, _: Message) -> None:
        """Stop, and back off from the obstacle that was touched."""
        goal, pose = self._goal, self._pose.read()
        if goal is None or pose is None or self._retreat_until_ns:
            return
        self._spin, self._arriving = None, False
        now_ns = self.now_ns
        here = self._local.extrapolate(pose.content, max(now_ns, pose.content.stamp_ns))
        self._recover(goal, pose.content, here, now_ns, Recovery.RETREAT)

    def _observe(self, _: int) -> None:
        """Take the newest scan of each laser, and of the sonar, into the local costmap."""
        if not self._mapped and self._map.read() is not None:
            self._mapped = True
            self.publish("costmap", EMPTY)
        pose = self._pose.read()
        scans = [] if self._goal is None or pose is None else self._seen(pose.content)
        if scans:
            self.worked(scans=len(scans), beams=self._beams)
            self._local.observe(scans)

    def _seen(self, pose: Pose) -> list[PlacedScan]:
        """The newest scan of each laser, and of the sonar, each with the robot's pose then; none
        without one of the first laser."""
        placed: list[PlacedScan] = []
        for latest in self._scans:
            message = latest.read()
            if message is not None:
                scan = message.content
                placed.append((scan, self._local.extrapolate(pose, scan.stamp_ns)))
            elif not placed:
                return []
        message = None if self._sonar is None else self._sonar.read()
        if message is not None:
            placed += [(scan, self._local.extrapolate(pose, scan.stamp_ns))
                       for scan in message.content.scans]
        return placed

    # ---------------------------------------------------------------------------- what it does

    def _control(self, tick: int) -> None:
        goal = self._goal
        if goal is None:
            return
        now_ns, pose = self.now_ns, None
        since_ns = self._graph.kernel.now_ns - self._sensor_timeout_ns
        for sensor in self._sensors:
            message = sensor.read()
            if message is None or message.born_ns < since_ns:  # costmap_2d: sensors not current
                pose = None
                break
            pose = pose or message.content
        if pose is None or now_ns - pose.stamp_ns > self._navigation.transform_tolerance_ns:
            self._send(self._local.command(0.0, 0.0))
            return
        here = self._local.extrapolate(pose, max(now_ns, pose.stamp_ns))  # it may be yet to come
        self._local.position = here
        if tick % self._ticks == 0:
            self._note_standing(now_ns, here)
        if self._spin is not None:
            turn_radps = self._spin.turn_radps(here[2], now_ns)
            # As rotate_recovery, it does not turn where its footprint would meet something.
            if turn_radps is not None and self._local.can_turn(self._spin.left_rad):
                self._send(self._local.command(0.0, turn_radps))
                return
            self._spin = None
            self._patience.restart(now_ns)
            if self._arriving:
                self._finish(goal, True)
        elif self._retreat_until_ns:
            self._retreat(goal, pose, here, now_ns)
        elif self._pathless:
            self._wait(goal, pose, here, now_ns)
        else:
            self._approach(goal, pose, here, now_ns)

    def _note_standing(self, now_ns: int, here: Position) -> None:
        """Record when the robot has stood for long, and when it drives again."""
        before_ns, self._stood_ns = self._stood_ns, self._standing.note(now_ns, here[0], here[1])
        stands = self._stood_ns >= LONG_NS
        if stands != (before_ns >= LONG_NS):
            self.record("stands" if stands else "drives_again")

    def _approach(self, goal: Goal, pose: Pose, here: Position, now_ns: int) -> None:
        x_m, y_m, _ = here
        if math.hypot(goal.x_m - x_m, goal.y_m - y_m) <= self._local.goal_tolerance_m:
            self._finish(goal, True)
            return
        speed_mps, turn_radps, togo_m, is_blocked = self._steering.steer(self._local)
        if self._patience.note(now_ns, x_m, y_m, togo_m, is_blocked):
            self._recover(goal, pose, here, now_ns)
            return
        send = self._send
        send(self._local.command(speed_mps, turn_radps))
        if self._patience.insists and is_blocked:
            self._plan(goal, pose)

    def _wait(self, goal: Goal, pose: Pose, here: Position, now_ns: int) -> None:
        """Stand, and plan a path once more."""
        if not self._plan(goal, pose) and self._patience.is_over(now_ns):
            self._recover(goal, pose, here, now_ns)
        else:
            self._send(self._local.command(0.0, 0.0))

    def _recover(self, goal: Goal, pose: Pose, here: Position, now_ns: int,
                 wanted: Recovery | None = None) -> None:
        """Try the ``wanted`` recovery or the next one, or give the goal up."""
        kind = self._patience.next(wanted)
        if kind is None:
            self._finish(goal, False)
            return
        if kind is Recovery.CONSERVATIVE_RESET:
            self._local.costmap.forget(self._navigation.constants.conservative_reset_m)
        elif kind is Recovery.AGGRESSIVE_RESET:
            self._local.costmap.forget(_AGGRESSIVE_RADII * self._body.radius_m)
        number = self._patience.tried
        self._plan(goal, pose)
        if self._goal is None:
            return
        self.record("recovery", number, int(kind))
        self._patience.restart(now_ns)
        if kind is Recovery.ROTATE:
            self._begin_spin(pose)
        elif kind is Recovery.RETREAT:
            path = retreat(self._costmap, *here, self.stream("retreat"))
            if path is not None:
                self._follow(path)
                self._retreat_until_ns = now_ns + _RETREAT_NS
        self._send(self._local.command(0.0, 0.0))

    def _retreat(self, goal: Goal, pose: Pose, here: Position, now_ns: int) -> None:
        speed_mps, turn_radps, togo_m, _ = self._steering.steer(self._local)
        if togo_m > self._body.radius_m and now_ns < self._retreat_until_ns:
            self._send(self._local.command(speed_mps, turn_radps))
            return
        self._retreat_until_ns = 0
        self._patience.restart(now_ns)
        self._plan(goal, pose)

    def _begin_spin(self, pose: Pose) -> None:
        body = self._body
        self._spin = Spin(body.max_turn_radps, body.turn_acceleration_radps2, pose.yaw_rad,
                          self.now_ns)

    def _plan(self, goal: Goal, pose: Pose) -> bool:
        """Plan a path to the goal and follow it; without one, wait for it or give the goal up."""
        if self._mapped:
            self.worked(plans=1, cells=self._costmap.spec.width * self._costmap.spec.height)
        path = self._path(goal, pose) if self._mapped else None
        self._pathless = path is None
        if path is None:
            self._patience.miss_path()
            if not self._patience.insists:
                self._finish(goal, False)
            return False
        self._follow(path)
        self.display("plan", path)
        self._patience.begin_path(self.now_ns, pose.x_m, pose.y_m)
        return True

    def _follow(self, path: np.ndarray) -> None:
        self._local.follow(path)
        self._steering.on_path(self._local)

    def _path(self, goal: Goal, pose: Pose) -> np.ndarray | None:
        """The path to the goal on the costmap of the map. If there is none, what the robot sees is
        taken in: teammates that have left may still be on the map, even where the robot stands.
        (costmap_2d takes in all scans.)"""
        way = (pose.x_m, pose.y_m), (goal.x_m, goal.y_m), self._navigation.goal_tolerance_m
        path = self._planner.plan(*way)
        scans = self._seen(pose) if path is None else []
        if not scans:
            return path
        self._costmap.see(scans)
        return self._planner.plan(*way)

    def _halt(self) -> None:
        """Stop, and send no more velocities until the next goal."""
        self._goal = None
        self.display("plan", _NOWHERE)
        self._send(self._local.command(0.0, 0.0))

    def _finish(self, goal: Goal, reached: bool) -> None:
        self.record("goal_reached" if reached else "goal_aborted", bits(goal.x_m), bits(goal.y_m))
        self._halt()
        self.publish("goal_result", GoalResult(goal.x_m, goal.y_m, reached))

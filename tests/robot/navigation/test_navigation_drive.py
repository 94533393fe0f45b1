"""Closed loop: a toy world with a unicycle, a laser and a few walls, and the real nodes."""

import math

import numpy as np
import pytest
from configured import configured
from drawn import costmap

from desim.engine.kernel import Kernel
from desim.engine.streams import Streams
from desim.engine.trace import Names, Trace
from desim.middleware.contents import Empty, Goal, LaserScan, Lazy, Pose, laser_scan_bytes
from desim.middleware.direct import Direct
from desim.middleware.graph import Graph
from desim.middleware.node import Node
from desim.ports import GridSpec
from desim.robot.localization.sensor_pose import SensorPose
from desim.robot.mapping.robot_map import RobotMap
from desim.robot.mapping.tiles import TilePool
from desim.robot.navigation.local_planners.dynamic_window import DynamicWindow
from desim.robot.navigation.move_base import MoveBase
from desim.robot.navigation.recovery import Recovery
from desim.scenario.schema.fleet import BodyType
from desim.scenario.schema.navigation import Navigation
from desim.scenario.schema.robot import Equipment, Laser

S = 10**9
BODY, LASER = BodyType(), Laser()
ROOM = [(0, 0, 10, 0), (10, 0, 10, 10), (10, 10, 0, 10), (0, 10, 0, 0)]


class Toy(Node):
    """World, driver and mapping in one, for every robot: ideal motors with the body's acceleration
    limits, walls as segments, other robots as discs."""

    def __init__(self, host, walls, poses, laser_until_ns):
        super().__init__(host, "toy")
        self.walls = np.array(walls, float)
        self.poses = np.array(poses, float)
        self.speeds, self.wanted = np.zeros((len(poses), 2)), np.zeros((len(poses), 2))
        self.nearest_m = np.full(len(poses), np.inf)  # to a wall or another robot's rim
        self._laser_until_ns = laser_until_ns

    def start(self):
        for i in range(len(self.poses)):
            for topic in ("scan", "true_pose"):
                self.advertise(f"/r{i}/{topic}")
            self.subscribe(f"/r{i}/cmd_vel", lambda message, i=i: self.command(i, message.content))
        self.timer(60, self.move, "zero")
        self.timer(25, self.scan, "zero")
        self.timer(10, self.locate, "zero")

    def command(self, i, twist):
        self.wanted[i] = twist.forward_mps, twist.turn_radps

    def move(self, _):
        step = np.array([BODY.acceleration_mps2, BODY.turn_acceleration_radps2]) / 60
        self.speeds += np.clip(self.wanted - self.speeds, -step, step)
        middle = self.poses[:, 2] + self.speeds[:, 1] / 120
        self.poses[:, 0] += self.speeds[:, 0] * np.cos(middle) / 60
        self.poses[:, 1] += self.speeds[:, 0] * np.sin(middle) / 60
        self.poses[:, 2] += self.speeds[:, 1] / 60
        for i, (x, y, _) in enumerate(self.poses):
            a, b = self.walls[:, :2], self.walls[:, 2:]
            t = np.clip(((np.array([x, y]) - a) * (b - a)).sum(1) / ((b - a)**2).sum(1), 0, 1)
            gaps = np.hypot(*(a + t[:, None] * (b - a) - [x, y]).T)
            others = np.delete(self.poses[:, :2], i, 0)
            rims = np.hypot(*(others - [x, y]).T) - BODY.radius_m
            self.nearest_m[i] = min(self.nearest_m[i], *gaps, *rims)

    def locate(self, _):
        for i, pose in enumerate(self.poses.tolist()):
            self.publish(f"/r{i}/true_pose", Pose(self.now_ns, *pose))

    def scan(self, _):
        if self.now_ns < self._laser_until_ns:
            for i in range(len(self.poses)):
                sweep = self.cast(i, LASER)
                self.publish(f"/r{i}/scan", Lazy(laser_scan_bytes(180), lambda sweep=sweep: sweep))

    def cast(self, i, laser, half_view=None):
        half_view = half_view or laser.field_of_view_rad / 2
        x, y, yaw = self.poses[i]
        angles = np.linspace(-half_view, half_view, laser.beams)
        ux, uy = np.cos(yaw + angles)[:, None], np.sin(yaw + angles)[:, None]
        x1, y1, x2, y2 = self.walls.T
        across = ux * (y2 - y1) - uy * (x2 - x1)
        with np.errstate(divide="ignore", invalid="ignore"):
            t = ((x1 - x) * (y2 - y1) - (y1 - y) * (x2 - x1)) / across
            s = ((x1 - x) * uy - (y1 - y) * ux) / across
        t = np.where((s >= 0) & (s <= 1) & (t > 0), t, np.inf)
        for other in np.delete(self.poses[:, :2], i, 0):
            along = (other[0] - x) * ux + (other[1] - y) * uy
            off2 = (other[0] - x)**2 + (other[1] - y)**2 - along**2
            rim = along - np.sqrt(np.maximum(BODY.radius_m**2 - off2, 0))
            t = np.hstack((t, np.where((off2 < BODY.radius_m**2) & (along > 0), rim, np.inf)))
        ranges = np.minimum(t.min(1), laser.max_range_m).astype(np.float32)
        return LaserScan(self.now_ns, ranges, -half_view, 2 * half_view / (laser.beams - 1),
                         laser.max_range_m)


class Task(Node):
    """Announces the map, which is whole from the start, and asks for one goal."""

    def __init__(self, host, goal):
        super().__init__(host, "task")
        self.goal, self.results = goal, []

    def start(self):
        self.advertise("map")
        self.advertise("goal")
        self.subscribe("goal_result", lambda m: self.results.append((self.now_ns, m.content)))
        self.after(S // 5, lambda _: self.publish("map", Empty()))
        self.after(S // 2, lambda _: self.publish("goal", Goal(*self.goal)))


class Drive:
    """Robots with the real navigation, each with a pose and a goal, in a world of walls."""

    def __init__(self, walls, *robots, laser_until_s=1000, known=None, navigation=None):
        self.kernel, self.names, self.rows = Kernel(), Names(), []
        trace = Trace(self.names, self.rows.append)
        hosts = ["world", *(f"r{i}" for i in range(len(robots)))]
        self.graph = Graph(self.kernel, self.names, trace, Streams(1), Direct(), hosts)
        self.toy = Toy(self.graph.host("world"), walls, [pose for pose, _ in robots],
                       laser_until_s * S)
        robot_map = self.robot_map(known or walls)
        self.tasks = []
        self.trace = trace
        software = {"world": [self.toy]}
        for i, (_, goal) in enumerate(robots):
            host = self.graph.host(f"r{i}")
            self.tasks.append(Task(host, goal))
            software[host.name] = [SensorPose(host, "true_pose"), self.tasks[-1], MoveBase(
                host, Equipment(navigation=navigation or Navigation(), laser=LASER), BODY,
                costmap(robot_map, BODY.radius_m), DynamicWindow(DynamicWindow.Params()))]
        for name, nodes in software.items():
            self.graph.host(name).software = lambda _, nodes=nodes: nodes
        self._join(hosts)
        self.graph.start()

    def _join(self, hosts):
        from desim.network.medium import Medium
        from desim.network.surroundings import Nowhere
        from netmodels.ideal import Ideal
        medium = Medium("lan", Ideal(Ideal.Params()), (), kernel=self.kernel, names=self.names,
                        streams=Streams(1), hosts=hosts, place=Nowhere(len(hosts)))
        self.graph.attach(medium)

    def robot_map(self, walls):
        """All that can be seen from a grid of places."""
        robot_map = RobotMap(GridSpec(0.2, 52, 52, -0.2, -0.2), TilePool())
        laser = Laser(beams=720)
        for x in np.arange(0.5, 10, 1.5):
            for y in np.arange(0.5, 10, 1.5):
                eye = Toy(self.graph.host("world"), walls, [(x, y, 0.0)], 0)
                robot_map.integrate_scan(x, y, 0.0, eye.cast(0, laser, math.pi), 25.0)
        return robot_map

    def run(self, seconds):
        self.kernel.run(seconds * S)
        self.trace.flush()
        return self

    def recorded(self, kind):
        return [tuple(row)[3:] for rows in self.rows for row in rows
                if self.names[int(row["kind"])] == kind]


CORNER = [*ROOM, (0, 5, 6, 5)]  # a wall from the left, a gap on the right


def test_it_drives_around_a_corner_to_its_goal():
    drive = Drive(CORNER, ((1.0, 2.0, 0.0), (1.0, 8.0))).run(20)
    (at_ns, result), = drive.tasks[0].results
    assert (result.x_m, result.y_m, result.reached) == (1.0, 8.0, True)
    x, y, _ = drive.toy.poses[0]
    assert math.hypot(x - 1.0, y - 8.0) < 0.4
    # about 14 m of way at 1.2 m/s
    assert at_ns / S < 0.5 + 14 / 1.2 * 1.25
    assert drive.toy.nearest_m[0] > BODY.radius_m
    assert drive.recorded("recovery") == []
    assert drive.toy.speeds[0].tolist() == [0.0, 0.0]


@pytest.mark.parametrize("wide_m", [0.9, 0.45])  # the twin is narrower than the robot
def test_it_passes_a_narrow_door(wide_m):
    door = [*ROOM, (0, 5, 5.1 - wide_m / 2, 5), (5.1 + wide_m / 2, 5, 10, 5)]
    drive = Drive(door, ((4.0, 2.0, 0.0), (6.0, 8.0))).run(15)
    assert [r.reached for _, r in drive.tasks[0].results] == [wide_m > 2 * BODY.radius_m]
    assert drive.toy.nearest_m[0] > BODY.radius_m


def test_two_robots_that_meet_pass_each_other():
    drive = Drive([*ROOM, (0, 4, 10, 4), (0, 6.5, 10, 6.5)],
                  ((1.0, 5.2, 0.0), (9.0, 5.2)), ((9.0, 5.2, math.pi), (1.0, 5.2))).run(25)
    assert [[r.reached for _, r in task.results] for task in drive.tasks] == [[True], [True]]
    assert drive.toy.nearest_m.min() > BODY.radius_m


def test_a_robot_in_the_way_that_is_on_no_map_is_driven_around():
    walls = [*ROOM, (0, 4, 10, 4), (0, 7, 10, 7)]
    drive = Drive(walls, ((1.0, 5.5, 0.0), (9.0, 5.5)), ((5.0, 5.2, 0.0), (5.0, 5.2))).run(25)
    assert [r.reached for _, r in drive.tasks[0].results] == [True]
    assert drive.toy.nearest_m.min() > BODY.radius_m


def test_without_a_laser_it_stops():
    drive = Drive(CORNER, ((1.0, 2.0, 0.0), (1.0, 8.0)), laser_until_s=3).run(8)
    stopped = drive.toy.poses[0].copy()
    drive.run(12)
    assert drive.tasks[0].results == []
    assert drive.toy.speeds[0].tolist() == [0.0, 0.0]
    assert drive.toy.poses[0].tolist() == stopped.tolist()


def test_a_goal_that_it_cannot_get_to_is_given_up_after_its_recoveries():
    shut = [*ROOM, (0, 5, 10, 5)]  # the map shows a gap that is not there
    drive = Drive(shut, ((1.0, 2.0, 0.0), (1.0, 8.0)), known=CORNER).run(90)
    assert [r.reached for _, r in drive.tasks[0].results] == [False]
    assert [(number, kind) for number, kind, _ in drive.recorded("recovery")] == [
        (1, 0), (2, 1), (3, 2)]
    assert drive.toy.nearest_m[0] > BODY.radius_m


def test_a_goal_without_a_way_is_refused_at_once():
    shut = [*ROOM, (0, 5, 10, 5)]
    drive = Drive(shut, ((1.0, 2.0, 0.0), (1.0, 8.0))).run(2)
    (at_ns, result), = drive.tasks[0].results
    assert (at_ns, result.reached) == (S // 2, False)


@pytest.mark.parametrize("ghosts_m", [0.5, 3.2])  # the twin: too far away to see that they are gone
def test_a_robot_shut_in_by_ghosts_sees_that_they_are_gone(ghosts_m):
    """Teammates that have left are still on the map, all around a robot that stands."""
    a, b = 5.0 - ghosts_m, 5.0 + ghosts_m
    ring = [(a, a, b, a), (b, a, b, b), (b, b, a, b), (a, b, a, a)]
    drive = Drive(ROOM, ((5.0, 5.0, 0.0), (9.0, 5.0)), known=[*ROOM, *ring]).run(8)
    assert [r.reached for _, r in drive.tasks[0].results] == [ghosts_m == 0.5]


MOVE_BASE_ORDER = [Recovery.CONSERVATIVE_RESET, Recovery.ROTATE, Recovery.AGGRESSIVE_RESET,
                   Recovery.ROTATE]


@pytest.mark.parametrize("patience_s", [5, 2])
def test_move_base_waits_for_a_path_through_its_recoveries(patience_s):
    """Each recovery, and the end, after ``planner_patience``, and a turn takes about 3.4 s."""
    shut = [*ROOM, (0, 5, 10, 5)]
    drive = Drive(shut, ((1.0, 2.0, 0.0), (1.0, 8.0)), navigation=configured(
            Navigation, recovery="move_base", planner_patience=f"{patience_s} s")).run(50)
    (at_ns, result), = drive.tasks[0].results
    assert not result.reached
    assert [kind for _, kind, _ in drive.recorded("recovery")] == MOVE_BASE_ORDER
    turn_s = 2.0 * math.sqrt(2.0 * math.pi / BODY.turn_acceleration_radps2)
    assert at_ns / S == pytest.approx(0.5 + 5 * patience_s + 2 * turn_s, abs=3.0)


def test_move_base_gives_up_what_it_oscillates_before():
    shut = [*ROOM, (0, 5, 10, 5)]  # the map shows a gap that is not there
    for timeout, ends in (("5 s", [False]), (None, [])):  # the twin, as published, tries for ever
        drive = Drive(shut, ((1.0, 2.0, 0.0), (1.0, 8.0)), known=CORNER, navigation=configured(
            Navigation, recovery="move_base", oscillation_timeout=timeout)).run(90)
        assert [r.reached for _, r in drive.tasks[0].results] == ends
        assert [kind for _, kind, _ in drive.recorded("recovery")][-4:] \
            == (MOVE_BASE_ORDER if ends else [])


def test_a_goal_where_it_stands_makes_it_turn_once():
    drive = Drive(ROOM, ((5.0, 5.0, 0.0), (5.1, 5.0))).run(6)
    assert [r.reached for _, r in drive.tasks[0].results] == [True]
    assert drive.toy.poses[0][2] == pytest.approx(2 * math.pi, abs=0.3)
    assert drive.toy.poses[0][:2].tolist() == [5.0, 5.0]

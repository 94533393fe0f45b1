"""Worlds without a truth, for tests: sensors play back what they read in another run."""

import numpy as np

from desim import ports
from desim.robot.coordination.strategies.nearest_frontier import NearestFrontier
from desim.world.plane import Plane

READ = {}  # readings, by sensor, time, and which one was asked
SIGNALS = []  # ns, robot, the signals of its teammates
SILENT_FROM_NS = 6 * 10**9


def key(sensor, snapshot, *which):
    return sensor, snapshot.time_ns, repr(which)


class Recorded(Plane):
    """The plane, and a record of all readings of its sensors."""

    def scan(self, *asked):
        reading = super().scan(*asked)
        READ[key("scan", *asked)] = reading.copy()
        return reading

    def odometry(self, *asked):
        reading = super().odometry(*asked)
        READ[key("odometry", *asked)] = reading.copy()
        return reading


class Scrambled(Plane):
    """Behind its sensors, which play back the record, nothing is true: poses, ways and velocities
    are NaN (but for the start, which a robot's launch file has), walls are gone, commands move
    nobody."""

    def scan(self, *asked):
        return READ[key("scan", *asked)].copy()

    def odometry(self, *asked):
        return READ[key("odometry", *asked)].copy()

    def command(self, *asked):
        """Nothing moves."""

    def snapshot(self):
        return self._nowhere(super().snapshot())

    def snapshot_at(self, time_ns):
        return self._nowhere(super().snapshot_at(time_ns))

    def _nowhere(self, snapshot):
        if snapshot.time_ns == 0:
            return snapshot
        return snapshot._replace(poses=np.full_like(snapshot.poses, np.nan))

    def travelled_m(self):
        return np.full(len(self.robots), np.nan)

    @property
    def velocities(self):
        return np.full((len(self.robots), 3), np.nan)

    def contacts(self):
        return []

    def ground(self, spec, robots):
        solid, reachable = super().ground(spec, robots)
        return 1 - solid[::-1], np.ones_like(reachable)

    def obstacles(self):
        before = super().obstacles()
        return ports.Obstacles(segments=before.segments[:0], material=before.material[:0],
                               thickness_m=before.thickness_m[:0], height_m=before.height_m[:0],
                               epoch=before.epoch, materials=before.materials)


class RecordedPlaces(Recorded):
    """The same, and a record of the true poses at each tick, which radios know."""

    def snapshot(self):
        snapshot = super().snapshot()
        READ["poses", snapshot.time_ns] = snapshot.poses
        return snapshot


class ScrambledLater(Scrambled):
    """The true poses are those of the record until ``SILENT_FROM_NS``, and NaN from then on. Radios
    know the walls."""

    obstacles = Plane.obstacles

    def _nowhere(self, snapshot):
        known = READ.get(("poses", snapshot.time_ns))
        if known is None or snapshot.time_ns > SILENT_FROM_NS:
            return super()._nowhere(snapshot)
        return snapshot._replace(poses=known)


def silence(frame, receivers, context):
    """A rule: nothing gets through from ``SILENT_FROM_NS`` on."""
    return ports.Drop() if context.now_ns >= SILENT_FROM_NS else None


class Tuning(NearestFrontier):
    """Chooses by the signals of its teammates, and notes them."""

    traits = ports.StrategyTraits(reads_team_state=True)

    def choose(self, context):
        frontiers = context.frontiers()
        signals = [link.signal_dbm for link in context.links().values()]
        SIGNALS.append((context.now_ns, context.name, signals))
        number = sum(int(-1000 * signal) for signal in signals if signal is not None
                     and np.isfinite(signal))
        return frontiers[number % len(frontiers)] if frontiers else None


class Peeping(NearestFrontier):
    """A leak: drives to the frontier that is farthest from where the robot truly is. The
    monitor watches the robot's map; a look at its observer goes all the way to the truth."""

    def choose(self, context):
        coverage = context._queries.costmap.robot_map.observers[0].func.__self__
        monitor = coverage._changed.__self__
        x_m, y_m, _ = monitor.truth.poses()[monitor.truth.robots.index(context.name)]
        return max(context.frontiers(), default=None, key=lambda one: np.nan_to_num(
            np.hypot(one.x_m - x_m, one.y_m - y_m)))


class Telepathic(NearestFrontier):
    """A leak: keeps away from where the others are, without hearing of them."""

    poses = {}  # of all robots, in one memory

    def choose(self, context):
        self.poses[context.name] = context.pose
        others = [pose for name, pose in self.poses.items() if name != context.name]
        return max(context.frontiers(), default=None, key=lambda one: min(
            (np.hypot(one.x_m - pose.x_m, one.y_m - pose.y_m) for pose in others), default=0.0))

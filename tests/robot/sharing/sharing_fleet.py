"""Robots that see something at given seconds, and share it."""

import numpy as np

from desim.engine.kernel import Kernel
from desim.engine.streams import Streams
from desim.engine.trace import Names, Trace
from desim.middleware.contents import LaserScan, Pose
from desim.middleware.direct import Direct
from desim.middleware.graph import Graph
from desim.middleware.node import Node
from desim.network.medium import Medium
from desim.network.surroundings import Nowhere
from desim.ports import GridSpec
from desim.robot.mapping.fusion import robot_map_of
from desim.robot.mapping.tiles import TilePool, fuse
from desim.robot.sharing.node import MapSharing, own_map_for
from desim.robot.team import Team
from netmodels.ideal import Ideal

S = 1_000_000_000
SPEC = GridSpec(0.2, 70, 50, 0.0, 0.0)


def scan_of(range_m=3.0):
    return LaserScan(0, np.full(12, range_m, np.float32), -1.5, 0.25, 26.0)


def see(robot_map, x_m, y_m, yaw_rad, range_m=3.0):
    robot_map.integrate_scan(x_m, y_m, yaw_rad, scan_of(range_m), 25.0)


class Explorer(Node):
    """Sees something new at the given seconds, and says where it is every second."""

    def __init__(self, host, robot_map, seconds):
        super().__init__(host, "explorer")
        self._map, self._seconds = robot_map, seconds
        self._number = int(host.name[-1])

    def start(self):
        self.advertise("pose")
        self.timer(1, self._tick, start="zero")

    def _tick(self, _):
        second = self.now_ns // S
        self.publish("pose", Pose(self.now_ns, float(second), self._number, 0.0))
        if second in self._seconds:
            see(self._map, 1.0 + second % 11, 1.0 + 2 * self._number, 0.3 * second)


class Ear(Node):
    """Writes down what is heard on a host: (second, kind, of whom)."""

    def __init__(self, host, log, others):
        super().__init__(host, "ear")
        self._log, self._others = log, others
        self.peers = None

    def start(self):
        self.subscribe("map", lambda message: self._note("map", self.host.name), queue=0)
        for other in self._others:
            self.subscribe(f"/map_exchange/{other}",
                           lambda message: self._note("peer", message.origin.name))
        self.peers = self.latest("peers")

    def _note(self, kind, name):
        self._log.append((self.now_ns // S, self.host.name, kind, name))


class Fleet:
    """Three robots on one ideal medium with ``rules``. ``sharing()`` makes what each shares maps
    with, None for nothing; ``seconds`` [3] when each sees something."""

    def __init__(self, sharing, seconds, rules=(), fusion="evidence"):
        self.kernel, names = Kernel(), Names()
        hosts = ("robot_1", "robot_2", "robot_3")
        trace, streams = Trace(names), Streams(0)
        self.graph = Graph(self.kernel, names, trace, streams, Direct(), hosts)
        self.medium = Medium("air", Ideal(Ideal.Params()), list(rules), kernel=self.kernel,
                             names=names, streams=streams, hosts=list(hosts), place=Nowhere(3))
        self.graph.attach(self.medium)
        self.pool, self.maps, self.own_maps, self.heard, self.log = TilePool(), {}, {}, {}, []
        self.sharing, self.fusion = sharing, fusion
        for name, own in zip(hosts, seconds, strict=True):
            self.graph.host(name).software = lambda host, own=own: self._nodes(host, own)
        self.graph.start()

    def _nodes(self, host, seconds):
        robot_map = self.maps[host.name] = robot_map_of(SPEC, self.pool, self.fusion)
        others = tuple(other.name for other in self.graph.hosts if other is not host)
        sharing = self.sharing()
        own_map = self.own_maps[host.name] = own_map_for(robot_map, sharing)
        return [Explorer(host, own_map, seconds), Ear(host, self.log, others),
                MapSharing(host, sharing, robot_map, others,
                           self.heard.setdefault(host.name, Team((), 0)), own_map)]

    def run(self, until_s):
        self.kernel.run(until_s * S)
        self.graph.catch_up()
        return self

    def hears(self, receiver, source):
        """Log-odds [tiles, 1024] that ``receiver`` has from ``source``."""
        return self.maps[receiver].received[source].cells()

    def sizes(self, topic=""):
        """The sizes of all messages of robot_1 on ``topic``, as (messages, bytes),
        counted at each of two receivers."""
        counts = self.graph.topic(f"/map_exchange/robot_1{topic}").counts
        return counts.published, counts.bytes

    def alike(self):
        """Whether every map is the sum of what all have seen themselves."""
        everything = fuse(tuple(robot_map.own.snapshot() for robot_map in self.maps.values()))
        return [bool((robot_map.fused == everything).all()) for robot_map in self.maps.values()]

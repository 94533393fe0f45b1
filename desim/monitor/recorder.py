"""The recorder: it keeps what people look at afterwards (``desim view``).

It watches as the monitor does, out of band: poses, maps, walls, links, plans, and the rows of the
trace that are rare. Nothing that it does is seen by the run.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from desim.engine.kernel import Kernel, Phase
from desim.engine.trace import Names
from desim.middleware.graph import Graph
from desim.monitor.map_growth import GrowingMap, Life, MapGrowth, halvings
from desim.monitor.meters.reachability import SampledReachability
from desim.monitor.monitor import Monitor
from desim.ports import GridSpec, MovesObstacles, World
from desim.robot.mapping.robot_map import RobotMap
from desim.units import MM_PER_M

_RATES_HZ = (10, 5, 2, 1)
_POSES_PER_S = 2000  # of the whole fleet: beyond it a lower rate is taken
# Kinds of rows that a run has by the message, by the tick or by the sample.
_FREQUENT = ("sent", "frame", "delivered", "callback", "read", "lost", "dropped", "overwritten",
             "repeated", "pose", "sample", "sample_traffic", "sample_motion", "control",
             "link_quality", "acknack", "heartbeat")
_NO_OBSTACLES = np.empty((0, 3))


class ShownPlan(NamedTuple):
    """Points int32 [k, 2] in mm that a robot, or a host without a body, shows at an instant, until
    the next ones of their ``kind``: plan, goal, frontiers, path and pose (where SLAM has been and
    is), or what a strategy calls it. ``texts`` [k], or none."""

    time_ns: int
    robot: str
    kind: str
    xy_mm: np.ndarray
    texts: tuple[str, ...] = ()


class StandingWall(NamedTuple):
    """A segment of the terrain, x1 y1 x2 y2 in mm, from ``from_ns`` until before ``until_ns``."""

    from_ns: int
    until_ns: int
    x1_mm: int
    y1_mm: int
    x2_mm: int
    y2_mm: int
    material: str
    height_mm: int


class Recorder:
    """Records one run. ``events`` gets the rare rows of its trace, in batches."""

    def __init__(self, events: Callable[[np.ndarray], object]) -> None:
        self.times_ns = array("q")
        self.poses: list[np.ndarray] = []  # [robots, 3] x m, y m, yaw rad of each time
        self._obstacles: list[np.ndarray] = []  # moving ones, [obstacles, 3] m of each time
        self.plans: list[ShownPlan] = []
        self.robots: tuple[str, ...] = ()
        self._events = events
        self._standing: dict[tuple[int, int, int, int, str, int], int] = {}
        self._walls: list[StandingWall] = []
        self._epoch = -1
        self._growths: list[MapGrowth | None] = []  # None: it still grows
        self.lives: list[Life] = []  # of each of these
        self._growing: dict[str, tuple[int, GrowingMap]] = {}  # with its place in ``_growths``

    def begin(self, kernel: Kernel, names: Names, world: World, grid: GridSpec, graph: Graph,
              monitor: Monitor) -> None:
        """The run is put together: from now on it is watched."""
        self._kernel, self._world, self.robots = kernel, world, world.robots
        self._moving = world if isinstance(world, MovesObstacles) else None
        self.names = names
        self._halvings = halvings(grid, len(monitor.truth.explorers))
        own = Names()  # the run's have what happened in it alone
        self._frequent = np.array([own.id(kind) for kind in _FREQUENT], np.uint32)
        self._media = np.array([medium.id for medium in graph.media], np.uint32)
        self.links = monitor.links or SampledReachability(graph)
        graph.on_display = self._displayed
        rate_hz = next((rate for rate in _RATES_HZ if rate * len(self.robots) <= _POSES_PER_S),
                       _RATES_HZ[-1])
        entity = own.id("recorder")
        kernel.ticker(rate_hz, Phase.OBSERVE, entity, self._sample)
        if monitor.links is None:
            kernel.ticker(1, Phase.OBSERVE, entity, lambda _: self.links.note(kernel.now_ns))

    def watch(self, robot: str, robot_map: RobotMap | None) -> None:
        """``robot`` has a fresh map (its software started), or none (its host stopped)."""
        if robot in self._growing:
            place, before = self._growing.pop(robot)
            self._growths[place] = before.growth()
            self.lives[place] = self.lives[place]._replace(until_ns=self._kernel.now_ns)
        if robot_map is not None:
            self._growing[robot] = len(self._growths), GrowingMap(
                robot, robot_map, self._kernel, self._halvings)
            self._growths.append(None)
            self.lives.append(Life(robot, self._kernel.now_ns, None))

    def rows(self, rows: np.ndarray) -> None:
        """Rows of the trace: the rare ones are kept."""
        rare = ~(np.isin(rows["kind"], self._frequent) | np.isin(rows["entity"], self._media))
        if rare.any():
            self._events(rows[rare])

    def finish(self) -> None:
        """Close the recording at this instant, once."""
        if self.times_ns and self.times_ns[-1] < self._kernel.now_ns:
            self._sample(-1)

    def growths(self) -> list[MapGrowth]:
        """The growth of each map until now, in the order of their starts."""
        now = {place: growing.growth() for place, growing in self._growing.values()}
        return [growth or now[place] for place, growth in enumerate(self._growths)]

    def moving_obstacles(self, begin: int = 0) -> np.ndarray:
        """[n, obstacles, 3] x m, y m, radius m at the instants ``times_ns[begin:]``."""
        count = len(self._obstacles[0]) if self._obstacles else 0
        return np.array(self._obstacles[begin:]).reshape(-1, count, 3) if count else \
            np.empty((len(self._obstacles[begin:]), 0, 3))

    @property
    def walls(self) -> list[StandingWall]:
        """All that have stood."""
        now_ns = self._kernel.now_ns + 1
        return self._walls + [StandingWall(from_ns, now_ns, *wall)
                              for wall, from_ns in self._standing.items()]

    def _sample(self, _: int) -> None:
        self.times_ns.append(self._kernel.now_ns)
        self.poses.append(self._world.snapshot().poses)
        self._obstacles.append(_NO_OBSTACLES if self._moving is None
                               else self._moving.moving_obstacles())
        obstacles = self._world.obstacles()
        if obstacles.epoch != self._epoch:
            self._epoch = obstacles.epoch
            self._rebuilt()

    def _rebuilt(self) -> None:
        """Doors have moved: note the walls that stand now, and those that do not any more."""
        obstacles, now_ns, before = self._world.obstacles(), self._kernel.now_ns, self._standing
        corners = np.rint(obstacles.segments * MM_PER_M).astype(np.int64).tolist()
        heights = np.rint(obstacles.height_m * MM_PER_M).astype(np.int64).tolist()
        kinds = [obstacles.materials[number] for number in obstacles.material.tolist()]
        self._standing = {
            (x1, y1, x2, y2, kind, height): before.get((x1, y1, x2, y2, kind, height), now_ns)
            for (x1, y1, x2, y2), kind, height in zip(corners, kinds, heights, strict=True)}
        self._walls += [StandingWall(from_ns, now_ns, *wall) for wall, from_ns in before.items()
                        if wall not in self._standing]

    def _displayed(self, host: str, kind: str, points_m: np.ndarray, texts: tuple[str, ...]
                   ) -> None:
        xy_mm = np.rint(points_m * MM_PER_M).astype(np.int32)
        self.plans.append(ShownPlan(self._kernel.now_ns, host, kind, xy_mm, texts))

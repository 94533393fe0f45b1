"""The node that decides where to explore next, and what a strategy may look at."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from desim.engine.trace import bits
from desim.errors import ModelError, class_of
from desim.middleware.graph import Host, Message, Node
from desim.middleware.messages import Goal
from desim.middleware.topics import Latest
from desim.ports import Frontier, Peer, Strategy
from desim.robot.navigation.global_costmap import Costmap
from desim.robot.navigation.global_planner import Wavefront
from desim.scenario.schema.fleet import BodyType
from desim.scenario.schema.robot import Exploration, Navigation
from desim.units import NS_PER_S

_STOP = Goal(None, None)
_IDLE_NS = 5 * NS_PER_S  # a search that finds nothing goes through the whole map: not every second
_VETOES = 5  # a strategy that insists on such a frontier after so many gets it
_VISITS = 2  # a frontier that is still there after so many visits cannot be resolved from there


class View:
    """What a strategy sees of its robot (``ports.ExplorationView``)."""

    __slots__ = ("_explore", "name", "now_ns", "pose", "peers")

    def __init__(self, explore: Explore, name: str) -> None:
        self._explore = explore
        self.name = name
        self.now_ns = 0
        self.pose = (0.0, 0.0, 0.0)
        self.peers: Mapping[str, Peer] = {}

    def frontiers(self, limit: int | None = None) -> list[Frontier]:
        found = self._explore.frontiers(limit)
        self._explore.shown += found
        return found

    def stream(self, *name: str | int) -> np.random.Generator:
        return self._explore.stream("strategy", *name)


class Explore(Node):
    """Chooses a goal when there is none, or when the present one is no frontier any more.

    It never is done for good: maps may arrive later. The local topic ``peers`` has a mapping of
    names to ``ports.Peer``.
    """

    __slots__ = ("_exploration", "_strategy", "_tolerance_m", "_radius_m", "_view", "_pose",
                 "_peers", "_costmap", "_wavefront", "_goal", "_beside", "_blacklist", "_visited",
                 "_idle_until_ns", "_looked_at", "shown")

    def __init__(self, host: Host, exploration: Exploration, strategy: Strategy,
                 navigation: Navigation, body: BodyType) -> None:
        super().__init__(host, "explore")
        self._exploration, self._strategy = exploration, strategy
        self._tolerance_m, self._radius_m = navigation.goal_tolerance_m, body.radius_m
        self._view = View(self, host.name)
        self._pose = self._peers = Latest()
        self._costmap: Costmap | None = None
        self._wavefront: Wavefront | None = None
        self._goal: Frontier | None = None
        self._beside = (0, 0)  # the goal's frontier: a cell, and the cost up to which cells count
        self._blacklist: list[tuple[int, int, int]] = []  # row, column, until
        self._visited: tuple[float, float, int] | None = None  # x, y, how often in a row
        self._idle_until_ns = 0
        self._looked_at = -1  # the belief's version when last a goal was confirmed or none found
        self.shown: list[Frontier] = []  # what the strategy chooses from

    def start(self) -> None:
        self.advertise("goal")
        self._pose, self._peers = self.latest("pose"), self.latest("peers")
        self.subscribe("costmap", self._on_costmap)
        self.subscribe("goal_result", self._on_result)
        self.timer(self._exploration.rate_hz, self._tick)

    def frontiers(self, limit: int | None) -> list[Frontier]:
        """Reachable frontiers from where the robot is; if there are none, those too small or too
        near to obstacles to count at first."""
        x_m, y_m, _ = self._view.pose
        discs = self._discs()
        return (self._wavefront.frontiers((x_m, y_m), limit, self._smallest(), discs)
                or self._wavefront.hidden_frontiers((x_m, y_m), limit, discs))

    # ---------------------------------------------------------------------------- what comes in

    def _on_costmap(self, message: Message) -> None:
        self._costmap = message.content
        self._wavefront = Wavefront(self._costmap)
        self._looked_at = -1

    def _on_result(self, message: Message) -> None:
        result, goal = message.content, self._goal
        if goal is None or (result.x_m, result.y_m) != (goal.x_m, goal.y_m):
            return  # of a goal that was replaced meanwhile
        if result.reached:
            visits = self._visited[2] if self._visited and self._near_visited(goal) else 0
            self._visited = (goal.x_m, goal.y_m, visits + 1)
        else:
            self._avoid(self._beside[0])
        self._goal = None
        self._looked_at = -1

    # ---------------------------------------------------------------------------- what it does

    def _tick(self, _: int) -> None:
        if self._costmap is None or self._pose.message is None:
            return
        if self._goal is None:
            changed = self._costmap.belief.version != self._looked_at
            if (changed and self.now_ns >= self._idle_until_ns) or self._blacklist_ended():
                self._choose()
        elif self._goal_is_spoilt():
            self._choose()

    def _choose(self) -> None:
        view, pose = self._view, self._pose.message.content
        view.now_ns, view.pose = self.now_ns, (pose.x_m, pose.y_m, pose.yaw_rad)
        if self._peers.message is not None:
            view.peers = self._peers.message.content
        self._blacklist = [entry for entry in self._blacklist if entry[2] > view.now_ns]
        self.shown.clear()
        chosen = self._chosen()
        for _ in range(_VETOES):
            if chosen is None or not self._visited_in_vain(chosen):
                break
            self._avoid(self._wavefront.beside(chosen)[0])
            chosen = self._chosen()
        self._looked_at = self._costmap.belief.version
        if chosen is not None:
            self.record("goal", bits(chosen.x_m), bits(chosen.y_m), chosen.cells)
            self.publish("goal", Goal(chosen.x_m, chosen.y_m))
            self._beside = self._wavefront.beside(chosen)
        else:
            self._idle_until_ns = view.now_ns + _IDLE_NS
            if self._goal is not None:
                self.publish("goal", _STOP)
        self._goal = chosen

    def _chosen(self) -> Frontier | None:
        """What the strategy says. Raises ``ModelError`` for a place where the robot cannot be."""
        chosen = self._strategy.choose(self._view)
        if not (chosen is None or isinstance(chosen, Frontier)
                and (chosen in self.shown or self._is_free(chosen))):
            raise ModelError(f"{class_of(self._strategy)} chose {chosen!r}; wanted: one of "
                             "view.frontiers(), a Frontier at another place that is free in the "
                             "robot's map, or None")
        return chosen

    def _is_free(self, chosen: Frontier) -> bool:
        """Whether the robot's centre may be there as far as it knows."""
        if not all(isinstance(at, float | int) and math.isfinite(at)
                   for at in (chosen.x_m, chosen.y_m)):
            return False
        costmap, spec = self._costmap, self._costmap.spec
        col, row = spec.cell(chosen.x_m, chosen.y_m)
        if not (0 <= col < spec.width and 0 <= row < spec.height):
            return False
        costmap.update()
        return costmap.free_near(chosen.x_m, chosen.y_m, self._tolerance_m) >= 0

    def _goal_is_spoilt(self) -> bool:
        """Whether what was unknown beside the goal is known now, or the goal blocked. Cheap as
        long as nothing changed near by."""
        costmap, (cell, highest) = self._costmap, self._beside
        reach = math.ceil(self._radius_m / costmap.spec.resolution_m) + 1
        corners = (cell + reach * (dr * costmap.across + dc) for dr in (-1, 1) for dc in (-1, 1))
        if not any(costmap.changed_at(corner, self._looked_at) for corner in corners):
            return False
        costmap.update()
        self._looked_at = costmap.seen
        wanted = min(self._goal.cells, self._smallest())
        return (costmap.frontier_cells(cell, reach, highest) < wanted
                or costmap.free_near(self._goal.x_m, self._goal.y_m, self._tolerance_m) < 0)

    def _smallest(self) -> int:
        return math.ceil(self._exploration.min_frontier_m / self._costmap.spec.resolution_m)

    def _near_visited(self, goal: Frontier) -> bool:
        x_m, y_m, _ = self._visited
        return math.hypot(goal.x_m - x_m, goal.y_m - y_m) <= self._tolerance_m

    def _visited_in_vain(self, chosen: Frontier) -> bool:
        return (self._visited is not None and self._visited[2] >= _VISITS
                and self._near_visited(chosen))

    def _avoid(self, cell: int) -> None:
        self._blacklist.append((*divmod(cell, self._costmap.across),
                                self.now_ns + self._exploration.blacklist_for_ns))

    def _blacklist_ended(self) -> bool:
        return any(until_ns <= self.now_ns for _, _, until_ns in self._blacklist)

    def _discs(self) -> np.ndarray:
        """The blacklist as the search wants it: [k, 3] row, column, squared radius in cells."""
        radius = self._exploration.blacklist_radius_m / self._costmap.spec.resolution_m
        return np.array([(row, column, int(radius * radius))
                         for row, column, _ in self._blacklist], np.int64).reshape(-1, 3)

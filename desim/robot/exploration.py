"""The node that chooses where its robot explores next, and the view that a strategy has of it."""

from __future__ import annotations

import math

import numpy as np

from desim.engine.trace import bits
from desim.errors import ModelError, class_of
from desim.middleware.contents import Goal, GoalResult, Pose
from desim.middleware.host import Host
from desim.middleware.message import Message
from desim.middleware.node import Node
from desim.middleware.topics import Latest
from desim.ports import Frontier, Peer, Pose2D, Strategy
from desim.robot.navigation.global_costmap import GlobalCostmap
from desim.robot.navigation.global_planner import GlobalPlanner
from desim.scenario.schema.fleet import BodyType
from desim.scenario.schema.robot import ExplorationParams, Navigation
from desim.units import NS_PER_S

# Tuned; ``maze_8`` as in desim/robot/navigation/__init__.py.
# Pause after a fruitless search, which goes through the whole map; maze_8: same.
_IDLE_NS = 5 * NS_PER_S
# Visits after which a remaining frontier counts as unresolvable; maze_8 with 1: 197 s, 3: 202 s.
_VISITS = 2
_VETOES = 5  # refusals after which a strategy that insists on such a frontier gets it; maze_8: same


class RobotView:
    """The view that a strategy has of its robot (``ports.ExplorationView``)."""

    def __init__(self, explore: Explore, name: str, peers: dict[str, Peer]) -> None:
        self._explore = explore
        self.name = name
        self.now_ns = 0
        self.pose = Pose2D(0.0, 0.0, 0.0)
        self.peers = peers

    def frontiers(self, limit: int | None = None) -> list[Frontier]:
        found = self._explore.frontiers(limit)
        self._explore.shown += found
        return found

    def stream(self, *name: str | int) -> np.random.Generator:
        return self._explore.stream("strategy", *name)


class Explore(Node):
    """Chooses a goal when there is none, or when the present one is no frontier any more.

    It never stops for good: maps may arrive later. ``costmap`` belongs to ``MoveBase`` on the same
    host, which announces on the topic ``costmap`` that it can be used; ``peers`` belongs to
    ``MapSharing``.
    """

    def __init__(self, host: Host, exploration: ExplorationParams, strategy: Strategy,
                 navigation: Navigation, body: BodyType, costmap: GlobalCostmap,
                 peers: dict[str, Peer]) -> None:
        super().__init__(host, "explore")
        self._exploration, self._strategy = exploration, strategy
        self._tolerance_m, self._radius_m = navigation.goal_tolerance_m, body.radius_m
        self._view = RobotView(self, host.name, peers)
        self._pose = Latest(host)
        self._costmap, self._planner = costmap, GlobalPlanner(costmap)
        self._mapped = False  # whether the costmap can be used
        # The frontier that the robot drives to, its cell at the unknown's edge, and the highest
        # cost that cells of its cluster may have.
        self._target: tuple[Frontier, int, int] | None = None
        self._blacklist: list[tuple[int, int, int]] = []  # row, column, until
        self._visited = (math.inf, math.inf, 0)  # x, y, number of visits in a row
        self._idle_until_ns = 0
        self._checked = -1  # the map's version when last a goal was confirmed or none found
        self.shown: list[Frontier] = []  # what the strategy chooses from

    def start(self) -> None:
        self.advertise("goal")
        self._pose = self.latest("pose")
        self.latest("peers")  # nothing waits for a new peer; the strategy reads them all
        self.subscribe("costmap", self._on_costmap)
        self.subscribe("goal_result", self._on_result)
        self.timer(self._exploration.rate_hz, self._tick)

    def frontiers(self, limit: int | None) -> list[Frontier]:
        """Reachable frontiers from where the robot is; if there are none, those too small or too
        near to obstacles to count at first."""
        x_m, y_m, _ = self._view.pose
        discs = self._discs()
        return (self._planner.frontiers((x_m, y_m), limit, self._smallest(), discs)
                or self._planner.hidden_frontiers((x_m, y_m), limit, discs))

    # ---------------------------------------------------------------------------- what comes in

    def _on_costmap(self, _: Message) -> None:
        self._mapped, self._checked = True, -1

    def _on_result(self, message: Message) -> None:
        result: GoalResult = message.content
        if self._target is None or (result.x_m, result.y_m) != self._target[0][:2]:
            return  # of a goal that was replaced meanwhile
        goal, cell, _ = self._target
        if result.reached:
            visits = self._visited[2] if self._near_visited(goal) else 0
            self._visited = (goal.x_m, goal.y_m, visits + 1)
        else:
            self._avoid(cell)
        self._target, self._checked = None, -1

    # ---------------------------------------------------------------------------- what it does

    def _tick(self, _: int) -> None:
        pose, target = self._pose.message, self._target
        if not self._mapped or pose is None:
            return
        if target is None:
            changed = self._costmap.robot_map.version != self._checked
            due = ((changed and self.now_ns >= self._idle_until_ns)
                   or any(until_ns <= self.now_ns for _, _, until_ns in self._blacklist))
        else:
            due = self._is_spoilt(*target)
        if due:
            self._choose(pose.content)

    def _choose(self, pose: Pose) -> None:
        view = self._view
        view.now_ns, view.pose = self.now_ns, Pose2D(pose.x_m, pose.y_m, pose.yaw_rad)
        self._blacklist = [entry for entry in self._blacklist if entry[2] > view.now_ns]
        self.shown.clear()
        chosen = self._chosen()
        for _ in range(_VETOES):
            if chosen is None or self._visited[2] < _VISITS or not self._near_visited(chosen):
                break
            self._avoid(self._planner.beside(chosen)[0])
            chosen = self._chosen()
        self._checked = self._costmap.robot_map.version
        if self.is_watched:
            self.display("frontiers", np.array([place[:2] for place in self.shown]).reshape(-1, 2))
        if chosen is not None:
            self.record("goal", bits(chosen.x_m), bits(chosen.y_m), chosen.cells)
            self.publish("goal", Goal(chosen.x_m, chosen.y_m))
            self._target = (chosen, *self._planner.beside(chosen))
        else:
            self._idle_until_ns = view.now_ns + _IDLE_NS
            if self._target is not None:
                self.publish("goal", Goal(math.nan, math.nan))  # stop
            self._target = None

    def _chosen(self) -> Frontier | None:
        """The strategy's choice. Raises ``ModelError`` for a place where the robot cannot be."""
        chosen = self._strategy.choose(self._view)
        if not (chosen is None or isinstance(chosen, Frontier)
                and (chosen in self.shown or self._is_free(chosen))):
            what = f"a list of {len(chosen)}" if isinstance(chosen, list) else repr(chosen)
            raise ModelError(f"{class_of(self._strategy)} chose {what}; wanted: one of "
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

    def _is_spoilt(self, goal: Frontier, cell: int, highest: int) -> bool:
        """Whether the unknown cells beside the goal are known now, or the goal is blocked. Cheap as
        long as nothing changed near by."""
        costmap = self._costmap
        reach = math.ceil(self._radius_m / costmap.spec.resolution_m) + 1
        corners = (cell + reach * (dr * costmap.across + dc) for dr in (-1, 1) for dc in (-1, 1))
        if not any(costmap.changed_at(corner, self._checked) for corner in corners):
            return False
        costmap.update()
        self._checked = costmap.seen
        wanted = min(goal.cells, self._smallest())
        return (costmap.frontier_cells(cell, reach, highest) < wanted
                or costmap.free_near(goal.x_m, goal.y_m, self._tolerance_m) < 0)

    def _smallest(self) -> int:
        return math.ceil(self._exploration.min_frontier_m / self._costmap.spec.resolution_m)

    def _near_visited(self, goal: Frontier) -> bool:
        x_m, y_m, _ = self._visited
        return math.hypot(goal.x_m - x_m, goal.y_m - y_m) <= self._tolerance_m

    def _avoid(self, cell: int) -> None:
        self._blacklist.append((*divmod(cell, self._costmap.across),
                                self.now_ns + self._exploration.blacklist_for_ns))

    def _discs(self) -> np.ndarray:
        """The blacklist as the search wants it: [k, 3] row, column, squared radius in cells."""
        radius = self._exploration.blacklist_radius_m / self._costmap.spec.resolution_m
        return np.array([(row, column, int(radius * radius))
                         for row, column, _ in self._blacklist], np.int64).reshape(-1, 3)

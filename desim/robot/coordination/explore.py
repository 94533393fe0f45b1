"""The node that sends its robot where the strategy wants it to go (the paper's explore)."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from desim.engine.trace import bits
from desim.middleware.contents import Float64, Goal, GoalResult, LaserScan, Twist
from desim.middleware.host import Host
from desim.middleware.message import Message
from desim.middleware.node import Node
from desim.middleware.topics import PolledSubscription, Publisher
from desim.ports import Frontier, GoalEnd, Place, Pose2D, Strategy
from desim.ports.arguments import check_choice, check_goal
from desim.robot.coordination.blacklist import Blacklist
from desim.robot.coordination.context import HostContext
from desim.robot.coordination.strategy_events import StrategyEvents
from desim.robot.coordination.task_link import TaskLink
from desim.robot.coordination.visits import Visits
from desim.robot.navigation.map_queries import MapQueries
from desim.robot.team import Team
from desim.scenario.schema.fleet import BodyType
from desim.scenario.schema.navigation import Navigation
from desim.scenario.schema.robot import ExplorationParams
from desim.units import NS_PER_S

# Tuned; ``maze_8`` beside a constant: see desim/robot/navigation/__init__.py.
# Pause after a search that found no goal, which goes through the whole map; maze_8: same.
_IDLE_NS = 5 * NS_PER_S
# Choices that are refused in one go because visits there were fruitless; the next one counts.
_VETOES = 5  # maze_8: same


class Target(NamedTuple):
    """The goal of the robot.

    ``cell``: of the frontier, at the edge of the unknown | ``highest``: the highest cost that cells
    of the frontier may have | ``cells``: their number, 0 for a place that is no frontier |
    ``path_m``: of the frontier when the goal was chosen, NaN for a place that is no frontier.
    """

    place: Place
    cell: int
    highest: int
    cells: int
    path_m: float


class Explore(Node):
    """Asks the strategy for a goal when there is none, or when the present one is obsolete.

    It never stops for good, since maps may arrive later. The costmap of ``queries`` belongs to
    ``MoveBase`` on the same host, which announces on the topic ``costmap`` that it can be used.
    ``MapSharing`` keeps the peers of ``team``, and ``share_map`` is its. ``laser``: the first one's
    topic.
    """

    def __init__(self, host: Host, exploration: ExplorationParams, strategy: Strategy,
                 navigation: Navigation, body: BodyType, queries: MapQueries, team: Team,
                 laser: str, share_map: Callable[[], None], link: TaskLink | None = None) -> None:
        super().__init__(host, "explore")
        self._rate_hz, self._strategy, self._queries = exploration.rate_hz, strategy, queries
        self._publishes_cost = exploration.publishes_cost
        self._costmap, self._planner = queries.costmap, queries.planner
        self._tolerance_m, self._radius_m = navigation.goal_tolerance_m, body.inscribed_radius_m
        self._context = HostContext(self, team, queries, self, link or TaskLink())
        self._events = StrategyEvents(strategy, self._context, team)
        self._pose: PolledSubscription
        self._laser, self.share_map = laser, share_map
        self._scans: PolledSubscription | None = None  # once the strategy wants them
        self._velocity: Publisher | None = None  # as well
        self._mapped = False  # whether the costmap can be used
        self._target: Target | None = None
        self._moving = False  # whether move_base has a goal of this node
        self._is_blocked = False  # whether the robot cannot be where the strategy last chose to go
        self._blacklist = Blacklist(exploration, self._costmap.across,
                                    self._costmap.spec.resolution_m)
        self._visits = Visits(navigation.goal_tolerance_m)
        self._idle_until_ns = 0
        self._checked = -1  # the map's version when last a goal was confirmed or none found
        self._shown: list[Frontier] = []  # the strategy has seen them in this tick

    def start(self) -> None:
        self.advertise("goal")
        if self._publishes_cost:
            self.advertise("cost")
            self.advertise("gain")
        self._pose = self.latest("pose")
        self.latest("peers")  # nothing waits for a new peer; the strategy reads them all
        self.subscribe("costmap", self._on_costmap)
        self.subscribe("goal_result", self._on_result)
        self.timer(self._rate_hz, self._tick, name="tick")
        self._context.listen(self._events.notified)
        self._events.started()

    def kept(self) -> dict[str, int]:
        """See ``Node.kept``: the costmap."""
        return {"cells": self._costmap.spec.cells}

    # --------------------------------------------------------------- for the strategy's context

    def pose(self) -> Pose2D | None:
        """The newest pose of localization."""
        message = self._pose.read()
        if message is None:
            return None
        pose = message.content
        return Pose2D(pose.x_m, pose.y_m, pose.yaw_rad)

    def goal(self) -> Place | None:
        """The place that the robot drives to."""
        return None if self._target is None else self._target.place

    def go(self, place: tuple[float, float] | Frontier) -> bool:
        """Drive to ``place``; see ``StrategyContext.go``."""
        check_goal(place)
        if not self._mapped or not self._queries.is_free(place[0], place[1]):
            return False
        before = self._target
        if before is None or before.place != place[:2]:
            self._drive_to(place)
            if before is not None:
                self._events.goal_ended(before.place, GoalEnd.REPLACED)
        return True

    def stop_driving(self) -> None:
        """Give the goal up, and stand."""
        before, self._target = self._target, None
        self._halt()
        if before is not None:
            self._events.goal_ended(before.place, GoalEnd.REPLACED)

    def drive(self, forward_mps: float, left_mps: float, turn_radps: float) -> None:
        """Drive at these velocities; see ``StrategyContext.drive``."""
        if self._velocity is None:
            self._velocity = self.advertise("cmd_vel")
        if self._target is not None or self._moving:
            self.stop_driving()
        self._velocity.publish(Twist(forward_mps, left_mps, turn_radps))

    def scan(self) -> LaserScan | None:
        """The newest scan of the first laser."""
        if self._scans is None:
            self._scans = self.latest(self._laser)
        message = self._scans.read()
        return None if message is None else message.content

    def discs(self) -> np.ndarray:
        """The blacklist, as the search takes it."""
        return self._blacklist.discs()

    def show(self, frontiers: list[Frontier]) -> None:
        """Note that the strategy was given ``frontiers``, and display them in the replay."""
        self._shown += frontiers
        if self.is_watched:
            self.display("frontiers", np.array([one[:2] for one in frontiers]).reshape(-1, 2))

    # ---------------------------------------------------------------------------- what comes in

    def _on_costmap(self, _: Message) -> None:
        self._mapped, self._checked = True, -1

    def _on_result(self, message: Message) -> None:
        result: GoalResult = message.content
        target = self._target
        if target is None or (result.x_m, result.y_m) != target.place:
            return  # of a goal that was replaced meanwhile
        self._target, self._moving, self._checked = None, False, -1
        if result.reached:
            self._visits.add(*target.place)
        else:
            self._blacklist.add(target.cell, self.now_ns)
        self._events.goal_ended(target.place,
                                GoalEnd.REACHED if result.reached else GoalEnd.FAILED)

    # ---------------------------------------------------------------------------- what it does

    def _tick(self, _: int) -> None:
        if self._pose.read() is None or not self._mapped:
            return
        self._shown.clear()
        now_ns = self.now_ns
        self._events.tick(now_ns, self._costmap.robot_map.version)
        target = self._target
        if target is None:
            changed = self._costmap.robot_map.version != self._checked
            if (changed and now_ns >= self._idle_until_ns) or self._blacklist.has_expired(now_ns):
                self._choose()
        elif self._is_obsolete(target):
            self._target = None
            self._events.goal_ended(target.place, GoalEnd.OBSOLETE)
            if self._target is None:
                self._choose()
        if self._publishes_cost:
            self._publish_cost()

    def _publish_cost(self) -> None:
        """Publish ``path_m`` of the goal and the length (m) of its frontier, as they were when
        the goal was chosen."""
        if self._target is not None:
            self.publish("cost", Float64(self._target.path_m))
            self.publish("gain", Float64(self._target.cells * self._costmap.spec.resolution_m))

    def _choose(self) -> None:
        self._blacklist.expire(self.now_ns)
        chosen = self._chosen()
        for _ in range(_VETOES):
            if chosen is None or not self._visits.were_fruitless(*chosen[:2]):
                break
            self._blacklist.add(self._edge(chosen)[0], self.now_ns)
            chosen = self._chosen()
        # A place that is blocked now is asked for again, although the map may not change.
        self._checked = -1 if self._is_blocked else self._costmap.robot_map.version
        if chosen is not None:
            self._drive_to(chosen)
        elif self._target is None:  # nor did the strategy set a goal while it was asked
            self._idle_until_ns = self.now_ns + _IDLE_NS
            if self._moving:
                self._halt()

    def _chosen(self) -> Frontier | Place | None:
        """The strategy's choice, None for a place where the robot cannot be by its own map. Raises
        ``ModelError`` for a frontier that it was not shown, and for a place off the map."""
        chosen = self._strategy.choose(self._context)
        check_choice(self._strategy, chosen, self._shown, self._queries.is_on_map)
        self._is_blocked = (chosen is not None and not isinstance(chosen, Frontier)
                            and not self._queries.is_free(*chosen))
        return None if self._is_blocked else chosen

    def _drive_to(self, place: tuple[float, float] | Frontier) -> None:
        at = Place(place[0], place[1])
        frontier = (place if isinstance(place, Frontier)
                    else self._planner.frontier_at(at.x_m, at.y_m))
        cells = 0 if frontier is None else frontier.cells
        self.record("goal", bits(at.x_m), bits(at.y_m), cells)
        self.publish("goal", Goal(at.x_m, at.y_m))
        path_m = math.nan if frontier is None else frontier.path_m
        self._target, self._moving = Target(at, *self._edge(frontier or at), cells, path_m), True

    def _halt(self) -> None:
        """Tell move_base to stop."""
        self._moving = False
        self.publish("goal", Goal(math.nan, math.nan))

    def _edge(self, place: tuple[float, float] | Frontier) -> tuple[int, int]:
        """``GlobalPlanner.edge_of`` of a frontier; the cell of any other place."""
        if isinstance(place, Frontier):
            return self._planner.edge_of(place)
        return self._costmap.cell(place[0], place[1]), 0

    def _is_obsolete(self, target: Target) -> bool:
        """Whether the unknown cells beside the goal have become known, or the goal is blocked. This
        is cheap as long as nothing has changed nearby."""
        costmap = self._costmap
        reach = math.ceil(self._radius_m / costmap.spec.resolution_m) + 1
        if not costmap.changed_near(target.cell, reach, self._checked):
            return False
        costmap.update()
        self._checked = costmap.seen
        wanted = min(target.cells, self._queries.smallest)
        return (costmap.count_frontier_cells(target.cell, reach, target.highest) < wanted
                or costmap.free_near(*target.place, self._tolerance_m) < 0)

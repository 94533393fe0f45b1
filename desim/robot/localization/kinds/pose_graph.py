"""SLAM by a pose graph: of one robot, or with what its team sees and knows."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from desim.ports import Pose2D
from desim.ports.localization import LocalizationContext, ScanWithOdometry
from desim.robot.localization.graph_exchange import GraphExchange
from desim.robot.localization.graph_news import GraphNode
from desim.robot.localization.kinds.scan_matching import ScanMatching, settings_of
from desim.robot.slam.closures import ClosureFinder, ScanMatcher
from desim.robot.slam.fleet_graph import FleetGraph, Seen, on_motion, shown
from desim.robot.slam.sightings import sightings
from desim.robot.slam.strangers import Strangers
from desim.robot.transforms import motion_between, turned
from desim.units import NS_PER_S, Pace

# All of these are ours.
_LOCAL, _FRESH = 80, 40  # scans of the local map, at most, and those that it keeps when it is full
_NEWEST = 2000  # nodes of all robots that may still move: of eight, those of three minutes
_LATEST = 300  # of which the newest are solved for after each message to the team, in one step
_STEPS = 3  # of Gauss-Newton, where all of them are
_SETTLED_NS, _STALE_NS = 2 * NS_PER_S, 10 * NS_PER_S  # the age of a sighting that is looked into


class GraphSlam(ScanMatching):
    """SLAM by a pose graph (Grisetti, Kuemmerle, Stachniss and Burgard 2010). Each processed scan
    is a node: it is matched with the last 40 to 79, and with older ones nearby (loop closures). The
    graph is solved, and the map drawn anew, every ``redraw_every``.

    With a ``team`` robots send each other their nodes, what they have sighted or closed, and each
    solves the graph of all. Strangers enter it when it is found where they are.
    """

    class Params(ScanMatching.Params):
        """Parameters of ``pose_graph``."""

        team: Literal["nothing", "sightings", "scans", "all"] = Field("all", description=(
            "nodes go to teammates, with sightings of teammates, with scans to close loops "
            "between robots, or all of it"))
        period_ns: Pace = Field("1 s", description="between two messages to the team")

    def __init__(self, params: Params) -> None:
        super().__init__(params)
        self._params = params
        self._fleet = FleetGraph()
        self._strangers: Strangers | None = None
        self._exchange = GraphExchange(self._fleet)
        self._local: list[np.ndarray] = []  # poses of own nodes by the local map
        self._scans: list[np.ndarray] = []
        self._by_scan = np.zeros((3, 3))  # what the last scan showed of its pose
        self._first_local = 0  # the first of those in the local map
        self._seen: list[Seen] = []  # of whom is open
        self._team: tuple[str, ...] = ()

    def start(self, context: LocalizationContext) -> None:
        """Make the filter, and join the team where there is one."""
        super().start(context)
        matcher = ScanMatcher(settings_of(context))
        self._closures = ClosureFinder(self._fleet, matcher)
        if context.start is not None and self._params.team != "nothing":
            self._team = context.team + context.strangers
            if context.strangers:
                self._strangers = self._exchange.strangers = Strangers(matcher)
        if self._team:
            self._exchange.start(context)
            context.every(self._params.period_ns, self._send)

    def _process(self, context: LocalizationContext, scan: ScanWithOdometry) -> Pose2D:
        """Make a node of the scan."""
        super()._process(context, scan)
        local, ranges = self.filter.pose, np.array(scan.ranges)
        name, own, information = context.name, len(self._local), np.zeros((3, 3))
        if own:
            motion = motion_between(self._local[-1], local)
            by_scan = shown(self.filter.scan_information)
            information = turned(self.filter.odometry_information
                                 + (by_scan if own == 1 else on_motion(by_scan, self._by_scan)),
                                 -self._local[-1][2])
            self._by_scan = by_scan
        else:
            motion = self._in_map(local)
        said = motion if own or self._strangers is None else np.zeros(3)  # nobody knows its start
        node = GraphNode(context.now_ns, said, information,
                         ranges if self._params.team in ("scans", "all") else None)
        self._exchange.nodes.append(node)
        self._fleet.add(name, node.stamp_ns, motion, information, ranges)
        self._local.append(local)
        self._scans.append(ranges)
        self._renew_local_map()
        if self._team and self._params.team in ("sightings", "all"):
            seen = sightings(ranges, context.laser, context.bodies_m)
            self._seen += [Seen(own, one) for one in seen]
            if self._strangers is not None:
                self._strangers.saw(node.stamp_ns, self._fleet.path(name)[-1], seen)
        for closure in self._closures.found(name, own, ranges):
            context.closed(closure.source, closure.theirs, closure.own, closure.motion)
            self._exchange.tie(context, closure)
        if self._strangers is not None:
            for closures in self._strangers.found(self._fleet, name, ranges):
                self._exchange.introduce(context, closures)
        return Pose2D(*self._fleet.path(name)[-1].tolist())

    def _renew_local_map(self) -> None:
        if len(self._local) - self._first_local >= _LOCAL:
            self._first_local = len(self._local) - _FRESH
            self.filter.start_map(np.array(self._local[self._first_local:]),
                                  self._scans[self._first_local:])

    def _send(self, context: LocalizationContext) -> None:
        """Look whom the robot has seen, tell the team what is new, and correct the pose."""
        waiting, self._seen = self._seen, []
        for seen in waiting:
            age_ns = context.now_ns - self._exchange.nodes[seen.own].stamp_ns
            met = None if age_ns < _SETTLED_NS else self._fleet.met(context.name, seen, self._team)
            if met is not None:
                self._exchange.tie(context, met)
            elif age_ns < _STALE_NS:
                self._seen.append(seen)
        self._exchange.send(context)
        if self._strangers is not None:
            for source in self._fleet.tracks:
                if source != context.name:
                    context.place(source, Pose2D(*self._fleet.path(source)[0].tolist()))
        self._solve(context, 1, _LATEST)

    def _redraw(self, context: LocalizationContext) -> None:
        """Solve the graph, and draw the map from its poses."""
        self._solve(context, _STEPS, _NEWEST)
        if self._processed is not None:
            context.redraw(self._fleet.path(context.name))

    def _solve(self, context: LocalizationContext, steps: int, newest: int) -> None:
        """Solve the graph of the newest nodes, and correct the robot's pose by it."""
        if self._processed is not None:
            self._fleet.graph.optimize(steps, newest)
            self._processed = self._processed[0], Pose2D(
                *self._fleet.path(context.name)[-1].tolist())

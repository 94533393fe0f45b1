"""The node that runs a map sharing plug-in, through which a robot shares its map with its team."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial

from desim.engine.trace import bits
from desim.errors import ModelError, class_of
from desim.middleware.contents import EMPTY, LaserScan
from desim.middleware.host import Host
from desim.middleware.node import Node
from desim.middleware.topics import PolledSubscription, Publisher
from desim.ports import Pose2D
from desim.ports.arguments import check_contribution, check_frame
from desim.ports.computers import Keeps
from desim.ports.sharing import (
    Contribution,
    FollowsRedraws,
    FollowsScans,
    PlansWithMerged,
    SharesOnRequest,
    Sharing,
)
from desim.robot.mapping.robot_map import RobotMap
from desim.robot.mapping.tiles import CELLS, LayerSnapshot
from desim.robot.sharing.context import MapContext
from desim.robot.team import Team
from desim.units import NS_PER_S

_AHEAD_NS = 3600 * NS_PER_S  # of its source's clock, which may have been set back since


class MapSharing(Node):
    """Runs ``sharing`` (None: the robot shares nothing) and hands received evidence to
    ``robot_map`` and received poses to ``team``. ``own_map`` is the map of the robot's own scans,
    often ``robot_map`` itself.

    The event ``map`` announces to other nodes of the host that the map has changed, the event
    ``peers`` that ``team`` has a new peer.
    """

    def __init__(self, host: Host, sharing: Sharing | None, robot_map: RobotMap,
                 peers: tuple[str, ...], team: Team, own_map: RobotMap) -> None:
        super().__init__(host, "map_sharing")
        self.robot_map, self.peers, self.team, self.own_map = robot_map, peers, team, own_map
        self._sharing = sharing
        self._keeper = sharing if isinstance(sharing, Keeps) else None
        self._pose: PolledSubscription  # where maps are shared
        self._map: Publisher  # there, too
        self._context: MapContext  # there, too
        own = (host.name,) if isinstance(sharing, PlansWithMerged) else ()
        self._sources = frozenset((*peers, *own))  # of contributions

    def start(self) -> None:
        sharing = self._sharing
        if sharing is None:
            return
        self._map = self.advertise("map")
        self.advertise("peers")
        self._pose = self.latest("pose")
        self._context = context = MapContext(self)
        sharing.start(context)
        if isinstance(sharing, FollowsScans):
            self.own_map.scan_observers.append(partial(sharing.on_scan, context))
        if isinstance(sharing, FollowsRedraws):
            self.own_map.redraw_observers.append(partial(sharing.on_redraw, context))

    def kept(self) -> dict[str, int]:
        """See ``Node.kept``: the map of each robot that it has heard of, its own and the merged
        one, and what the plug-in keeps."""
        maps = 0 if self._sharing is None else 2 + len(self.robot_map.received)
        cells = {"cells": maps * self.robot_map.spec.cells}
        return cells if self._keeper is None else {**cells, **self._keeper.kept()}

    @property
    def pose(self) -> Pose2D | None:
        """The newest pose of localization."""
        message = self._pose.read()
        return None if message is None else Pose2D(*message.content[1:])

    def share(self) -> None:
        """See ``StrategyContext.share_map``."""
        if not isinstance(self._sharing, SharesOnRequest):
            what = "nothing" if self._sharing is None else class_of(self._sharing)
            raise ModelError(f"coordination.exchange shares {what}, and so no map when a strategy "
                             "wants to; own_maps does")
        self._sharing.share(self._context)

    def take_in(self, contributions: Iterable[Contribution]) -> None:
        """See ``SharingContext.take_in``."""
        try:
            each = iter(contributions)
        except TypeError:
            raise ModelError(f"a robot takes in a list of Contributions, not {contributions!r}"
                             ) from None
        team, now_ns, before = self.team, self.now_ns, len(self.team.peers)
        true_ns, hosts = self._graph.kernel.now_ns, self._graph.by_name
        updates: list[tuple[str, int, LayerSnapshot]] = []
        for contribution in each:
            check_contribution(contribution, self._sources)
            source, version, pose, evidence = contribution
            clock_ns = hosts[source].clock_ns(true_ns)
            if version > clock_ns + _AHEAD_NS:
                raise ModelError(f"the version {version} is to come: the clock of {source} shows "
                                 f"{clock_ns} ns; wanted: what it showed when pose and evidence "
                                 "were taken")
            if pose is not None:
                team.note_pose(source, *pose, version, now_ns)
            if evidence is None:
                continue
            if isinstance(evidence, LayerSnapshot):
                self.worked(cells=len(evidence.tiles) * CELLS)
                updates.append((source, version, evidence))
            else:
                raise ModelError(f"evidence comes from a context, from own() or drawn(), not "
                                 f"{evidence!r}")
        if len(team.peers) > before:
            self.publish("peers", EMPTY)
        if updates and self.robot_map.receive(updates):
            self._map.publish(EMPTY)

    def place(self, source: str, frame: Pose2D | None) -> None:
        """See ``SharingContext.place``."""
        check_frame(source, frame, self.peers)
        number = self._graph.names.id(source)
        if frame is None:
            self.record("frame_lost", number)
            return
        self.record("frame_of", number)
        self.record("frame_at", *map(bits, frame))


def own_map_for(robot_map: RobotMap, sharing: Sharing | None) -> RobotMap:
    """The map of the robot's own scans: ``robot_map`` itself, or a separate one if map sharing
    makes the map to plan with."""
    raytrace_range_m = sharing.raytrace_range_m if isinstance(sharing, PlansWithMerged) else None
    if raytrace_range_m is None:
        return robot_map
    own_map = RobotMap(robot_map.spec, robot_map.pool)

    def see_near_by(pose: Pose2D, scan: LaserScan, usable_range_m: float) -> None:
        robot_map.integrate_scan(*pose, scan, min(raytrace_range_m, usable_range_m))

    own_map.scan_observers.append(see_near_by)
    return own_map

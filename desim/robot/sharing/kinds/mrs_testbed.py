"""The map merging of the paper's testbed, as published (yzrobot/map_merging, map_merging.cpp)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal, NamedTuple

from pydantic import Field

from desim import ports
from desim.middleware.contents import POSE_STAMPED_BYTES
from desim.ports import Pose2D
from desim.ports.sharing import (
    Contribution,
    Evidence,
    Scan,
    SharedMessage,
    SharingContext,
    SharingTraits,
)
from desim.robot.sharing.map_message import MapFormat, MapUpdate
from desim.units import NS_PER_S, Length, Pace

MERGING_HZ = 10  # merging_rate
POSE_HZ = 10  # robot_pose_publisher (GT-RAIL)


class StampedPose(NamedTuple):
    """A robot's pose: geometry_msgs/PoseStamped."""

    pose: Pose2D

    @property
    def size_bytes(self) -> int:
        return POSE_STAMPED_BYTES


class MrsTestbed:
    """Merges with one partner for each update of the own map, and hands the merged map over only
    when all teammates are merged: a round of n robots takes n - 1 updates, and no round ends while
    one robot is silent.

    Maps are full grids (nav_msgs/OccupancyGrid), sent after a scan was processed and ``period`` has
    passed, as gmapping does: a robot that stands sends none. Poses go out at 10 Hz. The partner is
    the first teammate that is not merged in this round, was heard and is nearer than
    ``max_distance``; it stays the partner until it is merged, even out of reach. The distance
    limits merging only: messages go to all robots.

    With ``raytrace_range`` the robot gets its own map, too, only at the end of a round, as the
    published explore does; a robot without teammates never gets it. ``partners`` and ``hand_over``
    each switch one mechanism off, to measure its effect.

    The published node also asks the master ten times a second for the names of the robots. The
    middleware ``ros1`` models that as ``polling``.
    """

    # greedyMerging: its own evidence, then partners fill in what is unknown. Each merging takes an
    # update of the own map, and a pose.
    traits = SharingTraits(fusion="greedy", needs_body=True)

    class Params(ports.Params):
        """The period of maps, and the reach of merging."""

        period_ns: Pace = Field("5 s", description="(gmapping map_update_interval)")
        max_distance_m: Length = Field("200 m", description=(
            "(the paper, 5.1; the published launch file says 100 m, the code 10 m)"))
        raytrace_range_m: Length | None = Field(None, gt=0, description=(
            "the robot plans with maps of whole rounds, and beside them with what it sees itself "
            "up to here (3 m in the published explore_costmap.yaml, raytrace_range; null: with its "
            "own map at once)"))
        partners: Literal["one", "all"] = Field("one", description=(
            "merged for each update of the own map (map_merging.cpp: one; all: with whoever has "
            "sent a map)"))
        hand_over: Literal["rounds", "merged"] = Field("rounds", description=(
            "what was merged when all robots are (map_merging.cpp), or each at once"))

    def __init__(self, params: Params) -> None:
        self._params = params
        self._published_ns: int | None = None  # the last map
        self._own_is_fresh = False  # the own map was updated since the last merging
        self._poses: dict[str, Pose2D] = {}  # heard and not used yet
        self._maps: dict[str, MapUpdate] = {}  # likewise
        self._partner: str | None = None
        self._merged: dict[str, MapUpdate] = {}  # in this round, in order
        self._own: tuple[int, Evidence] | None = None  # as of the round's first merging

    @property
    def raytrace_range_m(self) -> float | None:
        """See ``ports.sharing.PlansWithMerged``."""
        return self._params.raytrace_range_m

    def start(self, context: SharingContext) -> None:
        self._codec = MapFormat(context.grid, "full", "raw", context.padding)
        context.advertise(latch=True)
        context.advertise("pose")
        self._inbox, self._heard = context.latest(), context.latest("pose")
        context.every(NS_PER_S // POSE_HZ, _publish_pose)
        context.every(NS_PER_S // MERGING_HZ, self._loop)

    def on_scan(self, context: SharingContext, pose: Pose2D, scan: Scan,
                usable_range_m: float) -> None:
        """Publish the map if it is time."""
        now_ns = context.now_ns
        if self._published_ns is None or now_ns - self._published_ns >= self._params.period_ns:
            self._published_ns, self._own_is_fresh = now_ns, True
            layer = context.own()
            context.publish(MapUpdate(context.name, now_ns, pose, layer,
                                      self._codec.size_bytes(layer)))

    def _loop(self, context: SharingContext) -> None:
        context.worked(candidates=len(context.team))  # the master names the topics of all robots
        self._listen(context, self._heard.news())
        for message in self._inbox.news():
            self._maps[message.source] = message.content
        if self._params.partners == "one":
            self._partner = self._partner or self._found(context, context.team)
            if self._own_is_fresh and self._partner in self._maps:
                self._merge(context, self._partner)
                self._partner = None
        elif self._own_is_fresh:
            waiting = [name for name in context.team if name in self._maps]
            while (name := self._found(context, waiting)) is not None:
                self._merge(context, name)

    def _merge(self, context: SharingContext, partner: str) -> None:
        self._own_is_fresh = False
        self._own = self._own or (context.now_ns, context.own())
        self._merged[partner] = self._maps.pop(partner)
        ends = len(self._merged) == len(context.team)
        if ends or self._params.hand_over == "merged":
            self._hand_over(context)
        if ends:
            self._merged, self._own = {}, None

    def _hand_over(self, context: SharingContext) -> None:
        """Take in the maps merged so far in this round, and the own map of its beginning."""
        merged = [Contribution(update.source, update.version, None, update.layer)
                  for update in self._merged.values()]
        if self.raytrace_range_m is not None and self._own is not None:
            merged.insert(0, Contribution(context.name, self._own[0], None, self._own[1]))
        context.take_in(merged)

    def _listen(self, context: SharingContext, heard: Sequence[SharedMessage]) -> None:
        """Note the poses of teammates."""
        self._poses |= {message.source: message.content.pose for message in heard}
        if heard:
            context.take_in([Contribution(message.source, message.sent_ns, message.content.pose,
                                          None) for message in heard])

    def _found(self, context: SharingContext, names: Sequence[str]) -> str | None:
        """The next partner: of the robots in natural order, as the master lists topics."""
        own = context.pose
        if own is None:
            return None
        for name in names:
            pose = self._poses.pop(name, None) if name not in self._merged else None
            if pose is not None and math.dist(own[:2], pose[:2]) < self._params.max_distance_m:
                return name
        return None


def _publish_pose(context: SharingContext) -> None:
    pose = context.pose
    if pose is not None:
        context.publish(StampedPose(pose), "pose")

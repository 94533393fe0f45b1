"""Robots pass on what they have received: evidence crosses a chain of robots."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from desim.ports import Pose2D
from desim.ports.sharing import Contribution, Evidence, ReceivedEvidence, SharingContext
from desim.robot.sharing.map_message import MapFormat, MapUpdate, MapUpdateParams
from desim.robot.sharing.rates import MERGING_HZ, REFRESH_PERIODS
from desim.units import NS_PER_S


class RelayedUpdates(NamedTuple):
    """Updates of several sources: on the wire an array, each with its source's name (a
    std_msgs/String) in front."""

    updates: tuple[MapUpdate, ...]

    @property
    def size_bytes(self) -> int:
        return 4 + sum(4 + len(update.source) + update.size_bytes for update in self.updates)


class Relayed:
    """Sends every ``period`` the tiles that have changed in the robot's own evidence and in what it
    has received, each with the version that its source gave it, and everything every sixth time.
    """

    Params = MapUpdateParams

    def __init__(self, params: MapUpdateParams) -> None:
        self._params = params
        self._own: Evidence | None = None  # at the last message
        self._sent: dict[str, ReceivedEvidence] = {}  # by source, likewise
        self._poses: dict[str, tuple[int, Pose2D]] = {}  # the newest heard, and its version
        self._period = -1

    def start(self, context: SharingContext) -> None:
        self._codec = MapFormat(context.grid, "changed_tiles", self._params.encoding)
        context.advertise(latch=True, via=self._params.via)
        self._inbox = context.latest()
        context.every(self._params.period_ns, self._on_period)
        context.every(NS_PER_S // MERGING_HZ, self._merge)

    def _on_period(self, context: SharingContext) -> None:
        self._period += 1
        pose = context.pose
        if pose is None or not context.has_subscribers():
            return
        if self._period % REFRESH_PERIODS == 0:
            self._own, self._sent = None, {}
        updates = [*self._own_update(context, pose), *self._passed_on(context)]
        if updates:
            context.publish(RelayedUpdates(tuple(updates)))

    def _own_update(self, context: SharingContext, pose: Pose2D) -> Iterator[MapUpdate]:
        known, before = context.own(), self._own
        self._own = known
        if before is not None:
            changed = known.changed_since(before)
            if len(changed):
                yield self._update(context.name, context.now_ns, pose, known.only(changed))
        elif len(known.filled()):
            yield self._update(context.name, context.now_ns, pose, known)

    def _passed_on(self, context: SharingContext) -> Iterator[MapUpdate]:
        for source, known in context.received().items():
            before = self._sent.get(source)
            self._sent[source] = known
            stamp_ns, pose = self._poses.get(source, (-1, None))
            for version, part in _by_version(known, before):
                yield self._update(source, version, pose if version == stamp_ns else None, part)

    def _update(self, source: str, version: int, pose: Pose2D | None, layer: Evidence
                ) -> MapUpdate:
        return MapUpdate(source, version, pose, layer, self._codec.size_bytes(layer))

    def _merge(self, context: SharingContext) -> None:
        updates = [update for message in self._inbox.news() for update in message.content.updates
                   if update.source != context.name]
        for source, version, pose, _, _ in updates:
            if pose is not None and version >= self._poses.get(source, (-1, pose))[0]:
                self._poses[source] = version, pose
        if updates:
            context.take_in([Contribution(*update[:4]) for update in updates])


def _by_version(known: ReceivedEvidence, before: ReceivedEvidence | None
                ) -> Iterator[tuple[int, Evidence]]:
    """The evidence that has changed since ``before`` (None: all), in parts of one version each. If
    all evidence has one version it is one complete part, so that receivers forget other tiles."""
    versions = known.sent
    if before is None and versions.min() == versions.max() >= 0:
        yield int(versions[0]), known
        return
    tiles = known.filled() if before is None else known.changed_since(before)
    for version in np.unique(versions[tiles]):
        yield int(version), known.only(tiles[versions[tiles] == version])

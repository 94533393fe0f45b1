"""Checks of map sharing: does a class keep its contract?"""

from __future__ import annotations

import numpy as np

from desim.ports import Pose2D
from desim.ports.sharing import SharedMessage, Sharing, SharingTraits
from desim.robot.mapping.tiles import LayerSnapshot, TilePool
from desim.testing.advice import PluginClass, check_form, made, need
from desim.testing.checks import own_streams
from desim.testing.shared_state import own_state
from desim.testing.sharing_bench import SharingBench
from desim.units import NS_PER_S

_SLICE_NS = NS_PER_S // 10  # messages take so long
_LOST_S, _TALK_S = 40, 90
_STEP_M = 0.1  # a second


def check_sharing(cls: PluginClass[Sharing], **params: object) -> None:
    """Check a ``ports.sharing.Sharing``: two robots drive and share maps. At first every message is
    lost; then all of them come in reverse order, twice; then they come as they should; in the end
    ``robot_1`` starts again elsewhere with empty memory. What ``robot_2`` takes in must be what
    ``robot_1`` knows, it must come through, what was said before the restart must be forgotten, and
    the same must happen again. A coordinator without a body, which hears what is carried, must get
    a map as well, unless its traits say ``needs_body``."""
    check_form("sharing", cls, params)
    with own_streams(cls), own_state(cls):
        played = [_Play(cls, params).played() for _ in range(2)]
    need(played[0] == played[1], cls, "share alike in like situations: keep state in self, and "
                                      "iterate over no set")


class _Play:
    """Two robots that drive, each on its own line."""

    def __init__(self, cls: PluginClass[Sharing], params: dict[str, object]) -> None:
        self._cls, self._params, self._pool, self._now_ns = cls, params, TilePool(), 0
        self._one, self._two = self._robot("robot_1", "robot_2"), self._robot("robot_2", "robot_1")
        # It sees nothing, nobody hears it, and it hears robot_1 alone.
        self._base = self._robot("base", "robot_1", "robot_2")
        self._known: list[LayerSnapshot] = []  # of robot_1, at the end of each of its lives
        self._line_m = 10.0

    def _robot(self, name: str, *others: str) -> SharingBench:
        return SharingBench(made(self._cls, self._params), name, others, self._pool, self._now_ns)

    def played(self) -> list[object]:
        """All that can be told from outside: what robot_2 took in, and the sizes of messages."""
        cls = self._cls
        lost = self._drive(_LOST_S, carries=False)
        for receiver, topic, message in (*reversed(lost), *reversed(lost)):
            receiver.deliver(topic, message)
        self._drive(_TALK_S)
        self._check_truth()
        need(len(self._heard()), cls, f"hand to the map in {_TALK_S} s what a teammate has sent: "
                                      "context.take_in")
        need("robot_1" in self._base.robot_map.received or SharingTraits.of(cls).needs_body, cls,
             "hand to the map of a host without a body, a coordinator, what a robot has sent; or "
             "declare traits = SharingTraits(needs_body=True)")
        self._known.append(self._one.own())
        first, before = self._heard(), self._one.sizes
        self._one, self._line_m = self._robot("robot_1", "robot_2"), 55.0
        self._drive(_TALK_S)
        self._check_truth()
        stale = np.intersect1d(first, self._heard())
        need(not len(stale), cls, "forget what a robot said before it started again with empty "
                                  f"memory; tiles {stale.tolist()} are still there")
        need(len(self._heard()), cls, "go on with a teammate that has started again")
        sizes = [*before, *self._one.sizes, *self._two.sizes]
        for _, version, *_ in self._two.contributions:
            need(version <= self._now_ns, cls,
                 f"give the source's clock in ns as version, not {version!r}")
        return [sizes, self._two.robot_map.fused.tobytes(),
                [one[:3] for one in self._two.contributions]]

    def _drive(self, seconds: int, carries: bool = True
               ) -> list[tuple[SharingBench, str, SharedMessage]]:
        """Drive on; the messages that are not carried."""
        kept: list[tuple[SharingBench, str, SharedMessage]] = []
        for step in range(seconds * NS_PER_S // _SLICE_NS):
            self._now_ns += _SLICE_NS
            for robot, y_m in ((self._one, self._line_m), (self._two, 30.0)):
                robot.run(self._now_ns)
                if step * _SLICE_NS % NS_PER_S == 0:
                    x_m = 5.0 + self._now_ns / NS_PER_S * _STEP_M
                    robot.see(Pose2D(x_m, y_m, 0.0))
            self._base.run(self._now_ns)
            for robot, other in ((self._one, self._two), (self._two, self._one)):
                said, robot.published = robot.published, []
                kept += [(other, *one) for one in said]
            if carries:
                for receiver, topic, message in kept:
                    receiver.deliver(topic, message)
                    if receiver is self._two:
                        self._base.deliver(topic, message)
                kept = []
        return kept

    def _heard(self) -> np.ndarray:
        """The tiles of robot_1 that robot_2 knows something in."""
        received = self._two.robot_map.received.get("robot_1")
        return np.zeros(0, np.int32) if received is None else received.filled()

    def _check_truth(self) -> None:
        """All that robot_2 took in as evidence of robot_1 is robot_1's, and says free."""
        received = self._two.robot_map.received.get("robot_1")
        if received is not None:
            said = received.cells()
            known = sum((np.abs(own.cells().astype(np.int16))
                         for own in (*self._known, self._one.own())),
                        np.zeros(said.shape, np.int16))
            need(not (said > 0).any() and not ((said != 0) & (known == 0)).any(), self._cls,
                 "hand to the map what its source knows, under the source's name")

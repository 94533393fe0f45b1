"""The teammates of a host: their names, their last poses, and when each was last heard of."""

from __future__ import annotations

from collections.abc import Callable

from desim.middleware.message import Message
from desim.ports import Peer, Place, TeamLink

_new = tuple.__new__  # a named tuple at half the price


class Team:
    """The other hosts with a strategy.

    ``names``: of all of them | ``peers``: the newest pose of each, from a map update or a
    ``TeamState`` | ``signal_of``: a function that computes the power (dBm) at which the host's
    radio has received a message, None where its model has no signals | ``common_frame``: whether
    robots know the relative poses of their frames from the start.
    """

    def __init__(self, names: tuple[str, ...], lost_after_ns: int,
                 signal_of: Callable[[Message], Callable[[], float | None] | None] | None = None,
                 common_frame: bool = True) -> None:
        self.names, self.common_frame = names, common_frame
        self._signal_of, self.hears_signals = signal_of, signal_of is not None
        self._signals: dict[str, Callable[[], float | None] | None] = {}  # of the last messages
        self.peers: dict[str, Peer] = {}
        self._lost_after_ns = lost_after_ns
        self._stamp_ns: dict[str, int] = {}  # of the peers' poses
        self._spoke_ns: dict[str, int] = {}  # the last message of its strategy
        self._present: dict[str, bool] = {}

    def note_pose(self, name: str, x_m: float, y_m: float, yaw_rad: float, stamp_ns: int,
                  now_ns: int) -> None:
        """Note the pose that ``name`` had at ``stamp_ns``. If a newer one is known, note only that
        ``name`` was heard."""
        known = self.peers.get(name)
        if known is None or stamp_ns >= self._stamp_ns[name]:
            self._stamp_ns[name] = stamp_ns
            self.peers[name] = _new(Peer, (x_m, y_m, yaw_rad, now_ns,
                                           None if known is None else known.goal))
        else:
            self.peers[name] = known._replace(heard_ns=now_ns)

    def note_goal(self, name: str, goal: Place | None) -> None:
        """Note the goal of ``name``, whose pose is known."""
        self.peers[name] = self.peers[name]._replace(goal=goal)

    def received(self, message: Message) -> None:
        """Note the signal of ``message``, which has come from a teammate."""
        if self._signal_of is not None:
            self._signals[message.origin.name] = self._signal_of(message)

    def spoke(self, name: str, now_ns: int) -> None:
        """Note that a message of the strategy of ``name`` has arrived."""
        self._spoke_ns[name] = now_ns

    def links(self) -> dict[str, TeamLink]:
        """The teammates that were ever heard of."""
        heard = ((name, self._heard_ns(name)) for name in self.names)
        return {name: TeamLink(heard_ns, self._signals.get(name))
                for name, heard_ns in heard if heard_ns is not None}

    def changes(self, now_ns: int) -> list[tuple[str, bool]]:
        """The changes since the last call: teammates that are heard of for the first time or again
        (True), and those that count as lost, not heard of for ``lost_after_ns`` (False)."""
        changed = []
        for name in self.names:
            heard_ns = self._heard_ns(name)
            present = heard_ns is not None and now_ns - heard_ns <= self._lost_after_ns
            if present != self._present.get(name, False):
                self._present[name] = present
                changed.append((name, present))
        return changed

    def _heard_ns(self, name: str) -> int | None:
        times = [self._spoke_ns[name]] if name in self._spoke_ns else []
        if name in self.peers:
            times.append(self.peers[name].heard_ns)
        return max(times, default=None)

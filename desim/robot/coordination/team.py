"""The teammates of a host: who they are, and when each was last heard of."""

from __future__ import annotations

from desim.ports import Peer


class Team:
    """``names`` of all other hosts with a strategy | ``peers`` the last map update of each."""

    def __init__(self, names: tuple[str, ...], lost_after_ns: int) -> None:
        self.names = names
        self.peers: dict[str, Peer] = {}
        self._lost_after_ns = lost_after_ns
        self._spoke_ns: dict[str, int] = {}  # the last message of its strategy
        self._present: dict[str, bool] = {}

    def spoke(self, name: str, now_ns: int) -> None:
        """A message of the strategy of ``name`` has arrived."""
        self._spoke_ns[name] = now_ns

    def changes(self, now_ns: int) -> list[tuple[str, bool]]:
        """The teammates that were heard of for the first time or again (True), and those that were
        not for too long (False), since the last call."""
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

"""The beliefs of hosts about each other, beside the truth.

In truth, a *match* is a publisher and a subscriber of one topic on two hosts that are both up. One
of its ends has to learn of the other before messages flow. A match that this end has not learnt of
is *missing*; a match that it believes in and that does not exist is a *ghost*. Reachability does
not matter here: an unreachable host that runs is no ghost.

Each change is a trace row: ``advertises`` and ``subscribes`` (entity: the host; a: the topic),
``believes`` (entity: the believer; a: the other host, b: the topic, c: 1 or 0), ``sees`` (a: the
other host, b: the state).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from desim.ports.middleware import HostState

Match = tuple[int, int, str]  # believer, other, topic

OnSees = Callable[[int, int, HostState], object]


class Beliefs:
    """``informed`` is the end that has to learn, ``"subscriber"`` or ``"publisher"``.
    ``note(kind, host, a, b, c)`` writes a row; hosts are indices, ``ids`` their trace ids, ``name``
    gives the id of a name. Hosts of different ``domains`` (one for each host; empty: all are in
    one) have no matches. The functions in ``watchers`` are called with each change of ``sees``.

    ``true`` has the matches that exist, ``believed`` those that a host believes in, ``seen`` the
    state in which a believer sees another host; all are to be read only."""

    def __init__(self, informed: str, note: Callable[..., object], ids: list[int],
                 name: Callable[[str], int], domains: Sequence[int] = ()) -> None:
        self.watchers: list[OnSees] = []
        self._note, self._ids, self._name = note, ids, name
        self._informed = 0 if informed == "subscriber" else 1
        self._domains = domains or [0] * len(ids)
        # By domain and topic, subscribing and publishing hosts; all as dictionaries without values,
        # because these keep their order.
        self._ends: dict[tuple[int, str], tuple[dict[int, None], dict[int, None]]] = {}
        self.true: dict[Match, None] = {}
        self.believed: dict[Match, None] = {}
        self.seen: dict[tuple[int, int], HostState] = {}

    @property
    def matches(self) -> int:
        """The number of matches that exist."""
        return len(self.true)

    @property
    def missing(self) -> int:
        """The number of matches that one end has yet to learn of."""
        return len(self.true.keys() - self.believed.keys())

    @property
    def ghosts(self) -> int:
        """The number of beliefs in matches that do not exist."""
        return len(self.believed.keys() - self.true.keys())

    @property
    def divergence(self) -> float:
        """Missing matches and ghosts, as a share of matches and ghosts; 0 without any."""
        ghosts = self.ghosts
        return (self.missing + ghosts) / max(1, self.matches + ghosts)

    # The truth.

    def subscribes(self, host: int, topic: str) -> None:
        self._begins(0, host, topic)
        self._note("subscribes", host, self._name(topic))

    def advertises(self, host: int, topic: str) -> None:
        self._begins(1, host, topic)
        self._note("advertises", host, self._name(topic))

    def stops(self, host: int) -> None:
        """Nothing of ``host`` is left, what it believed included."""
        for ends in self._ends.values():
            for side in ends:
                side.pop(host, None)
        self.true = {match: None for match in self.true if host not in match[:2]}
        self.believed = {belief: None for belief in self.believed if belief[0] != host}
        self.seen = {pair: state for pair, state in self.seen.items() if pair[0] != host}

    def _begins(self, side: int, host: int, topic: str) -> None:
        ends = self._ends.setdefault((self._domains[host], topic), ({}, {}))
        ends[side][host] = None
        learns = side == self._informed
        self.true |= {(host, other, topic) if learns else (other, host, topic): None
                      for other in ends[1 - side] if other != host}

    # Beliefs.

    def knows(self, believer: int, other: int, topic: str, holds: bool) -> None:
        belief = believer, other, topic
        if holds == (belief in self.believed):
            return
        if holds:
            self.believed[belief] = None
        else:
            del self.believed[belief]
        self._note("believes", believer, self._ids[other], self._name(topic), int(holds))

    def sees(self, believer: int, other: int, state: HostState) -> None:
        if self.seen.get((believer, other)) == state:
            return
        self.seen[believer, other] = state
        self._note("sees", believer, self._ids[other], self._name(state))
        for watcher in self.watchers:
            watcher(believer, other, state)

"""The exchange of a pose graph with the team: one's own news out, those of teammates in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from desim.ports.localization import LocalizationContext
from desim.ports.sharing import SharedMessage
from desim.robot.localization.graph_news import GraphNews, GraphNode, WantedNews
from desim.robot.slam.fleet_graph import Closure, Encounter, FleetGraph
from desim.robot.slam.strangers import Strangers

_MOST = 100  # nodes in a message: 80 kB of 180 beams


@dataclass
class _Heard:
    """The nodes that a teammate has sent in this ``session`` of its, the number of its ties, and
    those that wait for nodes of others."""

    session: int
    nodes: list[GraphNode]
    ties: int
    waiting: list[Closure | Encounter]


class GraphExchange:
    """Sends what is new of ``fleet`` about the robot itself, and takes in what teammates send. What
    was lost is asked for, and sent again. The nodes of ``strangers`` wait there."""

    def __init__(self, fleet: FleetGraph) -> None:
        self._fleet = fleet
        self.strangers: Strangers | None = None
        self.nodes: list[GraphNode] = []  # one's own
        self.ties: list[Closure | Encounter] = []
        self._next = self._next_tie = 0  # the first ones that the next message has
        self._session = 0
        self._heard: dict[str, _Heard] = {}

    def start(self, context: LocalizationContext) -> None:
        """Send and listen from now on."""
        self._session = context.now_ns
        context.listen(self._on_message)

    def tie(self, context: LocalizationContext, tie: Closure | Encounter) -> None:
        """Add a tie of one's own to the graph, and to the next message."""
        self._add(context.name, tie)
        self.ties.append(tie)

    def introduce(self, context: LocalizationContext, closures: list[Closure]) -> None:
        """Take the stranger of these closures of one's own into the graph."""
        for closure in closures:
            context.closed(closure.source, closure.theirs, closure.own, closure.motion)
            self.ties.append(closure)
            self._settle(context.name, closure)
        self._settle_waiting()

    def send(self, context: LocalizationContext) -> None:
        """Send what is new."""
        nodes = tuple(self.nodes[self._next:self._next + _MOST])
        ties = tuple(self.ties[self._next_tie:])
        if nodes or ties:
            context.publish(GraphNews(self._session, self._next, nodes, self._next_tie, ties))
            self._next += len(nodes)
            self._next_tie += len(ties)

    def _on_message(self, context: LocalizationContext, message: SharedMessage) -> None:
        source, said = message.source, message.content
        if isinstance(said, WantedNews):
            if (said.source, said.session) == (context.name, self._session):
                self._next = min(self._next, said.first)
                self._next_tie = min(self._next_tie, said.first_tie)
            return
        heard = self._heard.setdefault(source, _Heard(said.session, [], 0, []))
        if said.session != heard.session:
            return  # it has restarted, and does not know where it is
        if said.first > len(heard.nodes) or said.first_tie > heard.ties:
            context.publish(WantedNews(source, said.session, len(heard.nodes), heard.ties))
            return
        is_strange = self.strangers is not None and source not in self._fleet.tracks
        fleet = self.strangers.fleet if self.strangers is not None and is_strange else self._fleet
        for node in said.nodes[len(heard.nodes) - said.first:]:
            fleet.add(source, *node)
            heard.nodes.append(node)
        fresh = said.ties[heard.ties - said.first_tie:]
        heard.ties += len(fresh)
        heard.waiting += fresh
        self._settle_waiting()

    def _settle_waiting(self) -> None:
        """Add the ties whose nodes have come. One that a stranger is introduced by may let others
        follow."""
        known = -1
        while known != len(self._fleet.tracks):
            known = len(self._fleet.tracks)
            for name, other in self._heard.items():
                other.waiting = [tie for tie in other.waiting if not self._settle(name, tie)]

    def _settle(self, name: str, tie: Closure | Encounter) -> bool:
        """Add a tie of ``name``, if it is known what it is about."""
        theirs = tie.theirs + isinstance(tie, Encounter)  # the way to the next node
        if isinstance(tie, Closure) and self.strangers is not None:
            for stranger, frame in self.strangers.introduced(self._fleet, name, tie):
                self._enter(stranger, frame)
        if not (self._fleet.knows(tie.source, theirs) and self._fleet.knows(name, tie.own)):
            return False
        self._add(name, tie)
        return True

    def _enter(self, stranger: str, frame: np.ndarray) -> None:
        """Enter the path of a stranger in the graph; ``frame`` [3]: the pose of its first node."""
        first, *others = self._heard[stranger].nodes
        self._fleet.add(stranger, *first._replace(motion=frame), anchored=False)
        for node in others:
            self._fleet.add(stranger, *node)

    def _add(self, name: str, tie: Closure | Encounter) -> None:
        if isinstance(tie, Closure):
            self._fleet.close(name, tie)
        else:
            self._fleet.meet(name, tie)

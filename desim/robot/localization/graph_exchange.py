"""The exchange of a pose graph with the team: one's own news out, those of teammates in."""

from __future__ import annotations

from dataclasses import dataclass

from desim.ports.localization import LocalizationContext
from desim.ports.sharing import SharedMessage
from desim.robot.localization.graph_news import GraphNews, GraphNode, WantedNews
from desim.robot.slam.fleet_graph import Closure, Encounter, FleetGraph

_MOST = 100  # nodes in a message: 80 kB of 180 beams


@dataclass
class _Heard:
    """The numbers of nodes and ties that a teammate has sent in this ``session`` of its, and the
    ties that wait for nodes of others."""

    session: int
    nodes: int
    ties: int
    waiting: list[Closure | Encounter]


class GraphExchange:
    """Sends what is new of ``fleet`` about the robot itself, and takes in what teammates send. What
    was lost is asked for, and sent again."""

    def __init__(self, fleet: FleetGraph) -> None:
        self._fleet = fleet
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
        heard = self._heard.setdefault(source, _Heard(said.session, 0, 0, []))
        if said.session != heard.session:
            return  # it has restarted, and does not know where it is
        if said.first > heard.nodes or said.first_tie > heard.ties:
            context.publish(WantedNews(source, said.session, heard.nodes, heard.ties))
            return
        for node in said.nodes[heard.nodes - said.first:]:
            self._fleet.add(source, *node)
            heard.nodes += 1
        fresh = said.ties[heard.ties - said.first_tie:]
        heard.ties += len(fresh)
        heard.waiting += fresh
        for name, other in self._heard.items():
            waiting, other.waiting = other.waiting, []
            for tie in waiting:
                if self._fleet.knows(tie.source, tie.theirs) and self._fleet.knows(name, tie.own):
                    self._add(name, tie)
                else:
                    other.waiting.append(tie)

    def _add(self, name: str, tie: Closure | Encounter) -> None:
        if isinstance(tie, Closure):
            self._fleet.close(name, tie)
        else:
            self._fleet.meet(name, tie)

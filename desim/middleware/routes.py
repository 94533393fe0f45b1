"""The media that frames between two hosts take: by preference, by topic, or through other hosts.

Frames take the first medium by preference that both hosts are attached to; a topic may have media
of its own. Hosts without a common medium reach each other through hosts that forward. With link
states a sender skips interfaces that it knows to be without a carrier.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from desim.network.ways import Path, Way
from desim.ports.scope import is_topic

if TYPE_CHECKING:
    from desim.middleware.graph import Graph
    from desim.middleware.host import Host
    from desim.middleware.link_states import LinkStates
    from desim.network.carrier import AnyCarrier
    from desim.network.medium import Medium

Choice = int | None  # of media, by its number; None: all media, by preference


class TopicMedia(NamedTuple):
    """The media of the topics that ``pattern`` names (``is_topic``), in order of preference; none:
    all. ``inside``: the medium that they take within a host, by its index. ``dscp``: their mark."""

    pattern: str
    media: tuple[Medium, ...]
    inside: dict[int, Medium]
    dscp: int


class Routing:
    """The routes of ``graph``. ``link_states``: what hosts know of each other's interfaces; None:
    nobody watches carriers."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph
        self.link_states: LinkStates | None = None
        self._choices: list[TopicMedia] = []
        self._chosen: dict[str, Choice] = {}  # by topic
        self._forwards: dict[int, tuple[Medium, ...]] = {}
        self._paths: dict[tuple[int, int, Choice], tuple[Path, ...]] = {}
        self._ways: dict[tuple[int, int, Choice], Way] = {}
        self._forwarded = graph.names.id("forwarded")

    @property
    def detours(self) -> bool:
        """Whether hosts forward frames, or the ways may change."""
        return bool(self._forwards) or self.link_states is not None

    def choose(self, pattern: str, media: Sequence[Medium],
               inside: dict[int, Medium] | None = None, dscp: int = 0) -> None:
        """Topics that match ``pattern``, and no earlier one, take ``media`` only, where there are
        any; within a host they take the medium ``inside`` it, by its index. Their packets are
        marked ``dscp``."""
        self._choices.append(TopicMedia(pattern, tuple(media), inside or {}, dscp))

    def forward(self, host: str, media: Sequence[Medium]) -> None:
        """``host`` passes on frames from one of these media to another."""
        self._forwards[self._graph.host(host).index] = tuple(media)

    def unmatched(self) -> list[str]:
        """The patterns that no topic of the run has matched."""
        used = [self._choice(topic) for topic in self._graph.topics]
        return [choice.pattern for number, choice in enumerate(self._choices) if number not in used]

    def of(self, source: Host, receiver: int, topic: str = "") -> Medium | Way | None:
        """The medium or way of frames between two hosts, for messages of ``topic`` if it is given;
        None: there is none."""
        if receiver == source.index:
            return self.inside(source, topic)
        choice = self._choice(topic) if self._choices and topic else None
        if not self._forwards and self.link_states is None:
            others = self._graph.hosts[receiver].media
            for medium in source.media if choice is None else self._media(source, choice):
                if medium in others:
                    return medium
            return None
        paths = self._paths_of(choice, source.index, receiver)
        if not paths:
            return None
        if len(paths) == len(paths[0]) == 1:
            return paths[0][0][0]
        one, other = sorted((source.index, receiver))
        way = self._ways.get((one, other, choice))
        if way is None:
            way = self._ways[one, other, choice] = Way(
                partial(self._path, choice), self._record, paths[0][0][0].id)
        return way

    def frames(self, source: Host, receivers: Iterable[int], topic: str, multicast: bool
               ) -> tuple[list[tuple[Medium | Way, tuple[int, ...]]], list[int]]:
        """See ``MiddlewareContext.frames``."""
        by_medium: dict[Medium | Way, list[int]] = {}
        unrouted = []
        route = self.at_present if multicast else self.of
        for receiver in receivers:
            medium = route(source, receiver, topic)
            if medium is None:
                unrouted.append(receiver)
            else:
                by_medium.setdefault(medium, []).append(receiver)
        return [(medium, to) for medium, group in by_medium.items()
                for to in ([tuple(sorted(group))] if multicast else [(one,) for one in group])
                ], unrouted

    def inside(self, host: Host, topic: str) -> Medium | None:
        """The medium inside ``host`` that messages of ``topic`` between its nodes take; None: they
        take none."""
        choice = self._choice(topic) if self._choices else None
        return None if choice is None else self._choices[choice].inside.get(host.index)

    def at_present(self, source: Host, receiver: int, topic: str = "") -> Medium | Way | None:
        """The medium between two hosts that such frames take now; a ``Way`` where others forward
        them."""
        way = self.of(source, receiver, topic)
        if not isinstance(way, Way):
            return way
        path = self._path(self._choice(topic) if topic else None, source.index, receiver)
        return path[0][0] if len(path) == 1 else way

    def legs(self, source: int, receiver: int) -> Path:
        """The media, and the hosts at their ends, that frames without a topic take now; none if
        there is no way."""
        paths = self._paths_of(None, source, receiver)
        return self._path(None, source, receiver) if paths else ()

    # The choice of media and paths.

    def mark(self, carrier: AnyCarrier, token: object) -> int:
        """The mark of a frame: the highest of its topics'; none for what carries no message."""
        chosen = map(self._choice, carrier.topics(token))
        return max((self._choices[choice].dscp for choice in chosen if choice is not None),
                   default=0)

    def _choice(self, topic: str) -> Choice:
        if topic not in self._chosen:
            hosts = [host.name for host in self._graph.hosts]
            self._chosen[topic] = next((number for number, choice in enumerate(self._choices)
                                        if is_topic(topic, choice.pattern, hosts)), None)
        return self._chosen[topic]

    def _media(self, source: Host, choice: Choice) -> Sequence[Medium]:
        """The media of ``source``, in order of preference."""
        if choice is None or not self._choices[choice].media:
            return source.media
        return [medium for medium in self._choices[choice].media if medium in source.media]

    def _path(self, choice: Choice, source: int, receiver: int) -> Path:
        """The first path with carriers, as ``source`` knows it; if there is none, the first."""
        paths, states = self._paths_of(choice, source, receiver), self.link_states
        if states is None:
            return paths[0]
        return next((path for path in paths if states.has_carriers(source, path)), paths[0])

    def _paths_of(self, choice: Choice, source: int, receiver: int) -> tuple[Path, ...]:
        """The paths that may be taken, in order of preference."""
        key = source, receiver, choice
        if key not in self._paths:
            paths = sorted(self._search(choice, source, receiver), key=len)  # a stable sort
            self._paths[key] = tuple(paths if self.link_states is not None else paths[:1])
        return self._paths[key]

    def _search(self, choice: Choice, source: int, receiver: int) -> Iterator[Path]:
        """All paths, by preference of their media and by the order of hosts. None uses a medium
        twice."""
        hosts = self._graph.hosts
        allowed = None if choice is None else self._choices[choice].media or None
        begun: deque[tuple[Path, int, Sequence[Medium]]] = deque(
            [((), source, self._media(hosts[source], choice))])
        while begun:
            path, host, media = begun.popleft()
            for medium in media:
                if medium in (used for used, _ in path) or medium not in hosts[host].media:
                    continue
                if medium in hosts[receiver].media:
                    yield (*path, (medium, receiver))
                for other, forwards in sorted(self._forwards.items()):
                    if other not in (source, receiver, host) and medium in forwards:
                        onward = forwards if allowed is None else [
                            one for one in allowed if one in forwards]
                        begun.append(((*path, (medium, other)), other, onward))

    def _record(self, host: int, source: int, receiver: int, size_bytes: int) -> None:
        """``host`` forwards a frame."""
        graph = self._graph
        graph.trace.row(graph.kernel.now_ns, self._forwarded, graph.hosts[host].id,
                        graph.hosts[source].id, graph.hosts[receiver].id, size_bytes)

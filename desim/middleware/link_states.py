"""Link states: what hosts know of the carriers of their own and of each other's interfaces.

A host notices with a delay that an interface of its own has lost or regained its carrier, as
Linux's link monitoring does. It then announces that to all others in a short frame over its
remaining media, as routing daemons do (a triggered update, with a sequence number), and repeats the
announcement while a carrier is missing. Nobody learns of it in any other way.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from desim.engine.agenda import Call
from desim.engine.kernel import Phase
from desim.middleware.headers import LEAST_FRAME_BYTES
from desim.ports import CutsCarrier

if TYPE_CHECKING:
    from desim.middleware.graph import Graph
    from desim.network.ways import Path

LINK_STATE = "link_state"  # the kind of these frames
LINK_STATE_BYTES = LEAST_FRAME_BYTES

Interface = tuple[int, int]  # a host, and the number of a medium of the graph
LinkState = tuple[int, int, tuple[Interface, ...]]  # a host, its number, those without a carrier


class LinkStates:
    """The link states of all hosts of ``graph``. A change is noticed ``noticed_after_ns`` later; a
    missing carrier is announced at once and every ``announce_every_ns`` (None: never announced)."""

    def __init__(self, graph: Graph, noticed_after_ns: int, announce_every_ns: int | None) -> None:
        self._graph, self._kernel = graph, graph.kernel
        self._noticed_after_ns, self._announce_every_ns = noticed_after_ns, announce_every_ns
        # By host that knows it: the interfaces without a carrier.
        self._cut: list[dict[Interface, None]] = [{} for _ in graph.hosts]
        self._heard: list[dict[int, int]] = [{} for _ in graph.hosts]  # the newest number, by host
        self._announced = 0  # announcements so far
        self._calls: dict[int, Call] = {}  # the next announcement of each host
        self._rules = [[rule for rule in medium.rules if isinstance(rule, CutsCarrier)]
                       for medium in graph.media]
        self._numbers = {medium: number for number, medium in enumerate(graph.media)}
        graph.context.watchers.append(self._switched)
        for number, medium in enumerate(graph.media):
            for host in medium.attached if self._rules[number] else ():
                self._await_change((host, number))

    def has_carriers(self, source: int, path: Path) -> bool:
        """Whether each interface on ``path`` has a carrier, as ``source`` knows it."""
        cut, numbers = self._cut[source], self._numbers
        if not cut:
            return True
        for medium, host in path:
            number = numbers[medium]
            if (source, number) in cut or (host, number) in cut:
                return False
            source = host
        return True

    # The own interfaces.

    def _has_carrier(self, interface: Interface) -> bool:
        host, number = interface
        return all(rule.carrier(host)[0] for rule in self._rules[number])

    def _await_change(self, interface: Interface) -> None:
        host, number = interface
        changes = [at_ns for rule in self._rules[number]
                   if (at_ns := rule.carrier(host)[1]) is not None]
        if changes:
            self._kernel.at(min(changes), Phase.NETWORK, self._graph.hosts[host].id, self._changed,
                            interface)

    def _changed(self, interface: Interface) -> None:
        self._kernel.after(self._noticed_after_ns, Phase.NETWORK,
                           self._graph.hosts[interface[0]].id, self._notice, interface)
        self._await_change(interface)

    def _notice(self, interface: Interface) -> None:
        """A host looks at an interface of its own."""
        host, number = interface
        cut, up = self._cut[host], self._has_carrier(interface)
        if not self._graph.up[host] or up == (interface not in cut):
            return
        if up:
            del cut[interface]
        else:
            cut[interface] = None
        self._graph.context.record("carrier_back" if up else "carrier_lost", host,
                                   self._graph.media[number].id)
        self._reroute(host)
        self._announce(host)

    def _switched(self, host: int, up: bool) -> None:
        """A host that starts looks at its interfaces, and knows nothing of others."""
        self._cut[host], self._heard[host] = {}, {}
        if host in self._calls:
            self._calls.pop(host).cancel()
        for number, medium in enumerate(self._graph.media if up else ()):
            if host in medium.attached and not self._has_carrier((host, number)):
                self._cut[host][host, number] = None
        if self._cut[host]:
            self._announce(host)

    # Announcements.

    def _announce(self, host: int) -> None:
        if host in self._calls:
            self._calls.pop(host).cancel()
        if self._announce_every_ns is None:
            return
        own = tuple(interface for interface in self._cut[host] if interface[0] == host)
        others = [other.index for other in self._graph.hosts if other.index != host]
        self._announced += 1
        self._graph.context.send(LINK_STATE, host, others, LINK_STATE_BYTES, self._hear,
                                 (host, self._announced, own), multicast=True)
        if own:
            self._calls[host] = self._kernel.after(
                self._announce_every_ns, Phase.NETWORK, self._graph.hosts[host].id, self._announce,
                host)

    def _hear(self, said: LinkState, receiver: int) -> None:
        host, number, interfaces = said
        if number < self._heard[receiver].get(host, 0):
            return  # older than what is known: it came over a slower medium
        self._heard[receiver][host] = number
        before = self._cut[receiver]
        after = {one: None for one in before if one[0] != host} | dict.fromkeys(interfaces)
        if after != before:
            self._cut[receiver] = after
            self._reroute(receiver)

    def _reroute(self, host: int) -> None:
        """The publishers of ``host`` group their receivers by media anew."""
        for topic in self._graph.topics.values():
            for publisher in topic.publishers:
                if publisher.host.index == host:
                    publisher.changed()

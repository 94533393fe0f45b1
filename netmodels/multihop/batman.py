"""B.A.T.M.A.N., a routing protocol in which every host announces itself to all others.

Every host broadcasts originator messages, and passes on those of others that came over the best
route, with the quality of that route. A host knows no more of a route than its next hop. After
B.A.T.M.A.N. IV (Neumann, Aichele, Lindner, Wunderlich 2008: draft-openmesh-b-a-t-m-a-n-00; transmit
quality as in batman-adv), whose constants are the defaults. """

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

from pydantic import Field

from desim import ports
from desim.units import ByteSize, Duration, Period, Ratio
from netmodels.multihop.hops import Hops
from netmodels.multihop.routes import LinkQuality, Routes


class BatmanParams(ports.Params):
    """The messages that find routes: when they are sent, and how links and routes are judged."""

    interval_ns: Period = Field("1 s", description="between a host's own messages (batman-adv)")
    jitter_ns: Duration = Field("20 ms", description="an interval is longer or shorter by up to "
                                                     "this, and what is passed on waits for up to "
                                                     "half of it (batman-adv)")
    message_bytes: ByteSize = Field("42 B", ge=1, description="on the medium (batman-adv: 24 B, "
                                                              "and 18 B of Ethernet)")
    window: int = Field(64, ge=1, le=1024, description="messages by which a link is judged "
                                                       "(batman-adv)")
    memory: int = Field(5, ge=1, le=64, description="messages by which a way is judged "
                                                    "(batman-adv)")
    hop_penalty: Ratio = Field("11.76 %", description="what a way loses with each hop (batman-adv: "
                                                      "30 of 255)")
    purge_ns: Period = Field("200 s", description="after which an unheard host is forgotten "
                                                  "(batman-adv)")
    hops: int = Field(50, ge=1, le=255, description="that a message goes (batman-adv)")


class OriginatorMessage(NamedTuple):
    """An originator's message as it is on the air. ``quality`` of the route so far, 0 to 1; 0: only
    an echo, by which a neighbour learns that it is heard. ``previous``: the host that the sender
    has it from (the originator itself: the originator)."""

    originator: int
    number: int
    quality: float
    previous: int
    hops_left: int


class BatmanNode:
    """The state of one host: its neighbours, and the routes to each originator."""

    def __init__(self, draw: Callable[[], float]) -> None:
        self.number = 0  # of its own last message
        self.draw = draw  # its own random numbers
        self.forget()

    def forget(self) -> None:
        """Lose everything but the number of the last message: the host has stopped."""
        self.neighbours: dict[int, LinkQuality] = {}
        self.routes: dict[int, Routes] = {}


class Batman:
    """Routes by originator messages, which are broadcast frames on the air like all others.

    A link's quality: the share of this host's own messages that come back from the neighbour as
    echoes, divided by the share of the neighbour's that arrive, over the last ``window`` ones; less
    where few arrive (batman-adv's asymmetry penalty, here of those that were sent since the
    neighbour was heard first, so that a new link is not taken for a bad one). A route's quality
    through a neighbour: that of its messages times the link's, mean of the last ``memory`` numbers
    before the newest, where those not heard count 0. The next hop is the neighbour with the best
    route; a better one replaces it, an equal one does not. So a broken route is left as soon as
    more is heard over another one.
    batman-adv's aggregation of messages and its 10 B of header on routed frames are left out.

    ``frames`` and ``bytes`` count what was sent. A host that stops forgets all but its number.
    """

    def __init__(self, params: BatmanParams) -> None:
        self._params = params
        self.frames = self.bytes = 0

    def start(self, hops: Hops, hosts: tuple[str, ...]) -> None:
        self._hops = hops
        self._nodes = [BatmanNode(hops.stream("batman", host).random) for host in hosts]
        if len(hosts) > 1:
            for host, node in enumerate(self._nodes):
                hops.at(hops.now_ns + int(node.draw() * self._params.interval_ns),
                        self._originate, host)

    def next_hop(self, host: int, dest: int) -> int | None:
        """The host to which ``host`` gives a frame for ``dest``, as far as it has heard."""
        routes = self._nodes[host].routes.get(dest)
        if routes is None or self._hops.now_ns - routes.heard_ns > self._params.purge_ns:
            return None
        return routes.best

    def switched(self, host: int, up: bool) -> None:
        self._nodes[host].forget()

    def _originate(self, host: int) -> None:
        params, node, hops = self._params, self._nodes[host], self._hops
        jitter_ns = params.jitter_ns
        hops.at(hops.now_ns + max(1, params.interval_ns - jitter_ns
                                  + int(node.draw() * 2 * jitter_ns)), self._originate, host)
        if hops.up[host]:
            node.number += 1
            self._broadcast(host, OriginatorMessage(host, node.number, 1.0, host, params.hops))

    def _broadcast(self, host: int, message: OriginatorMessage) -> None:
        size_bytes = self._params.message_bytes
        self.frames += 1
        self.bytes += size_bytes
        self._hops.send(host, self._hops.others[host], size_bytes, 1, True,
                        partial(self._settled, message))

    def _settled(self, message: OriginatorMessage, frame: ports.Frame, receivers: Sequence[int],
                 verdict: ports.Deliver | ports.Drop, lost: dict[int, str]) -> None:
        if isinstance(verdict, ports.Drop) and verdict.reason in self._hops.refuses:
            self.frames -= 1
            self.bytes -= frame.size_bytes
        elif isinstance(verdict, ports.Deliver):
            heard = frame.source, receivers, message
            if verdict.delay_ns:
                self._hops.at(self._hops.now_ns + verdict.delay_ns, self._heard, heard)
            else:
                self._heard(heard)

    def _heard(self, heard: tuple[int, Sequence[int], OriginatorMessage]) -> None:
        sender, receivers, message = heard
        up = self._hops.up
        for host in receivers:
            if up[host]:
                self._hear(host, sender, message)

    def _hear(self, host: int, sender: int, message: OriginatorMessage) -> None:
        params, node = self._params, self._nodes[host]
        originator, number, quality, previous, hops_left = message
        neighbour = node.neighbours.get(sender)
        if neighbour is None:
            neighbour = node.neighbours[sender] = LinkQuality(params.window)
        if originator == host:
            if previous == host:
                neighbour.echoed(number)
            return
        if previous == host:
            return
        if sender == originator:
            neighbour.heard(number)
        best = None
        if quality:
            routes = node.routes.get(originator)
            if routes is None:
                routes = node.routes[originator] = Routes(params.memory)
            quality *= neighbour.quality(node.number)
            if quality and routes.hear(sender, number, quality, self._hops.now_ns):
                best = routes
        if hops_left > 1:
            if best is not None and best.passed_on < number:
                best.passed_on = number
                passed = best.quality(sender) * (1 - params.hop_penalty)
            elif sender == originator:
                passed = 0.0
            else:
                return
            hops = self._hops
            wait_ns = int(node.draw() * (params.jitter_ns // 2))
            hops.at(hops.now_ns + wait_ns, self._pass_on,
                    (host, OriginatorMessage(originator, number, passed, sender, hops_left - 1)))

    def _pass_on(self, passed: tuple[int, OriginatorMessage]) -> None:
        host, message = passed
        if self._hops.up[host]:
            self._broadcast(host, message)

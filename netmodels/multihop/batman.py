"""B.A.T.M.A.N., a routing protocol in which every host announces itself to all others.

Every host broadcasts originator messages, and passes on those of others that came over the best
route, with the quality of that route. A host knows no more of a route than its next hop. After
B.A.T.M.A.N. IV (Neumann, Aichele, Lindner, Wunderlich 2008: draft-openmesh-b-a-t-m-a-n-00; transmit
quality and bundles as in batman-adv), whose constants are the defaults. """

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

from pydantic import Field

from desim import ports
from desim.units import ByteSize, Duration, Period, Ratio
from netmodels.hops import Hops
from netmodels.multihop.routes import LinkQuality, Routes

HEADER_BYTES = 14 + 4  # of a frame: Ethernet, and its check sequence


class BatmanConstants(ports.Constants):
    """The messages that find routes: when they are sent, and how links and routes are judged."""

    interval_ns: Period = Field("1 s", description="between a host's own messages (batman-adv)")
    jitter_ns: Duration = Field("20 ms", description="an interval is longer or shorter by up to "
                                                     "this, and what is passed on waits for up to "
                                                     "half of it (batman-adv)")
    message_bytes: ByteSize = Field("24 B", ge=1, description="of a message; a frame has 18 B of "
                                                              "Ethernet, too (batman-adv)")
    bundle_bytes: ByteSize = Field("512 B", description="of messages in one frame at most "
                                                        "(batman-adv: MAX_AGGREGATION_BYTES)")
    wait_ns: Duration = Field("100 ms", description=(
        "for which what is passed on waits for more to share its frame; 0 s: each message leaves "
        "alone (batman-adv: MAX_AGGREGATION_MS)"))
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


class Bundle:
    """Messages of a host that leave in one frame at ``leaves_ns``, ``most`` of them."""

    def __init__(self, leaves_ns: int, message: OriginatorMessage, most: int) -> None:
        self.leaves_ns, self.messages, self._most = leaves_ns, [message], most

    def takes(self, due_ns: int, wait_ns: int) -> bool:
        """Whether it has room for a message that is due before, and waits so long at most
        (``batadv_iv_ogm_can_aggregate``)."""
        return (due_ns < self.leaves_ns <= due_ns + wait_ns
                and len(self.messages) < self._most)


class BatmanNode:
    """The state of one host: its neighbours, the routes to each originator, and what is to leave,
    the last booked first."""

    def __init__(self, draw: Callable[[], float]) -> None:
        self.number = 0  # of its own last message
        self.draw = draw  # its own random numbers
        self.bundles: list[Bundle] = []
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

    What is passed on joins a frame that leaves within ``wait`` after it is due, be it the
    host's own; if there is none, it waits so long for others (``batadv_iv_ogm_queue_add``). What
    comes straight from its originator leaves alone: batman-adv marks it (DIRECTLINK), and bundles
    nothing marked. Its 10 B of header on routed frames are left out.

    ``frames`` and ``bytes`` count what was sent. A host that stops forgets all but its number.
    """

    def __init__(self, params: BatmanConstants) -> None:
        self._params = params
        self._most = params.bundle_bytes // params.message_bytes
        self.frames = self.bytes = 0

    def start(self, hops: Hops, hosts: tuple[str, ...]) -> None:
        self._hops = hops
        self._nodes = [BatmanNode(hops.stream("batman", host).random) for host in hosts]
        if len(hosts) > 1:
            for host, node in enumerate(self._nodes):
                self._plan(host, hops.now_ns + int(node.draw() * self._params.interval_ns))

    def next_hop(self, host: int, dest: int) -> int | None:
        """The host to which ``host`` gives a frame for ``dest``, as far as it has heard."""
        routes = self._nodes[host].routes.get(dest)
        if routes is None or self._hops.now_ns - routes.heard_ns > self._params.purge_ns:
            return None
        return routes.best

    def switched(self, host: int, up: bool) -> None:
        self._nodes[host].forget()

    def _plan(self, host: int, leaves_ns: int) -> None:
        """Book a host's own next message."""
        number = self._nodes[host].number + 1
        self._book(host, Bundle(leaves_ns, OriginatorMessage(host, number, 1.0, host,
                                                             self._params.hops), self._most))

    def _book(self, host: int, bundle: Bundle) -> None:
        self._nodes[host].bundles.insert(0, bundle)
        self._hops.at(bundle.leaves_ns, self._leave, (host, bundle))

    def _leave(self, leaving: tuple[int, Bundle]) -> None:
        host, bundle = leaving
        params, node, hops = self._params, self._nodes[host], self._hops
        node.bundles.remove(bundle)
        own, up = bundle.messages[0].originator == host, hops.up[host]
        if up:
            node.number += own
            self._broadcast(host, bundle.messages)
        if own:
            self._plan(host, hops.now_ns + max(1, params.interval_ns - params.jitter_ns
                                               + int(node.draw() * 2 * params.jitter_ns)))

    def _pass_on(self, host: int, message: OriginatorMessage, direct: bool) -> None:
        """Send a message within half of the jitter, or in a later bundle."""
        params, node = self._params, self._nodes[host]
        due_ns = self._hops.now_ns + int(node.draw() * (params.jitter_ns // 2))
        for bundle in () if direct else node.bundles:
            if bundle.takes(due_ns, params.wait_ns):
                bundle.messages.append(message)
                return
        self._book(host, Bundle(due_ns + params.wait_ns, message, 1 if direct else self._most))

    def _broadcast(self, host: int, messages: Sequence[OriginatorMessage]) -> None:
        size_bytes = HEADER_BYTES + len(messages) * self._params.message_bytes
        self.frames += 1
        self.bytes += size_bytes
        self._hops.send(host, self._hops.others[host], size_bytes, 1, True,
                        partial(self._settled, messages))

    def _settled(self, messages: Sequence[OriginatorMessage], frame: ports.Frame,
                 receivers: Sequence[int], verdict: ports.Deliver | ports.Drop,
                 lost: dict[int, str]) -> None:
        if isinstance(verdict, ports.Drop) and verdict.reason in self._hops.refuses:
            self.frames -= 1
            self.bytes -= frame.size_bytes
        elif isinstance(verdict, ports.Deliver) and not lost:
            heard = frame.source, receivers, messages
            if verdict.delay_ns:
                self._hops.at(self._hops.now_ns + verdict.delay_ns, self._heard, heard)
            else:
                self._heard(heard)

    def _heard(self, heard: tuple[int, Sequence[int], Sequence[OriginatorMessage]]) -> None:
        sender, receivers, messages = heard
        up = self._hops.up
        for host in receivers:
            if up[host]:
                for message in messages:
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
            self._pass_on(host, OriginatorMessage(originator, number, passed, sender,
                                                  hops_left - 1), sender == originator)

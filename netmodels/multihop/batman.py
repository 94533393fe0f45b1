"""A protocol that finds routes by letting everybody hear from everybody: B.A.T.M.A.N.

Every host broadcasts originator messages, and those of others that came on the best way are passed
on with the quality of that way; nobody knows more of a way than its next hop. After B.A.T.M.A.N. IV
(Neumann, Aichele, Lindner, Wunderlich 2008: draft-openmesh-b-a-t-m-a-n-00; transmit quality as in
batman-adv), whose constants are the defaults.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from pydantic import Field

from desim import ports
from desim.units import ByteSize, Duration, Period, Ratio
from netmodels.multihop.hops import Hops
from netmodels.multihop.routes import LinkQuality, Routes


class BatmanParams(ports.Params):
    """When and what is said on the air to find routes."""

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
    """An originator's message as it is on the air. ``quality`` of the way so far, 0 to 1; 0 where
    it is an echo only, by which a neighbour learns that it is heard. ``previous``: from whom the
    sender has it (the originator itself: the originator)."""

    originator: int
    number: int
    quality: float
    previous: int
    hops_left: int


class BatmanNode:
    """What one host has heard: its neighbours, and the ways to each originator."""

    __slots__ = ("number", "neighbours", "ways", "draw")

    def __init__(self, draw: Callable[[], float]) -> None:
        self.number = 0  # of its own last message
        self.draw = draw  # its own luck
        self.forget()

    def forget(self) -> None:
        self.neighbours: dict[int, LinkQuality] = {}
        self.ways: dict[int, Routes] = {}


class Batman:
    """Routes by originator messages, which are broadcast frames on the air like all others.

    A link's quality: the share of this host's own messages that come back from the neighbour as
    echoes, to the share of the neighbour's that arrive, over the last ``window`` ones; less where
    few arrive (batman-adv's asymmetry penalty, here of those that were sent since the neighbour was
    heard first, so that a new link is not taken for a bad one). A way's quality through a
    neighbour: that of its messages times the link's, mean of the last ``memory`` numbers before the
    newest, those not heard counting 0. The next hop is the neighbour with the best way; a better
    one replaces it, an equal one does not. So a broken route is left as soon as another one is
    heard more of.
    batman-adv's aggregation of messages and its 10 B of header on routed frames are left out.

    ``frames`` and ``bytes`` count what was sent. A host that stops forgets all but its number.
    """

    def __init__(self, params: BatmanParams) -> None:
        self._params = params
        self.frames = self.bytes = 0

    def start(self, hops: Hops, hosts: tuple[str, ...]) -> None:
        self._hops = hops
        self._others = [tuple(other for other in range(len(hosts)) if other != host)
                        for host in range(len(hosts))]
        self._routers = [BatmanNode(hops.stream("batman", host).random) for host in hosts]
        if len(hosts) > 1:
            for host, router in enumerate(self._routers):
                hops.at(hops.now_ns + int(router.draw() * self._params.interval_ns),
                        self._originate, host)

    def next_hop(self, host: int, dest: int) -> int | None:
        """Whom ``host`` gives a frame for ``dest``, as far as it has heard."""
        ways = self._routers[host].ways.get(dest)
        if ways is None or self._hops.now_ns - ways.heard_ns > self._params.purge_ns:
            return None
        return ways.best

    def switched(self, host: int, up: bool) -> None:
        self._routers[host].forget()

    def _originate(self, host: int) -> None:
        params, router, hops = self._params, self._routers[host], self._hops
        jitter_ns = params.jitter_ns
        hops.at(hops.now_ns + max(1, params.interval_ns - jitter_ns
                                  + int(router.draw() * 2 * jitter_ns)), self._originate, host)
        if hops.up[host]:
            router.number += 1
            self._say(host, OriginatorMessage(host, router.number, 1.0, host, params.hops))

    def _say(self, host: int, message: OriginatorMessage) -> None:
        size_bytes = self._params.message_bytes
        self.frames += 1
        self.bytes += size_bytes
        self._hops.send(host, self._others[host], size_bytes, 1, True, self._told, message)

    def _told(self, message: OriginatorMessage, frame: ports.Frame, receivers: Sequence[int],
              verdict: ports.Deliver | ports.Drop, lost: dict[int, str]) -> None:
        if type(verdict) is ports.Drop and verdict.reason in self._hops.refuses:
            self.frames -= 1
            self.bytes -= frame.size_bytes
        elif type(verdict) is ports.Deliver:
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
        params, router = self._params, self._routers[host]
        originator, number, quality, previous, hops_left = message
        neighbour = router.neighbours.get(sender)
        if neighbour is None:
            neighbour = router.neighbours[sender] = LinkQuality(params.window)
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
            ways = router.ways.get(originator)
            if ways is None:
                ways = router.ways[originator] = Routes(params.memory)
            quality *= neighbour.quality(router.number)
            if quality and ways.hear(sender, number, quality, self._hops.now_ns):
                best = ways
        if hops_left > 1:
            if best is not None and best.passed_on < number:
                best.passed_on = number
                passed = best.quality(sender) * (1 - params.hop_penalty)
            elif sender == originator:
                passed = 0.0
            else:
                return
            hops = self._hops
            wait_ns = int(router.draw() * (params.jitter_ns // 2))
            hops.at(hops.now_ns + wait_ns, self._pass_on,
                    (host, OriginatorMessage(originator, number, passed, sender, hops_left - 1)))

    def _pass_on(self, passed: tuple[int, OriginatorMessage]) -> None:
        host, message = passed
        if self._hops.up[host]:
            self._say(host, message)

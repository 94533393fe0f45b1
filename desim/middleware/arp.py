"""ARP: hosts find and lose the addresses of others on their subnet.

States and times are those of Linux (net/core/neighbour.c, net/ipv4/arp.c).
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, NamedTuple

from desim.engine.kernel import Phase, pair
from desim.middleware.headers import LEAST_FRAME_BYTES
from desim.middleware.jiffies import fires_ns
from desim.network.carrier import AnyCarrier, Carrier, T_contra
from desim.ports import TimePart

if TYPE_CHECKING:
    from desim.network.passages import Passages
    from desim.ports.middleware import MiddlewareContext, Route
    from desim.ports.networks import Handle

_S = 10**9  # ns
ARP_BYTES = LEAST_FRAME_BYTES  # with 28 B in it
REACHABLE_NS = 30 * _S  # base_reachable_time; each host draws 0.5 to 1.5 times it
REDRAW_NS = 300 * _S  # ... anew so often (neigh_periodic_work)
DELAY_NS = 5 * _S  # delay_first_probe_time
RETRANS_NS = _S  # retrans_time
PROBES = 3  # ucast_solicit, and mcast_solicit
QUEUE_BYTES = 212_992  # unres_qlen_bytes
MOST_UP_NS = 3600 * _S  # ours: long beside all timers

# States (Linux's NUD_...). The address is unknown: nobody has asked, asked by broadcast, no answer.
# It is known: but old, old and in use (asked soon), asked by unicast, confirmed.
NONE, INCOMPLETE, FAILED, STALE, DELAY, PROBE, REACHABLE = range(7)
QUESTION, ANSWER = range(2)


class WaitingFrame(NamedTuple):
    """A frame that waits for an address since ``since_ns``, as ``transmit`` takes it."""

    since_ns: int
    source: int
    receivers: tuple[int, ...]
    size_bytes: int
    segments: int
    broadcast: bool
    carrier: AnyCarrier
    token: object


class Neighbours:
    """The ARP tables of all hosts, which TCP and the carriers of datagrams share."""

    def __init__(self, context: MiddlewareContext, tick_ns: int,
                 passages: Passages | None = None) -> None:
        self.context = context
        self.tick_ns = tick_ns
        self.passages = passages  # None: no ledger is kept
        self._known: dict[tuple[Route, int, int], Neighbour] = {}
        self._up_ns: dict[int, int] = {}  # by host
        self._reachable: dict[tuple[int, int], int] = {}  # ns, by host and how often it was drawn

    def of(self, medium: Route, host: int, peer: int) -> Neighbour:
        """The ARP entry of ``peer`` at ``host``, made on first use."""
        known = self._known.get((medium, host, peer))
        if known is None:
            ids = self.context.host_ids
            known = self._known[medium, host, peer] = Neighbour(
                self, medium, host, peer, pair(ids[host], ids[peer]))
        return known

    def forget(self, host: int) -> None:
        """``host`` has stopped: its entries are gone."""
        for (_, owner, _), neighbour in self._known.items():
            if owner == host:
                neighbour.forget("host_down")

    def lose_carrier(self, medium: Route, host: int) -> None:
        """``host`` hangs on no access point of ``medium``: its entries there are gone (Linux
        ``arp_evict_nocarrier``, on by default since 5.16), but for those over a ``Way``."""
        for (over, owner, _), neighbour in self._known.items():
            if owner == host and over is medium:
                neighbour.forget("not_associated")

    def up_ns(self, host: int) -> int:
        """For how long ``host`` had been up when the simulation began, drawn by its name: its
        timers tick by that clock. (Of hosts that tick as one, questions that collided once on a
        radio would collide for ever.)"""
        if host not in self._up_ns:
            stream = self.context.stream("arp", self.context.hosts[host], "up")
            self._up_ns[host] = int(stream.integers(MOST_UP_NS))
        return self._up_ns[host]

    def reachable_ns(self, host: int) -> int:
        """For how long ``host`` trusts an address that was confirmed: 0.5 to 1.5 times the base,
        drawn anew now and then (Linux neigh_rand_reach_time)."""
        context = self.context
        drawn = host, context.now_ns // REDRAW_NS
        if drawn not in self._reachable:
            stream = context.stream("arp", context.hosts[host], drawn[1])
            self._reachable[drawn] = REACHABLE_NS // 2 + int(stream.integers(REACHABLE_NS))
        return self._reachable[drawn]


class Neighbour(Carrier[int]):
    """One host's ARP entry for another host. All frames to that host go through ``transmit``. While
    the address is being resolved they wait; if nobody answers they are lost, and each carrier is
    notified (``unresolved``). TCP sets ``confirmed_ns`` when an acknowledgement arrives. A peer's
    question also confirms its address here."""

    protocol = "arp"
    __slots__ = ("confirmed_ns", "used_ns", "_state", "_queue", "_probes", "_call", "_tables",
                 "_medium", "_transmit", "_host", "_peer", "_entity", "_kernel", "_tick_ns",
                 "_up_ns")

    def __init__(self, tables: Neighbours, medium: Route, host: int, peer: int, entity: int
                 ) -> None:
        self.confirmed_ns = self.used_ns = -DELAY_NS - REACHABLE_NS
        self._state = NONE
        self._queue: deque[WaitingFrame] = deque()
        self._probes = 0
        self._call: Handle | None = None
        self._tables = tables
        self._medium, self._transmit = medium, medium.transmit
        self._host, self._peer = host, peer
        self._entity = entity
        self._kernel = tables.context.kernel
        self._tick_ns, self._up_ns = tables.tick_ns, tables.up_ns(host)

    def transmit(self, source: int, receivers: tuple[int, ...], size_bytes: int, segments: int,
                 broadcast: bool, carrier: Carrier[T_contra],
                 token: T_contra) -> int | None:
        """As ``Medium.transmit``. (``*frame`` would cost a thousand instructions more.)"""
        if self._state <= STALE:
            if self._state < STALE:
                self._hold(WaitingFrame(self._kernel.now_ns, source, receivers, size_bytes,
                                        segments, broadcast, carrier, token))
                return None
            self._state = DELAY
            self._set_timer(DELAY_NS)
        self.used_ns = self._kernel.now_ns
        transmit = self._transmit
        return transmit(source, receivers, size_bytes, segments, broadcast, carrier, token)

    def forget(self, reason: str) -> None:
        """The address is forgotten, and what waits for it is lost for this ``reason``."""
        self._state = NONE
        self._cancel_timer()
        self._lose(reason)

    # The carrier of questions and answers: nobody learns of a lost one.

    def arrived(self, what: int, receiver: int) -> None:
        if what == QUESTION:
            self._tables.of(self._medium, self._peer, self._host).answer_question()
        else:
            self._tables.of(self._medium, self._peer, self._host).found(REACHABLE)

    def answer_question(self) -> None:
        """The peer asks for this host's address, and its question holds its own."""
        if self._state < STALE:
            self.found(STALE)
        self._send(ANSWER)

    def found(self, state: int) -> None:
        """The address of the peer is known: send the frames that waited."""
        self._cancel_timer()
        self._state = state
        if state == REACHABLE:
            self.confirmed_ns = self._kernel.now_ns
            self._set_timer(self._tables.reachable_ns(self._host))
        queue, self._queue = self._queue, deque()
        for frame in queue:
            if self._tables.passages is not None:
                self._tables.passages.waited(TimePart.RESOLUTION, frame.since_ns)
            self.transmit(*frame[1:])

    # Timers.

    def _expired(self, _: object) -> None:
        """Linux neigh_timer_handler."""
        self._call = None
        now_ns, state = self._kernel.now_ns, self._state
        if state == REACHABLE:
            late_ns = now_ns - self.confirmed_ns - self._tables.reachable_ns(self._host)
            if late_ns < 0:
                self._set_timer(-late_ns)
            elif now_ns <= self.used_ns + DELAY_NS:
                self._state = DELAY
                self._set_timer(DELAY_NS)
            else:
                self._state = STALE
        elif state == DELAY and now_ns <= self.confirmed_ns + DELAY_NS:
            self._state = REACHABLE
            self._set_timer(self._tables.reachable_ns(self._host))
        elif state == DELAY:
            self._ask(PROBE)
        elif self._probes < PROBES:
            self._ask(state)
        else:
            self._state = FAILED
            self._lose("no_neighbour")

    def _hold(self, frame: WaitingFrame) -> None:
        """Queue a frame until the address is known; drop the oldest above QUEUE_BYTES."""
        queue = self._queue
        queue.append(frame)
        if self._tables.passages is not None:
            frame.carrier.first_sent(frame.token, frame.since_ns)
        while sum(waiting.size_bytes for waiting in queue) > QUEUE_BYTES and len(queue) > 1:
            oldest = queue.popleft()
            oldest.carrier.lost(oldest.token, self._peer, "no_neighbour")
        if self._state != INCOMPLETE:
            self._ask(INCOMPLETE)

    def _ask(self, state: int) -> None:
        """Ask for the address, by broadcast if it is unknown. (Only the peer receives the question;
        for all others it is a short frame on the air.)"""
        if state != self._state:
            self._state = state
            self._probes = 0
        self._probes += 1
        self._set_timer(RETRANS_NS)
        self._send(QUESTION)

    def _send(self, what: int) -> None:
        context = self._tables.context
        broadcast = what == QUESTION and self._state == INCOMPLETE
        context.record_control("arp", self._host, context.host_ids[self._peer], ARP_BYTES)
        self._transmit(self._host, (self._peer,), ARP_BYTES, 1, broadcast, self, what)

    def _lose(self, reason: str) -> None:
        queue, self._queue = self._queue, deque()
        for frame in queue:
            frame.carrier.lost(frame.token, self._peer, reason)
            if reason == "no_neighbour":
                frame.carrier.unresolved(frame.token)

    def _set_timer(self, delay_ns: int) -> None:
        self._cancel_timer()
        up_ns = self._up_ns
        fires = fires_ns(self._kernel.now_ns + up_ns, delay_ns, self._tick_ns) - up_ns
        self._call = self._kernel.at(fires, Phase.NETWORK, self._entity, self._expired)

    def _cancel_timer(self) -> None:
        if self._call is not None:
            self._call.cancel()
            self._call = None

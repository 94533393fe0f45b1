"""One medium: its rules, its network model, and the account of all frames.

It asks its rules about each frame, hands it to its network model, and keeps the account of its fate
at each intended receiver. It needs a ``Kernel`` and names, not a ``Graph``: a plain SimPy program
can send over it, too.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Sequence
from functools import partial
from operator import attrgetter
from typing import TypeVar

import numpy as np

from desim import ports
from desim.engine.agenda import Call
from desim.engine.kernel import Kernel, Phase
from desim.engine.streams import Streams
from desim.engine.trace import Names
from desim.errors import KernelError, ModelError, below, class_of
from desim.network.account import Account
from desim.network.answer_checks import arrival_of, check_packets, reason_of, unexpected
from desim.network.broadcast import Broadcast
from desim.network.carrier import AnyCarrier, Carrier, Carriers
from desim.network.departures import Departures
from desim.network.flights import Flights
from desim.network.gate import Gate, MediumView
from desim.network.held_frames import HeldFrames
from desim.network.marks import Mark, marks
from desim.network.surroundings import Nowhere, Reachability, Surroundings
from desim.network.terms import PLAIN, RECEIVER, TERMS, Claim, Terms
from desim.ports import Deliver, Drop, Frame, NetworkModel, packet_sizes

T = TypeVar("T")

_NETWORK = Phase.NETWORK  # cheaper than to look it up each time
_new = tuple.__new__  # a Frame at half the price


def none_of(frames: ports.Frames) -> Sequence[int | None]:
    """The ``send_many`` of a model without one: it takes none."""
    return ()


class Medium(Account):
    """A network model with the rules in front of it. It is the model's ``ports.Context``.

    ``rules`` may be plain functions (``ports.RuleFunction``). ``hosts`` are all host names in index
    order, ``attached`` the indices of those that have an interface to it. ``mark``: of frames
    (None: all are 0). The account is that of its frames (``Account``, whose ``own`` it takes).

    A frame is open until its model has settled it, then on its way until delivered."""

    __slots__ = ("name", "id", "model", "rules", "flights", "hosts", "attached", "frames",
                 "positions", "shared", "judge_transmission", "refuses", "_kernel", "_after",
                 "_send", "_begin", "_streams", "_place", "_open", "_broadcasts", "_awaited",
                 "_reasons", "_hosts", "_control", "_reachability", "_admit", "_passes",
                 "_all_pass", "_send_many", "departures", "left", "held", "dscp")

    Flights, HeldFrames = Flights, HeldFrames

    def __init__(self, name: str, model: NetworkModel,
                 rules: Sequence[ports.Rule | ports.RuleFunction] = (), *, kernel: Kernel,
                 names: Names, streams: Streams, hosts: Sequence[str], own: int | None = None,
                 place: Surroundings | None = None, mark: Mark | None = None) -> None:
        super().__init__(len(hosts), own)
        self.name, self.id = name, names.id(f"medium/{name}")
        self.model = model
        self.rules = tuple(map(ports.rule_of, rules))
        self.on_refusal = [rule.refused for rule in self.rules if isinstance(rule, ports.TakesBack)]
        self.hosts = tuple(hosts)
        self.attached: Sequence[int] = range(len(hosts))
        self.frames = 0
        self._kernel, self._streams = kernel, streams
        self._after, self.shared = kernel.after, kernel.shared
        self._send = model.send  # bound once: 400 instructions
        self.departures = Departures(model, self.rules)
        self.left = self.departures.left
        self._place = Nowhere(len(hosts)) if place is None else place
        self.positions = self._place.positions
        self.flights = self.Flights(self, kernel, [names.id(host) for host in hosts])
        self._begin = self.flights.begin
        self.held = self.HeldFrames(self, kernel)
        self._open: dict[int, Claim] = {}  # unicast ones, by frame
        self._broadcasts: dict[int, Broadcast] = {}  # open ones, by frame
        self._awaited = 0  # receivers at which those are not settled yet
        self.refuses = frozenset(model.refuses if isinstance(model, ports.Refuses) else ())
        self._hosts = model if isinstance(model, ports.FollowsHosts) else None
        self._control = model if isinstance(model, ports.CountsControl) else None
        for number, rule in enumerate(self.rules):
            with below(f".rules.{number}"):
                rule.start(MediumView(self, f"rule {number}"), self.hosts)
        gate = Gate(self.rules, model, self)
        self._admit, self._passes, self._all_pass = gate.admit, gate.open, gate.all_pass
        self._send_many = model.send_many if isinstance(model, ports.SendsMany) else none_of
        self.judge_transmission = gate.judge_transmission
        self.dscp = marks(self, mark)
        self._reasons = gate.reasons.union(model.reasons)
        model.start(self, self.hosts)
        if isinstance(model, ports.Federate):
            kernel.join(model)
        self._reachability = Reachability((model, *self.rules), self._place)

    @property
    def control_bytes(self) -> int:
        """The bytes that the model's own protocols have sent, beside the others."""
        return 0 if self._control is None else self._control.control()[1]

    # What models may know and do: see ports.Context.

    now_ns = property(attrgetter("_kernel.now_ns"))
    antennas = property(attrgetter("_place.antennas"))
    obstacles = property(attrgetter("_place.obstacles"))

    def at(self, time_ns: int, fn: Callable[[T], object], arg: T | None = None) -> Call:
        try:
            return self._after(time_ns - self._kernel.now_ns, _NETWORK, self.id, fn, arg)
        except KernelError:
            return self._kernel.at(time_ns, _NETWORK, self.id, fn, arg)  # names the time

    def stream(self, *name: str | int) -> np.random.Generator:
        return self._streams("medium", self.name, *name)

    def settle(self, frame: Frame, receiver: int, verdict: Deliver | Drop) -> None:
        if type(verdict) is Drop and verdict.packets is not None \
                and self._leaves(frame, receiver, verdict, verdict.packets):
            return
        claim = self._open.pop(frame.id, None)
        if claim is None or claim[RECEIVER] != receiver:
            claim = self._settled(frame, (receiver,))[0].claim(receiver)
        elif frame.id in self.departures.held:
            call, arg = self.departures.held.pop(frame.id)  # ``left`` without its call
            call(arg)
        carrier, token, _, _, segments, terms = claim
        if type(verdict) is Deliver:
            if terms is PLAIN:
                self._begin(frame.source, claim, verdict.delay_ns)
            else:
                self._begin_on_terms(frame, claim, verdict.delay_ns)
        else:
            reason = reason_of(self.model, self.name, self._reasons, verdict)
            self._dropped(frame, (receiver,), reason, segments - len(terms.lost))
            carrier.lost(token, receiver, reason)

    def settle_many(self, frame: Frame, receivers: Sequence[int] | None,
                    verdict: Deliver | Drop) -> None:
        if not frame.broadcast or type(verdict) is Drop and verdict.packets is not None:
            for receiver in frame.receivers if receivers is None else receivers:
                self.settle(frame, receiver, verdict)
            return
        reason = ("" if type(verdict) is Deliver
                  else reason_of(self.model, self.name, self._reasons, verdict))
        if not receivers and frame.id not in self._broadcasts:
            return  # nobody is left
        broadcast, settled = self._settled(frame, receivers)
        if not settled:
            return
        if type(verdict) is not Deliver:
            self._dropped(frame, settled, reason,
                          len(settled) * frame.segments - broadcast.lacking(settled))
            broadcast.carrier.missed(broadcast.token, settled, reason, self)
        elif broadcast.terms is None:
            self.flights.begin_all(frame.source, broadcast.carrier, broadcast.token, settled,
                                   frame.size_bytes, frame.segments, verdict.delay_ns)
        else:
            for receiver in settled:
                self._begin_on_terms(frame, broadcast.claim(receiver), verdict.delay_ns)

    def flow(self, frame: Frame) -> Hashable:
        found = self.carried(frame)
        return found and found[0].socket, frame.source, frame.receivers

    # For those who send.

    def transmit(self, source: int, receivers: tuple[int, ...], size_bytes: int, segments: int,
                 broadcast: bool, carrier: Carrier[T], token: T, at_once: bool = False
                 ) -> int | None:
        """Take a frame for ``receivers`` (ascending); ``carrier`` is notified of its fate at each,
        with ``token``. Returns the time (ns) of arrival if there is one receiver, no rule has
        touched the frame and the model knows at once; else None. ``at_once``: see ``post``."""
        self.frames = number = self.frames + 1
        self.tx_bytes[source] += size_bytes
        frame = _new(Frame, (number, source, receivers, size_bytes, segments, broadcast))
        if broadcast:
            self._broadcast(frame, carrier, token)
            return None
        self.intended += 1
        self.packets_intended += segments
        (receiver,) = receivers
        own, wait_ns, admit = PLAIN, 0, self._admit
        if not self._passes:
            frame, terms, wait_ns = admit(frame, carrier, token)
            if terms is not None:
                if not terms:
                    return None
                own = terms[receiver]
                if own.lost:
                    own, frame = own.within(frame)
                    self.barred_bytes[source] += size_bytes - frame.size_bytes
        claim = carrier, token, receiver, size_bytes, segments, own
        if wait_ns:
            self.held.hold(wait_ns, frame, (claim,), partial(self._offer, number, frame, claim))
            return None
        return self._offer(number, frame, claim, at_once)

    def _offer(self, number: int, frame: Frame, claim: Claim, at_once: bool = False) -> int | None:
        """Hand a unicast frame of this ``number`` to the model; see ``transmit``."""
        self._open[number] = claim
        send, begin = self._send, self._begin
        delay_ns = send(frame)
        if delay_ns is None:
            return None
        found = self._open.pop(number, None)
        if found is not claim or at_once or claim[TERMS] is not PLAIN:
            return self._settle_at_once(frame, found, delay_ns, at_once)
        try:
            begin(frame.source, claim, delay_ns)
        except KernelError:
            arrival_of(self.model, delay_ns)
            raise
        return self._kernel.now_ns + delay_ns

    def _settle_at_once(self, frame: Frame, claim: Claim | None, delay_ns: int, at_once: bool
                        ) -> int | None:
        """The model has returned the delay of a frame that is to be delivered now (``at_once``), or
        of which a rule has changed something, or the model has lost packets."""
        if claim is None:
            raise unexpected(self.model, self.name, frame, frame.receivers)
        _, _, receiver, size_bytes, segments, own = claim
        if type(delay_ns) is not int or delay_ns < 0:
            arrival_of(self.model, delay_ns)
        if own is not PLAIN:
            self._begin_on_terms(frame, claim, delay_ns)
            return None
        if not at_once or not self.flights.up[receiver]:
            self._begin(frame.source, claim, delay_ns)
            return None if at_once else self._kernel.now_ns + delay_ns
        self.delivered += 1  # ``count_arrivals`` without its call
        self.packets_delivered += segments
        self.rx_bytes[receiver] += size_bytes
        return self._kernel.now_ns + delay_ns

    def post(self, source: int, receivers: tuple[int], size_bytes: int, carrier: Carrier[T],
             token: T) -> int | None:
        """Transmit one packet to one host without an event, if the model knows at once when (ns) it
        will arrive and no rule has touched it. Returns that time, and does not notify the carrier;
        None: that will be notified of its fate. For frames whose arrival triggers nothing, as
        acknowledgements: they count as delivered at once, even if their receiver stops."""
        return self.transmit(source, receivers, size_bytes, 1, False, carrier, token, True)

    def lets_pass(self, source: int, receivers: tuple[int, ...], size_bytes: int, segments: int
                  ) -> bool:
        """Whether frames that ``transmit_many`` would take now pass all rules unchanged."""
        return self._passes or self._all_pass(
            ports.Frames(self.frames + 1, source, receivers, size_bytes, segments))

    def transmit_many(self, source: int, receivers: tuple[int, ...], size_bytes: int, segments: int,
                      carriers: Carriers[T], token: T) -> None:
        """Take frames that one host sends now, equal but for their receivers, where ``lets_pass``.
        ``carriers`` expect those whose arrival the model knows; member i hears of any other i."""
        number, count, members = self.frames + 1, len(receivers), carriers.members
        self.frames += count
        self.intended += count
        self.packets_intended += count * segments
        self.tx_bytes[source] += count * size_bytes
        known = self._send_many(ports.Frames(number, source, receivers, size_bytes, segments))
        if len(known) > count:
            raise ModelError(f"{class_of(self.model)} returned {len(known)} delays from send_many "
                             f"for {count} frames")
        ahead: list[int] = []
        for i, delay_ns in enumerate(known):
            if type(delay_ns) is int and delay_ns >= 0 and len(ahead) == i:
                ahead.append(delay_ns)
                continue
            claim = members[i], token, receivers[i], size_bytes, segments, PLAIN
            if delay_ns is None:
                self._open[number + i] = claim
            else:
                self._begin(source, claim, arrival_of(self.model, delay_ns))
        self.flights.count += len(ahead)
        carriers.expected_many(token, ahead)
        for i in range(len(known), count):
            self._offer(number + i,
                        Frame(number + i, source, (receivers[i],), size_bytes, segments, False),
                        (members[i], token, receivers[i], size_bytes, segments, PLAIN))

    def is_open(self, number: int) -> bool:
        """Whether frame ``number`` waits for the model, or that has not settled it everywhere."""
        return number in self._open or number in self._broadcasts or self.held.holds(number)

    # For those who watch.

    def carried(self, frame: Frame) -> tuple[AnyCarrier, object] | None:
        """The carrier and the token of an open frame; None of a frame of the model's own."""
        broadcast = self._broadcasts.get(frame.id)
        if broadcast is not None:
            return broadcast.carrier, broadcast.token
        claim = self._open.get(frame.id)
        return None if claim is None else claim[:2]

    def switched(self, host: int, up: bool) -> None:
        """Notify the model that a host has started or stopped, if it follows that."""
        if self._hosts is not None:
            self._hosts.switched(host, up)

    def linked(self, hosts: np.ndarray) -> np.ndarray | None:
        """[k, k] bool: between which of ``hosts`` [k] (indices) frames can get now, as far as the
        model and the rules say (``ports.LimitsReach``, ``ports.Separates``); None: all."""
        return self._reachability.links(hosts, self._kernel.now_ns)

    def in_flight(self) -> int:
        """Frames, per receiver, that are not settled yet or on their way."""
        return len(self._open) + self._awaited + self.flights.count + self.held.count

    # Inside.

    def _broadcast(self, frame: Frame, carrier: Carrier[T], token: T) -> None:
        """Hand a broadcast to the model, if rules let it pass."""
        _, source, receivers, size_bytes, segments, _ = frame
        self.intended += len(receivers)
        self.packets_intended += len(receivers) * segments
        terms: dict[int, Terms] | None = None
        wait_ns = 0
        if not self._passes:
            frame, terms, wait_ns = self._admit(frame, carrier, token)
            if terms is not None and not terms:
                return
        broadcast = Broadcast(carrier, token, frame, terms)
        if wait_ns:
            self.held.hold(wait_ns, frame, [*map(broadcast.claim, frame.receivers)],
                           partial(self._offer_broadcast, broadcast))
        else:
            self._offer_broadcast(broadcast)

    def _offer_broadcast(self, broadcast: Broadcast) -> None:
        frame = broadcast.frame
        self._broadcasts[frame.id] = broadcast
        self._awaited += len(frame.receivers)
        delay_ns = self._send(frame)
        if delay_ns is not None:
            if frame.id not in self._broadcasts:
                raise unexpected(self.model, self.name, frame, frame.receivers)
            self.settle_many(frame, None, Deliver(arrival_of(self.model, delay_ns)))

    def _settled(self, frame: Frame, receivers: Sequence[int] | None
                 ) -> tuple[Broadcast, Collection[int]]:
        """A broadcast, and the receivers at which it is settled now."""
        try:
            broadcast = self._broadcasts[frame.id]
            settled = broadcast.settle(receivers)
        except KeyError:
            raise unexpected(self.model, self.name, frame, receivers) from None
        self._awaited -= len(settled)
        if not broadcast.left:
            del self._broadcasts[frame.id]
            self.left(frame)
        return broadcast, settled

    def _begin_on_terms(self, frame: Frame, claim: Claim, delay_ns: int) -> None:
        """A frame that rules may have delayed or copied is on its way to one receiver."""
        if delay_ns < 0:
            raise ModelError(f"{class_of(self.model)} delivers {-delay_ns} ns in the past")
        self.flights.begin_on_terms(frame.source, claim, delay_ns)

    def _leaves(self, frame: Frame, receiver: int, verdict: Drop, packets: tuple[int, ...]) -> bool:
        """Take out the ``packets`` that the model has lost at one receiver. Returns whether any are
        left; if not, the frame is dropped."""
        reason = reason_of(self.model, self.name, self._reasons, verdict)
        check_packets(self.model, packets, frame.segments)
        claim = self._open.get(frame.id)
        broadcast = self._broadcasts.get(frame.id)
        if broadcast is not None and broadcast.awaits(receiver):
            claim = broadcast.claim(receiver)
        if claim is None or claim[RECEIVER] != receiver:
            raise unexpected(self.model, self.name, frame, receiver)
        *_, segments, before = claim
        after = before.losing(before.numbers(packets, segments), reason)
        if len(after.lost) == segments if broadcast is None else (
                broadcast.all_dropped(receiver, packets)):
            return False
        self.count_drops(reason, 0, len(after.lost) - len(before.lost))
        if reason in self.refuses and frame.receivers[0] == receiver:  # once a frame
            sizes = packet_sizes(frame.size_bytes, frame.segments)
            self.count_refused(frame.source, sum(sizes[number] for number in packets))
        if broadcast is None:
            self._open[frame.id] = (*claim[:TERMS], after)
        else:
            broadcast.lose(receiver, after)
        return True

    def _dropped(self, frame: Frame, receivers: Collection[int], reason: str, packets: int) -> None:
        """Account for the drop of a frame by the model."""
        self.count_drops(reason, len(receivers), packets)
        if reason in self.refuses and frame.receivers[0] in receivers:  # once a frame
            self.count_refused(frame.source, frame.size_bytes)

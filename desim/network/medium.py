"""One medium: it asks its rules about each frame, hands it to its network model, and keeps the
account of what became of it at each intended receiver.

It needs a ``Kernel`` and names, not a ``Graph``: a plain SimPy program can send over it, too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Hashable, Sequence
from operator import attrgetter
from typing import Any

import numpy as np

from desim.engine.kernel import Call, Kernel, Phase
from desim.engine.streams import Streams
from desim.engine.trace import Names
from desim.errors import KernelError, ModelError, below, class_of
from desim.network.account import Account
from desim.network.answers import arrival_of, check_packets, reach_m_of, undeclared
from desim.network.broadcast import Broadcast
from desim.network.carrier import Carrier
from desim.network.gate import PLAIN, Gate, Terms
from desim.network.place import Nowhere, Place
from desim.network.rule_context import RuleContext
from desim.network.transmissions import Transmissions
from desim.ports import Deliver, Drop, Frame, NetworkModel, Obstacles, Rule, packet_sizes

# Of a frame at one receiver: carrier, token, receiver, bytes and packets of all of it, terms.
Claim = tuple[Carrier, Any, int, int, int, Terms]

_NETWORK, _DELIVER = Phase.NETWORK, Phase.DELIVER  # cheaper than to look them up each time
_new = tuple.__new__  # a Frame at half the price


class Medium(Account):
    """A network model with the rules in front of it. It is the model's ``ports.Context``.

    ``hosts`` are all host names in index order, ``attached`` the indices of those that have an
    interface to it. The account is that of its frames and packets (``Account``).
    """

    __slots__ = ("name", "id", "model", "rules", "up", "attached", "frames", "_refuses", "_kernel",
                 "_after", "_send", "_streams", "_place", "positions", "_ids", "_sources",
                 "_arrives", "_open", "_broadcasts", "_awaited", "_flying", "_reasons", "_switched",
                 "_reach_m", "_separators", "_judges", "judge_transmission", "shared", "_gate",
                 "_sending", "_sent", "_posting")

    def __init__(self, name: str, model: NetworkModel, rules: Sequence[Rule] = (), *,
                 kernel: Kernel, names: Names, streams: Streams, hosts: Sequence[str],
                 place: Place | None = None) -> None:
        super().__init__(len(hosts))
        self.name = name
        self.id = names.id(f"medium/{name}")
        self.model = model
        self.rules = tuple(rules)
        self.up = [True] * len(hosts)
        self.attached: Sequence[int] = range(len(hosts))
        self.frames = 0
        self._kernel = kernel
        self._after, self.shared = kernel.after, kernel.shared
        self._send, self._arrives = model.send, self._deliver  # bound once: 400 instructions each
        self._streams = streams
        self._place = Nowhere(len(hosts)) if place is None else place
        self.positions = self._place.positions
        self._ids = [names.id(host) for host in hosts]
        self._sources = [id_ << 32 for id_ in self._ids]  # in the entity of a delivery
        self._open: dict[tuple[int, int], Claim] = {}  # unicast ones, by frame and receiver
        self._broadcasts: dict[int, Broadcast] = {}  # by frame
        self._awaited = 0  # settlements of those
        self._flying = 0
        self._sending = 0  # the unicast frame that the model is being given, not settled yet
        self._sent: Claim
        self._posting = 0  # the frame that is to be posted
        self._reasons = frozenset(model.reasons)
        self._refuses = frozenset(getattr(model, "refuses", ()))
        self._switched = getattr(model, "switched", None)
        parts = (model, *self.rules)
        self._reach_m = min(reach_m_of(part) for part in parts)
        self._separators = [part.separates for part in parts if hasattr(part, "separates")]
        for number, rule in enumerate(self.rules):
            with below(f".rules.{number}"):
                rule.start(RuleContext(self, f"rule {number}"), tuple(hosts))
        transmissions = Transmissions(model, self.rules)
        self.judge_transmission = transmissions.ask
        self._reasons |= transmissions.reasons
        self._judges = [(rule, rule.judge) for rule in transmissions.others]
        self._gate = Gate(self.count_drops)
        model.start(self, tuple(hosts))

    @property
    def control_bytes(self) -> int:
        """Sent by the model's own protocols, beside the others."""
        return self.model.control()[1] if hasattr(self.model, "control") else 0

    # What models may know and do: ports.Context.

    now_ns = property(attrgetter("_kernel.now_ns"))

    @property
    def obstacles(self) -> Obstacles:
        return self._place.obstacles

    def at(self, time_ns: int, fn: Callable[[Any], Any], arg: Any = None) -> Call:
        return self._after(time_ns - self._kernel.now_ns, _NETWORK, self.id, fn, arg)

    def stream(self, *name: str | int) -> np.random.Generator:
        return self._streams("medium", self.name, *name)

    def settle(self, frame: Frame, receiver: int, verdict: Deliver | Drop) -> None:
        if type(verdict) is Drop and verdict.packets is not None \
                and self._leaves(frame, receiver, verdict):
            return
        claim = self._claimed(frame, receiver)
        if type(verdict) is Deliver:
            self._flying += 1
            if claim[5] is PLAIN:
                self._after(verdict.delay_ns, _DELIVER,
                            self._sources[frame.source] | self._ids[receiver], self._arrives, claim)
            else:
                self._fly_on_terms(frame, claim, verdict.delay_ns)
        else:
            self._dropped(frame, (receiver,), self._declared(verdict),
                          claim[4] - len(claim[5].lost))
            claim[0].lost(claim[1], receiver, verdict.reason)

    def settle_many(self, frame: Frame, receivers: Sequence[int] | None,
                    verdict: Deliver | Drop) -> None:
        if not frame.broadcast or type(verdict) is Drop and verdict.packets is not None:
            for receiver in frame.receivers if receivers is None else receivers:
                self.settle(frame, receiver, verdict)
            return
        reason = None if type(verdict) is Deliver else self._declared(verdict)
        broadcast, receivers = self._settled(frame, receivers)
        if not receivers:
            return
        if reason is None:
            self._fly(frame, broadcast, receivers, verdict.delay_ns)
        else:
            self._dropped(frame, receivers, reason,
                          len(receivers) * frame.segments - broadcast.lacking(receivers))
            broadcast.carrier.missed(broadcast.token, receivers, reason, self)

    def flow(self, frame: Frame) -> Hashable:
        number = frame.id
        carrier = self._broadcasts[number].carrier if frame.broadcast else (
            self._sent if self._sending == number else self._open[number, frame.receivers[0]])[0]
        return getattr(carrier, "socket", carrier), frame.source, frame.receivers

    # What transports do.

    def transmit(self, source: int, receivers: tuple[int, ...], size_bytes: int, segments: int,
                 broadcast: bool, carrier: Carrier, token: Any) -> int | None:
        """Take a frame for ``receivers`` (ascending); ``carrier`` hears of its fate at each, with
        ``token``. Returns when (ns) it will be there, if there is one receiver, no rule has touched
        it and the model says so right away."""
        self.frames = number = self.frames + 1
        count = len(receivers)
        self.intended += count
        self.packets_intended += count * segments
        self.tx_bytes[source] += size_bytes
        frame = _new(Frame, (number, source, receivers, size_bytes, segments, broadcast))
        terms: dict[int, Terms] | None = None  # of those that are left, as soon as a rule speaks
        for rule, judge in self._judges:
            verdicts = judge(frame, receivers)
            if verdicts is not None:
                terms = self._gate.obey(rule, verdicts, frame, receivers, terms, carrier, token)
                if not terms:
                    self.barred_bytes += size_bytes
                    return None
                if len(terms) < len(receivers):
                    receivers = tuple(terms)
                    frame = frame._replace(receivers=receivers)
        if broadcast:
            self._broadcasts[number] = Broadcast(carrier, token, frame, terms)
            self._awaited += len(receivers)
            delay_ns = self._send(frame)
            if delay_ns is not None:
                if number not in self._broadcasts:
                    raise self._unexpected(frame, receivers)
                self.settle_many(frame, None, Deliver(arrival_of(self.model, delay_ns)))
            return None
        (receiver,) = receivers
        own = PLAIN
        if terms is not None:
            own = terms[receiver]
            if own.lost:
                own, frame = own.within(frame)
                self.barred_bytes += size_bytes - frame.size_bytes
        if self._sending:  # the model drops another frame meanwhile, and its carrier sends this one
            self._keep()
        self._sending = number
        self._sent = claim = (carrier, token, receiver, size_bytes, segments, own)
        delay_ns = self._send(frame)
        if delay_ns is None:
            if self._sending == number:
                self._keep()
            return None
        if self._sending != number:
            claim = self._claimed(frame, receiver)
        self._sending = 0
        if claim[5] is not PLAIN:
            self._flying += 1
            self._fly_on_terms(frame, claim, arrival_of(self.model, delay_ns))
            return None
        if number == self._posting and self.up[receiver]:
            arrival_of(self.model, delay_ns)
            self._posting = 0
            self.delivered += 1
            self.packets_delivered += segments
            self.rx_bytes[receiver] += size_bytes
        else:
            self._flying += 1
            after = self._after
            try:
                after(delay_ns, _DELIVER, self._sources[source] | self._ids[receiver],
                      self._arrives, claim)
            except KernelError:
                arrival_of(self.model, delay_ns)
                raise
        return self._kernel.now_ns + delay_ns

    def post(self, source: int, receivers: tuple[int], size_bytes: int, carrier: Carrier,
             token: Any) -> int | None:
        """Like ``transmit`` of one packet to one host, but if the model says right away when it
        will be there and no rule has touched it, say so (ns), and tell the carrier nothing; else
        None. For what nobody may ever look at, such as an acknowledgement: it costs no event. It
        counts as delivered at once, even if its receiver should stop while it is on its way."""
        self._posting = self.frames + 1
        due_ns = self.transmit(source, receivers, size_bytes, 1, False, carrier, token)
        posted = not self._posting
        self._posting = 0
        return due_ns if posted else None

    def switched(self, host: int, up: bool) -> None:
        """A host has started or stopped: for a model that wants to know."""
        if self._switched is not None:
            self._switched(host, up)

    def linked(self, hosts: np.ndarray) -> np.ndarray | None:
        """[k, k] bool: between which of ``hosts`` [k] (indices) frames can get now, as far as the
        model and the rules say (``reach_m`` and ``separates``); None: between all."""
        links = None
        if self._reach_m < math.inf:
            places = self.positions(self._kernel.now_ns)[hosts]
            apart = places[:, None, :] - places[None, :, :]
            links = ~((apart ** 2).sum(axis=2) > self._reach_m ** 2)  # True for NaN
        for separates in self._separators:
            together = np.array([[not separates(a, b) for b in hosts.tolist()]
                                 for a in hosts.tolist()], bool)
            links = together if links is None else links & together
        return links

    def in_flight(self) -> int:
        """Frames, per receiver, that are not settled yet or on their way."""
        return len(self._open) + (self._sending > 0) + self._awaited + self._flying

    def _keep(self) -> None:
        """What is being sent is settled later."""
        self._open[self._sending, self._sent[2]] = self._sent
        self._sending = 0

    def _claimed(self, frame: Frame, receiver: int) -> Claim:
        if frame.id == self._sending and receiver == self._sent[2]:
            self._sending = 0
            return self._sent
        try:
            return self._open.pop((frame.id, receiver))
        except KeyError:
            return self._claim(frame, receiver)

    def _claim(self, frame: Frame, receiver: int) -> Claim:
        """Of one receiver of a broadcast, at whom it is settled now."""
        return self._settled(frame, (receiver,))[0].claim(receiver)

    def _settled(self, frame: Frame, receivers: Sequence[int] | None
                 ) -> tuple[Broadcast | None, Collection[int]]:
        """A broadcast, and the receivers at whom it is settled now."""
        broadcast = self._broadcasts.get(frame.id)
        if broadcast is None and not receivers:
            return None, ()
        try:
            settled = self._broadcasts[frame.id].settle(receivers)
        except KeyError:
            raise self._unexpected(frame, receivers) from None
        self._awaited -= len(settled)
        if not broadcast.left:
            del self._broadcasts[frame.id]
        return broadcast, settled

    def _fly(self, frame: Frame, broadcast: Broadcast, receivers: Collection[int],
             delay_ns: int) -> None:
        """A broadcast is on its way to ``receivers``."""
        self._flying += len(receivers)
        if broadcast.terms is not None:
            for receiver in receivers:
                self._fly_on_terms(frame, broadcast.claim(receiver), delay_ns)
            return
        carrier, token = broadcast.carrier, broadcast.token
        size_bytes, segments = frame.size_bytes, frame.segments
        ids, after, arrives = self._ids, self._after, self._arrives
        source = self._sources[frame.source]
        for receiver in receivers:
            after(delay_ns, _DELIVER, source | ids[receiver], arrives,
                  (carrier, token, receiver, size_bytes, segments, PLAIN))

    def _fly_on_terms(self, frame: Frame, claim: Claim, delay_ns: int) -> None:
        """What rules may have delayed or copied is on its way to one receiver."""
        if delay_ns < 0:
            raise ModelError(f"{self._model()} delivers {-delay_ns} ns in the past")
        rules_ns, copies_ns, lost, _ = claim[5]
        entity = self._sources[frame.source] | self._ids[claim[2]]
        if copies_ns and not lost:
            self._after(delay_ns + rules_ns, _DELIVER, entity, self._deliver_often, (entity, claim))
        else:
            self._after(delay_ns + rules_ns, _DELIVER, entity, self._arrives, claim)

    def _deliver(self, claim: Claim) -> None:
        carrier, token, receiver, size_bytes, segments, terms = claim
        self._flying -= 1
        if not self.up[receiver]:
            self.count_drops("host_down", 1, segments - len(terms.lost))
            carrier.lost(token, receiver, "host_down")
            return
        self.delivered += 1
        if terms is not PLAIN and terms.lost:
            self._deliver_in_part(claim)
            return
        self.packets_delivered += segments
        self.rx_bytes[receiver] += size_bytes
        carrier.arrived(token, receiver)

    def _deliver_in_part(self, claim: Claim) -> None:
        carrier, token, receiver, size_bytes, segments, terms = claim
        sizes = packet_sizes(size_bytes, segments)
        self.packets_delivered += segments - len(terms.lost)
        self.rx_bytes[receiver] += size_bytes - sum(sizes[number] for number in terms.lost)
        carrier.arrived_in_part(token, receiver, dict(sorted(terms.lost.items())))

    def _deliver_often(self, arrival: tuple[int, Claim]) -> None:
        """A frame that has copies: they come after it, if it comes."""
        entity, claim = arrival
        if self.up[claim[2]]:
            for after_ns in claim[5].copies_ns:
                self._after(after_ns, _DELIVER, entity, self._repeat, claim)
        self._deliver(claim)

    def _repeat(self, claim: Claim) -> None:
        carrier, token, receiver, size_bytes, *_ = claim
        if self.up[receiver]:
            self.copies += 1
            self.rx_bytes[receiver] += size_bytes
            carrier.repeated(token, receiver)

    def _unexpected(self, frame: Frame, receiver: int | Sequence[int]) -> ModelError:
        return ModelError(f"{self._model()} settled {frame} at receiver {receiver}, which is "
                          "settled already or was never intended")

    def _declared(self, verdict: Any) -> str:
        if type(verdict) is not Drop:
            raise ModelError(f"{self._model()} settled with {verdict!r}; Deliver or Drop is wanted")
        if verdict.reason not in self._reasons:
            raise undeclared(self.model, verdict.reason)
        return verdict.reason

    def _leaves(self, frame: Frame, receiver: int, verdict: Drop) -> bool:
        """Take out the packets that the model has lost at one receiver. Returns whether any are
        left; if not, the frame is dropped."""
        reason = self._declared(verdict)
        check_packets(self.model, verdict.packets, frame.segments)
        if frame.id == self._sending and receiver == self._sent[2]:
            self._keep()
        claim = self._open.get((frame.id, receiver))
        broadcast = None if claim else self._broadcasts.get(frame.id)
        if broadcast is not None and broadcast.awaits(receiver):
            claim = broadcast.claim(receiver)
        if claim is None:
            raise self._unexpected(frame, receiver)
        *_, segments, before = claim
        after = before.losing(before.numbers(verdict.packets, segments), reason)
        if len(after.lost) == segments:
            return False
        self.count_drops(reason, 0, len(after.lost) - len(before.lost))
        if reason in self._refuses and frame.receivers[0] == receiver:  # once a frame
            sizes = packet_sizes(frame.size_bytes, frame.segments)
            self.count_refused(frame.source, sum(sizes[number] for number in verdict.packets))
        if broadcast is None:
            self._open[frame.id, receiver] = (*claim[:5], after)
        else:
            broadcast.lose(receiver, after)
        return True

    def _dropped(self, frame: Frame, receivers: Collection[int], reason: str, packets: int) -> None:
        self.count_drops(reason, len(receivers), packets)
        if reason in self._refuses and frame.receivers[0] in receivers:  # once a frame
            self.count_refused(frame.source, frame.size_bytes)

    def _model(self) -> str:
        return f"{class_of(self.model)} of medium {self.name!r}"

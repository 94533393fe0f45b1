"""The writer proxy of RTPS (8.4.10.4): a reader's view of one writer; in order, exactly once."""

from __future__ import annotations

from typing import TYPE_CHECKING

from desim.middleware.earliest import Earliest
from desim.middleware.timers import NEVER
from desim.network.carrier import Carrier

if TYPE_CHECKING:
    from desim.middleware.dds.dds import Dds
    from desim.middleware.dds.reader_proxy import ReaderProxy
    from desim.middleware.dds.remote import RemoteParticipant
    from desim.middleware.message import Message
    from desim.ports.middleware import Advertisement, Route

OPEN, HELD, DONE = 0, 1, 2  # states of a sample at its reader
# A heartbeat that is not final asks for an acknowledgement; a directed one, this reader alone.
NO_HEARTBEAT, FINAL, NOT_FINAL, DIRECTED = range(4)
MOST = 256  # numbers in an ACKNACK, fragments in a NACK_FRAG (RTPS)
Missing = tuple[tuple[int, tuple[int, ...]], ...]  # numbers with fragments of them (none: all)
# Number of the first sample that the reader does not have; what is missing from there; whether it
# wants a heartbeat.
Acknack = tuple[int, Missing, bool]
Place = tuple[int, int]  # number of a sample, and of a fragment of it


class ReliableSample:
    """A message for one reader. ``kept``: the writer can send it again; ``flying``: frames of it on
    their way; ``lacks``: the fragments that the reader does not have, empty if it has none or all;
    ``again``: for each fragment that was repeated, the end and the length of the pause before it is
    repeated once more."""

    __slots__ = ("message", "number", "parts", "kept", "flying", "state", "lacks", "first_ns",
                 "sent_ns", "again")

    def __init__(self, message: Message, number: int, parts: int, now_ns: int) -> None:
        self.message = message
        self.number = number
        self.parts = parts  # fragments
        self.kept = True
        self.flying = 0
        self.state = OPEN
        self.lacks: dict[int, None] = {}
        self.first_ns = self.sent_ns = now_ns
        self.again: dict[int, tuple[int, int]] | None = None


class NackTiming:
    """The last request of a reader, its end and its time: it decides when the next one may follow.

    As Cyclone DDS does it (src/core/ddsi/src/ddsi_acknack.c, get_acknack_info): new losses are
    requested at once; the same samples after NackDelay, or when a heartbeat for this reader alone
    shows that they were sent again, unless the last request was due to the delay.
    """

    def __init__(self) -> None:
        self._end: Place = (0, 0)
        self._asked_ns = 0
        self._by_delay = False
        self.directed = False  # since the last request there was a heartbeat for this reader alone

    def wait_ns(self, first: Place, now_ns: int, delay_ns: int) -> int:
        """The time until the reader may request samples from ``first`` on; 0: now."""
        if first >= self._end or (self.directed and not self._by_delay):
            return 0
        return max(0, self._asked_ns + delay_ns - now_ns)

    def requests(self, first: Place, end: Place, now_ns: int) -> None:
        """The reader requests samples from ``first`` up to before ``end``."""
        self._by_delay = first < self._end and not self.directed
        self._end, self._asked_ns, self.directed = end, now_ns, False


class WriterProxy(Carrier[Acknack]):
    """The reader's proxy of one writer. It delivers samples in the order of their numbers, and
    passes over those that the writer no longer has. It learns of the writer by arrivals alone, and
    is the carrier of its own acknowledgements. Where one is lost, the writer's next heartbeat asks
    again."""

    socket = "rtps"  # a participant sends all by one

    __slots__ = ("_reader_proxy", "_dds", "_context", "_kernel", "_constants", "_host", "_writer",
                 "_topic", "_to", "_to_id", "_send", "_post", "_record", "_next", "_known",
                 "_held", "_parts", "_answer", "_seen", "_remote", "_preemptive", "_nack_timing",
                 "_asked", "_acked", "_acked_ns", "_ack_bytes", "_response_ns")

    def __init__(self, reader_proxy: ReaderProxy, dds: Dds, advertised: Advertisement, host: int,
                 medium: Route) -> None:
        source = advertised.publisher.host
        self._reader_proxy, self._dds, self._constants = reader_proxy, dds, dds.constants
        self._context = context = dds.context
        self._kernel = context.kernel
        self._host = host
        self._writer = dds.participants[source].guid
        self._topic = advertised.publisher.topic
        self._to, self._to_id = (source,), context.host_ids[source]
        self._send, self._post, self._record = medium.transmit, medium.post, context.record
        self._ack_bytes = dds.acknack_size.size_bytes
        self._response_ns: int = dds.constants.heartbeat_response_ns
        self._next = 1
        self._known = 0
        self._held: dict[int, ReliableSample] = {}
        self._parts: dict[int, ReliableSample] = {}  # of which some parts are there
        self._answer = Earliest(context.kernel, context.host_ids[host], self._send_acknack)
        self._seen = -1  # changes of matches when it last asked for its writer
        self._remote: RemoteParticipant | None = None
        self._preemptive = False  # it asks what there is
        self._asked = False  # a heartbeat waits for an answer
        self._nack_timing = NackTiming()
        self._acked = self._acked_ns = 0  # all before what it acknowledged last, and when

    def _match(self) -> RemoteParticipant | None:
        """The state that this host keeps of the writer's participant, if it has matched it."""
        dds = self._dds
        if self._seen != dds.matches:
            self._seen = dds.matches
            me = dds.participants.get(self._host)
            current = me is not None and me.guid == self._reader_proxy.guid
            self._remote = (dds.writer(self._writer, self._host, self._topic) if current
                            else None)
        return self._remote

    def take(self, sample: ReliableSample, part: range, first: int, beat: int) -> bool:
        """Take some fragments of a sample. Returns False if no reader is here."""
        if self._seen != self._dds.matches:
            self._match()
        remote = self._remote
        if remote is None:
            return False
        remote.received_ns = self._kernel.now_ns
        number = sample.number
        if sample.state == OPEN and number >= self._next and (
                len(part) == sample.parts and not self._parts or self._complete(sample, part)):
            if number == self._next and not self._held:
                self._deliver(sample)
            else:
                sample.state = HELD
                self._held[number] = sample
        if beat:
            self._take_heartbeat(first, number, beat)
        elif first > self._next or self._held:
            self._advance(first)
        return True

    def _complete(self, sample: ReliableSample, part: range) -> bool:
        if len(part) == sample.parts:
            if self._parts:
                self._parts.pop(sample.number, None)
            return True
        if not sample.lacks:
            sample.lacks = dict.fromkeys(range(sample.parts))
            self._parts[sample.number] = sample
        for index in part:
            sample.lacks.pop(index, None)
        if sample.lacks:
            return False
        self._parts.pop(sample.number, None)
        return True

    def _deliver(self, sample: ReliableSample) -> None:
        sample.state = DONE
        self._reader_proxy.waiting -= 1
        self._next = sample.number + 1
        self._context.deliver(sample.message, self._host, sample.first_ns, sample.sent_ns)

    def _advance(self, first: int) -> None:
        """Pass over all before ``first``: the writer has nothing older."""
        held = self._held
        if held:
            for number in sorted(held):
                if number == self._next or number < first:
                    self._deliver(held.pop(number))
                elif number == max(first, self._next):
                    self._next = number
                    self._deliver(held.pop(number))
                else:
                    break
        if first > self._next:
            self._next = first
        for number in [number for number in self._parts if number < self._next]:
            del self._parts[number]

    def _take_heartbeat(self, first: int, last: int, beat: int) -> None:
        """Answer a heartbeat, or ask for missing samples, after the usual delay."""
        if first > self._next or self._held:
            self._advance(first)
        if last > self._known:
            self._known = last
        self._preemptive = False  # it has its answer
        if beat >= NOT_FINAL:
            self._asked = True
            if beat == DIRECTED:
                self._nack_timing.directed = True
            if self._response_ns:  # ``_send_acknack_in`` without its call
                self._answer.by(self._kernel.now_ns + self._response_ns)
            else:
                self._send_acknack_in(0)
        elif self._next <= self._known:
            self._send_acknack_in(self._constants.nack_delay_ns)

    def heartbeat(self, first: int, last: int, beat: int) -> None:
        """A heartbeat that rides on no sample has arrived."""
        remote = self._match()
        if remote is not None:
            remote.received_ns = self._kernel.now_ns
            self._take_heartbeat(first, last, beat)

    def joined(self) -> None:
        """The reader has matched the writer now, which may have sent something already."""
        if self._constants.initial_acknack_ns is not None:
            self._preemptive = True
            self._send_acknack_in(self._constants.initial_acknack_ns)

    def _send_acknack_in(self, delay_ns: int) -> None:
        """Answer at that time, or earlier if an answer is due anyway."""
        due_ns = self._kernel.now_ns + delay_ns
        if delay_ns:
            self._answer.by(due_ns)
        elif due_ns < self._answer.due_ns:
            self._answer.stop()
            self._send_acknack(None)

    def _send_acknack(self, _: object) -> None:
        """Acknowledge all before the next number, or request what is missing from there."""
        self._answer.due_ns = NEVER
        if self._seen != self._dds.matches:
            self._match()
        if self._remote is None:
            return
        missing = self._missing() if self._next <= self._known else ()
        preemptive, self._preemptive = self._preemptive, False
        if missing or preemptive:
            self._send_nack(missing, preemptive)
        elif self._asked:
            base, now_ns, post = self._next, self._kernel.now_ns, self._post
            if base == self._acked and now_ns < self._acked_ns + self._constants.ack_again_ns:
                return  # it was said just now
            self._record_answer(base, 0, self._ack_bytes)
            due_ns = post(self._host, self._to, self._ack_bytes, self, (base, (), False))
            if due_ns is not None:
                self._reader_proxy.acknowledged_at(due_ns, base)

    def _send_nack(self, missing: Missing, preemptive: bool) -> None:
        """Request ``missing`` fragments unless that was done just now; with ``preemptive``, a
        heartbeat."""
        now_ns, constants, base = self._kernel.now_ns, self._constants, self._next
        fragments = [len(parts) for _, parts in missing if parts]
        if missing:
            (number, parts), (last, last_parts) = missing[0], missing[-1]
            first = number, parts[0] if parts else 0
            wait_ns = self._nack_timing.wait_ns(first, now_ns, constants.nack_again_ns)
            if wait_ns and not preemptive:
                self._send_acknack_in(wait_ns)
                return
            end = (last, last_parts[-1] + 1) if last_parts else (last + 1, 0)
            self._nack_timing.requests(first, end, now_ns)
        size = self._dds.wire.acknacks(1, len(missing) - len(fragments), fragments)
        self._record_answer(base, len(missing), size.size_bytes)
        self._send(self._host, self._to, size.size_bytes, size.packets, False, self,
                   (base, missing, preemptive))
        if missing and constants.nack_renewal_ns is not None:
            self._send_acknack_in(constants.nack_renewal_ns)

    def _record_answer(self, base: int, missing: int, size_bytes: int) -> None:
        """Write the trace row of an answer. One before the first sample belongs to discovery."""
        now_ns = self._kernel.now_ns
        if not self._known and base == 1:
            self._context.record_control("acknack", self._host, self._to_id, size_bytes)
        self._asked, self._acked, self._acked_ns = False, base, now_ns
        record = self._record
        record("acknack", self._host, self._to_id, base, missing)

    def _missing(self) -> Missing:
        """The samples and fragments that the reader lacks: an ACKNACK and NACK_FRAGs (of Cyclone
        DDS up to the first sample of which it has some fragments)."""
        parts, held = self._parts, self._held
        out: list[tuple[int, tuple[int, ...]]] = []
        several = self._dds.wire.several_nack_frags
        for number in range(self._next, min(self._known, self._next + MOST - 1) + 1):
            if number in parts:
                out.append((number, tuple(parts[number].lacks)[:MOST]))
                if not several:
                    break
            elif number not in held:
                out.append((number, ()))
        return tuple(out)

    def drop(self, reason: str) -> None:
        """Drop the samples that the reader holds, for ``reason``."""
        for sample in self._held.values():
            sample.state = DONE
            self._reader_proxy.waiting -= 1
            self._context.drop(sample.message, self._host, reason, sample.first_ns,
                             sample.sent_ns)
        self._held.clear()
        self._answer.stop()

    # The carrier of its acknowledgements.

    def arrived(self, token: Acknack, receiver: int) -> None:
        self._reader_proxy.acknack(token, receiver)

    repeated = arrived

"""The reader proxy of RTPS (8.4.7.5): the samples that a writer keeps for one reliable reader.

Each link numbers its samples by itself, as if each reader had a writer of its own; where a writer
sends everything to everybody, the numbers are the same. The writer learns by acknowledgements
alone; the loss of a frame only writes a row ``lost``. An acknowledgement that asks for nothing
counts when the writer next works with its history.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from typing import TYPE_CHECKING, TypeVar

from desim.middleware.dds import wire
from desim.middleware.dds.frames import BundleCarrier, HeartbeatCarrier
from desim.middleware.dds.retransmission import RequestedChanges
from desim.middleware.dds.writer_proxy import (
    DIRECTED,
    DONE,
    FINAL,
    HELD,
    NO_HEARTBEAT,
    NOT_FINAL,
    OPEN,
    Acknack,
    ReliableSample,
    WriterProxy,
)
from desim.middleware.earliest import Earliest
from desim.middleware.timers import NEVER, Timer
from desim.network.carrier import Carrier

if TYPE_CHECKING:
    from desim.middleware.dds.dds import Dds
    from desim.middleware.dds.stateful_writer import StatefulWriter
    from desim.middleware.dds.wire import Guid
    from desim.middleware.message import Message
    from desim.ports.middleware import Advertisement, Route

T = TypeVar("T")

# An arrival within this time is soon: no heartbeat overtakes it (80 ms at least), no lease ends.
SOON_NS = 50_000_000

# A sample, its fragments in this train, the first number that the writer still has, the kind of the
# heartbeat in it, and its messages.
DataToken = tuple[ReliableSample, range, int, int, tuple[wire.DdsMessage, ...]]


class ReaderProxy(Carrier[DataToken]):
    """The writer's proxy of one reader, and the carrier of its data.

    It keeps the last ``depth`` samples that are not acknowledged (0: all); an older one is
    ``overwritten``, unless its frames are still on their way or the reader holds it. Heartbeats
    ride on samples, and travel alone while a sample is not acknowledged: a while after the last
    one, or ``_steady``, whatever rode meanwhile. Large samples are cut in fewer frames as long as
    they arrive soon and nothing gets lost.
    """

    socket = "rtps"  # a participant sends all by one

    __slots__ = ("guid", "waiting", "received_ns", "writer_proxy", "_dds", "_context", "_kernel",
                 "_constants", "_from", "_from_id", "_receiver", "_to_id", "_to", "_send",
                 "_medium", "_node", "_record_frame", "_depth", "_history", "_unacked_bytes",
                 "_last", "_beat_ns", "_beats", "_timer", "_closed", "ends",
                 "_heartbeats", "_bundles", "coming", "_requested", "_retransmission",
                 "_announced", "_smooth", "_quick", "_steady", "_period_ns",
                 "_calls", "_piggyback", "_trains", "_long_trains")

    def __init__(self, dds: Dds, advertised: Advertisement, writer: StatefulWriter, receiver: int,
                 guid: Guid, medium: Route) -> None:
        context, source, topic = dds.context, advertised.publisher.host, advertised.publisher.topic
        self.guid = guid
        self.waiting = 0  # samples without a fate
        self.received_ns = 0  # the last acknowledgement that counts so far
        self._dds, self._context, self._constants = dds, context, dds.constants
        self._kernel = context.kernel
        self._from, self._from_id = source, context.host_ids[source]
        self._receiver, self._to_id = receiver, context.host_ids[receiver]
        self._to, self._node = (receiver,), advertised.publisher.node
        self._send, self._medium = context.socket(source, self.socket).send, medium
        self._record_frame = context.record_frame
        self._depth, self._piggyback, self._calls = writer.depth, writer.piggyback, writer.calls
        self._history: deque[ReliableSample] = deque()
        self._unacked_bytes = self._last = self._beats = 0
        self._beat_ns: int = -dds.constants.heartbeat_asks_after_ns  # the first sample asks
        self._timer = Timer(dds.timers, self._from_id, self._tick)
        self._steady = dds.constants.heartbeat_rides != "always"
        self._period_ns: int = dds.constants.heartbeat_period_ns + dds.constants.timer_slip_ns
        self._trains, self._long_trains = dds.trains, dds.long_trains
        self._smooth = True  # nothing was lost so far
        self._quick = False  # the last large sample was there soon, and nothing was asked for since
        self._announced = False  # its first heartbeat is still to come, which offers all
        self._closed: str | None = None
        self.ends = source, receiver, topic
        self._requested = RequestedChanges(dds.constants, dds.wire)
        self._retransmission = Earliest(self._kernel, self._from_id, self._retransmit)
        self._heartbeats, self._bundles = HeartbeatCarrier(self), BundleCarrier(self, dds.wire)
        self.coming: deque[tuple[int, int]] = deque()  # acknowledgements: when, all before what
        self.writer_proxy = WriterProxy(self, dds, advertised, receiver, medium)
        dds.linked(self)

    # The writer.

    def offer(self, message: Message, beats: tuple[bool, ...]) -> None:
        """Send a new sample, with heartbeats on those of its messages."""
        history, constants, now_ns = self._history, self._constants, self._kernel.now_ns
        if self.coming and self.coming[0][0] < now_ns:
            self.take_acknowledgements(now_ns)
        self._last = number = self._last + 1
        trains = (self._long_trains if self._quick else self._trains)(message.size_bytes, beats)
        sample = ReliableSample(message, number, trains[-1].part.stop, now_ns)
        self.waiting += 1
        history.append(sample)
        self._unacked_bytes += message.size_bytes
        if 0 < self._depth < len(history):
            oldest = history.popleft()
            self._unacked_bytes -= oldest.message.size_bytes
            oldest.kept = False
            if oldest.state == OPEN:
                self.settle(oldest, "overwritten")
        asks = (now_ns - self._beat_ns >= constants.heartbeat_asks_after_ns
                or self._unacked_bytes >= constants.high_water_bytes)
        self._beats = 0
        self._beat_ns = now_ns
        for train in trains:
            self._transmit(sample, train, NOT_FINAL if asks else FINAL, self._node)
        if self._announced and not (self._steady and self._timer.deadline_ns < NEVER):
            self._timer.expect(now_ns + self._period_ns)

    def _transmit(self, sample: ReliableSample, train: wire.SampleTrain, beat: int,
                  node: str | None = None) -> None:
        """Send some fragments of a sample; heartbeats that ride on them are of the kind ``beat``.
        ``node`` waits for room in the socket."""
        part, (size_bytes, packets), messages, beats = train
        sample.sent_ns = self._kernel.now_ns
        sample.flying += 1
        record_frame, send = self._record_frame, self._send
        record_frame(self._from_id, self._to_id, sample.message.seq, size_bytes)
        send(self._medium, self._to, size_bytes, packets, False, self,
             (sample, part, self._history[0].number, beat if beats else NO_HEARTBEAT, messages),
             messages[0].packets, node)

    def leaves(self, sample: ReliableSample, size_bytes: int) -> None:
        """Count and record a frame with ``sample`` whole that is sent now."""
        sample.sent_ns = self._kernel.now_ns
        sample.flying += 1
        self._record_frame(self._from_id, self._to_id, sample.message.seq, size_bytes)

    def send(self, size: wire.WireSize, carrier: Carrier[T], token: T) -> None:
        """Send a message to the reader."""
        size_bytes, packets = size
        self._send(self._medium, self._to, size_bytes, packets, False, carrier, token, packets)

    def _expect(self, due_ns: int) -> None:
        """Send a heartbeat by itself at that time, or when a steady one is due anyway."""
        if not self._steady or self._timer.deadline_ns == NEVER:
            self._timer.expect(due_ns)

    def unacknowledged(self) -> int:
        """The number of samples that the reader has not acknowledged."""
        self.take_acknowledgements(self._kernel.now_ns)
        return len(self._history)

    def unacknowledged_bytes(self) -> int:
        self.take_acknowledgements(self._kernel.now_ns)
        return self._unacked_bytes

    def first(self) -> int:
        """The number of the first sample that the writer still has."""
        return self._history[0].number if self._history else self._last + 1

    def acknack(self, token: Acknack, _: int) -> None:
        """An answer of the reader has arrived. Fragments that it requests more than once until they
        are repeated are repeated once."""
        base, missing, asks = token
        if self._closed is not None:
            return
        now_ns = self._kernel.now_ns
        self.take_acknowledgements(now_ns, base)
        if self._calls.waiting:
            self._calls.acknowledged_at(now_ns)
        if missing:
            self._quick = False
            delay_ns = self._constants.nack_response_ns
            self._requested.request(missing)
            if delay_ns:
                self._retransmission.by(now_ns + delay_ns)
            else:
                self._retransmit(None)
        elif asks:
            self._beat(self._dds.heartbeat_size, DIRECTED)

    def acknowledged_at(self, due_ns: int, base: int) -> None:
        """An acknowledgement of all before ``base`` will arrive at ``due_ns``."""
        if self._closed is None:
            self.coming.append((due_ns, base))
            if self._calls.waiting:
                self._calls.acknowledged_at(due_ns)
            if base > self._last and due_ns < self._timer.deadline_ns and not self._steady:
                self._timer.deadline_ns = NEVER

    def take_acknowledgements(self, now_ns: int, now_base: int = 0) -> None:
        """Apply the acknowledgements that have arrived before ``now_ns``, and one of all before
        ``now_base`` that arrives now (0: none). The last one says all that those before it do."""
        coming, base = self.coming, 0
        while coming and coming[0][0] < now_ns:
            self.received_ns, base = coming.popleft()
        if now_base:
            self.received_ns, base = now_ns, max(base, now_base)
        history = self._history
        while history and history[0].number < base:
            sample = history.popleft()
            self._unacked_bytes -= sample.message.size_bytes
            sample.kept = False
            if sample.state == OPEN:
                self.settle(sample, "overwritten")
        if base and self._requested.missing:
            self._requested.acknowledged(base)

    def _retransmit(self, _: object) -> None:
        """Send requested fragments again and a heartbeat at the end, or a GAP for fragments that
        are gone."""
        self._retransmission.stop()
        if self._closed is not None:
            return
        now_ns = self._kernel.now_ns
        self.take_acknowledgements(now_ns)
        parts, gone, next_ns = self._requested.take(self._history, self.first(), now_ns)
        if parts:
            self._send_again(parts)
            self._beats, self._beat_ns = 0, now_ns
        if gone:
            self._beat(self._dds.wire.gap(), DIRECTED)
        if next_ns is not None:
            self._retransmission.by(next_ns)
        self._expect_heartbeat()

    def _send_again(self, parts: list[tuple[ReliableSample, range]]) -> None:
        """Send each fragment of ``parts`` in a message of its own, or whole samples together."""
        fragment_bytes, cut = self._constants.fragment_bytes, self._dds.wire
        beats = iter(self._piggyback.again([
            min(fragment_bytes, sample.message.size_bytes) for sample, part in parts
            for _ in part]))
        bundle: list[tuple[ReliableSample, bool]] = []
        left_bytes = cut.bundles_bytes
        for sample, part in parts:
            size_bytes = sample.message.size_bytes
            if cut.bundles_bytes and sample.parts == 1:
                if size_bytes > left_bytes:
                    self._bundles.send(bundle)
                    bundle, left_bytes = [], cut.bundles_bytes
                bundle.append((sample, next(beats)))
                left_bytes -= size_bytes + wire.BUNDLED_BYTES
                continue
            train = cut.repetition(size_bytes, fragment_bytes, part,
                                   tuple(next(beats) for _ in part))
            self._transmit(sample, train, DIRECTED)
        self._bundles.send(bundle)

    def _expect_heartbeat(self) -> None:
        """Send a heartbeat after a while if a sample is not acknowledged."""
        if self._history and self._announced:
            self._expect(max(self._next_beat_ns(), self._kernel.now_ns))

    def first_heartbeat(self) -> tuple[int, int]:
        """Send the first heartbeat now. Returns the first and the last number that it offers."""
        now_ns = self._kernel.now_ns
        self.take_acknowledgements(now_ns)
        self._announced, self._beat_ns = True, now_ns
        self._expect_heartbeat()
        return self.first(), self._last

    def _tick(self) -> None:
        """Send a heartbeat if none was sent meanwhile and a sample is not acknowledged."""
        now_ns = self._kernel.now_ns
        self.take_acknowledgements(now_ns)
        if not self._history:
            return
        if self._steady or self._next_beat_ns() <= now_ns:
            self._beats += 1
            self._beat(self._dds.heartbeat_size, NOT_FINAL)
        self._expect_heartbeat()

    def _next_beat_ns(self) -> int:
        if self._steady:
            return self._kernel.now_ns + self._period_ns
        constants = self._constants
        delay_ns: int = min(constants.heartbeat_limit_ns, constants.heartbeat_period_ns
                            << min(16, max(0, self._beats - 2))) + constants.timer_slip_ns
        return self._beat_ns + delay_ns

    def _beat(self, size: wire.WireSize, beat: int) -> None:
        context = self._context
        self._beat_ns = self._kernel.now_ns
        context.record("heartbeat", self._from, self._to_id, self.first(), self._last)
        if not self._last:
            context.record_control("heartbeat", self._from, self._to_id, size.size_bytes)
        self.send(size, self._heartbeats, (self.first(), self._last, beat))

    def close(self, reason: str) -> None:
        """Drop all that waits. Frames on their way meet their own fate."""
        self._dds.unlinked(self)
        self._closed = reason
        self._timer.stop()
        self.writer_proxy.drop(reason)
        for sample in self._history:
            sample.kept = False
            self.settle(sample, reason)
        self._history.clear()

    # Fates.

    def settle(self, sample: ReliableSample, reason: str) -> None:
        """Drop ``sample`` if nothing can bring it to the reader any more."""
        if not (sample.kept or sample.flying or sample.state):
            sample.state = DONE
            self.waiting -= 1
            self._context.drop(sample.message, self._receiver, reason, sample.first_ns,
                             sample.sent_ns)

    def topics(self, token: DataToken) -> tuple[str, ...]:
        return (self.ends[2],)

    def first_sent(self, token: DataToken, now_ns: int) -> int:
        return token[0].first_ns

    def arrived(self, token: DataToken, receiver: int) -> None:
        sample, part, first, beat, _ = token
        if self._smooth and sample.message.size_bytes > wire.TRAIN_BYTES:
            self._quick = self._kernel.now_ns - sample.sent_ns < SOON_NS
        sample.flying -= 1
        closed, take = self._closed, self.writer_proxy.take
        matched = closed != "link_closed" and take(sample, part, first, beat)
        if sample.state != DONE and (closed or sample.state == OPEN):
            self._after_arrival(sample, matched)

    def _after_arrival(self, sample: ReliableSample, matched: bool) -> None:
        """The reader has taken some of ``sample``, if it is ``matched``: drop it if that was of no
        use."""
        closed = self._closed
        if sample.state == OPEN:
            self.settle(sample, closed or ("overwritten" if matched else "unmatched"))
        elif closed and sample.state == HELD:
            self.writer_proxy.drop(closed)  # nobody will bring what it waits for

    def arrived_in_part(self, token: DataToken, receiver: int, lost: dict[int, str]) -> None:
        """A message is lost if any IP packet of it is, and a heartbeat with its message."""
        sample, _, first, beat, messages = token
        whole = wire.whole(messages, lost)
        if not whole or self._closed == "link_closed":
            self.lost(token, receiver, next(iter(lost.values())))
            return
        sample.flying -= 1
        self._record_loss(sample, lost.values())
        for _, part, beats in whole:
            if not self.writer_proxy.take(sample, part, first, beat if beats else NO_HEARTBEAT):
                self._after_arrival(sample, False)
                return
        self._after_arrival(sample, True)

    def lost(self, token: DataToken, receiver: int, reason: str) -> None:
        self.lose(token[0], reason)

    def lose(self, sample: ReliableSample, reason: str) -> None:
        """A frame with fragments of ``sample`` is lost."""
        sample.flying -= 1
        self._record_loss(sample, (reason,))
        self.settle(sample, reason if self._closed else "overwritten")

    def _record_loss(self, sample: ReliableSample, reasons: Iterable[str]) -> None:
        self._smooth = self._quick = False
        for reason in dict.fromkeys(reasons):
            self._context.record_loss(self._from, self._receiver, sample.message.seq, reason)

    def repeated(self, token: DataToken, receiver: int) -> None:
        self.discard_copy(token[0])

    def discard_copy(self, sample: ReliableSample) -> None:
        """The reader recognises a sample that it has already by its number, and discards it."""
        self._context.repeat(sample.message, self._receiver)

"""SEDP: a participant announces its endpoints to every other one, reliably.

The items of the two writers (publications, subscriptions) form one series: their heartbeats and
acknowledgements travel together anyhow. With the first exchange those of the other built-in
writers travel along.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from functools import partial
from typing import TYPE_CHECKING

from desim.middleware.dds import wire
from desim.middleware.dds.endpoint_repairs import TRAIN, SharedRepairs, SingleRepairs
from desim.middleware.dds.outbox import LOOPBACK_NS, OutgoingMessage
from desim.middleware.dds.remote import RemoteParticipant
from desim.middleware.dds.wire import DataKind, DiscoveredData, Guid, SedpMessage
from desim.middleware.timers import NEVER

if TYPE_CHECKING:
    from desim.middleware.dds.participant import Participant
    from desim.ports.middleware import InAdvance

# Until a reader asks again for endpoints that are on their way: NackDelay of Cyclone DDS. Fast DDS
# asks at each heartbeat: six hosts on an access point then send 1.16 of the bytes of real ones, and
# 0.85 with this pause.
ASK_AGAIN_NS = 100_000_000

# A message between two participants: sender, receiver, handler and content. ``handler(endpoints,
# remote, lost, *content)`` reads it; ``lost`` are the packets of its train that did not arrive.
Envelope = tuple[Guid, Guid, Callable[..., object], tuple[object, ...]]


class Endpoints:
    """The discovery of endpoints by the participant ``me``. The methods below "Handlers" read the
    messages of other participants."""

    def __init__(self, me: Participant) -> None:
        self._me = me
        self._constants = me.constants
        self._wire = me.dds.wire
        self._context = me.context
        self._multicast = me.dds.params.allow_multicast == "all"
        self.items: list[DiscoveredData] = []  # those that exist
        # A node's endpoints are made some time after its participant.
        self._exist = False
        name = self._context.hosts[me.host] + f"/node_{me.number}" * bool(me.number)
        self._coming = self._wire.built_in_endpoints(me.guid, name)
        self._beat_ns = NEVER  # when the next heartbeat is due
        self._beats = 0
        self._repairs = (SharedRepairs if self._wire.apart else SingleRepairs)(me, self)

    def write(self, item: DiscoveredData) -> None:
        """Add an endpoint once endpoints exist."""
        if self._exist:
            self._add([item])
        else:
            self._coming.append(item)

    def appear(self, _: object) -> None:
        """From now on endpoints exist."""
        self._exist = True
        self._add(self._coming)

    def _add(self, items: list[DiscoveredData]) -> None:
        me = self._me
        self.items += items
        if me.discovery_server is not None:
            for item in items:
                me.discovery_server.add(item)
            return
        known = me.direct()
        for group in [known] if self._multicast and known else [[remote] for remote in known]:
            self.announce(group)

    # Messages to others.

    def announce(self, remotes: list[RemoteParticipant]) -> None:
        """Send the items that were not sent yet, the same to all of these, by multicast if there
        are several. The next heartbeats reveal a loss."""
        first, last = remotes[0].sent_count, len(remotes[0].out)
        alone = len(self._me.remotes) == 1
        for start in range(first, last, TRAIN):
            numbers = range(start, min(last, start + TRAIN))
            out = remotes[0].out
            messages = self._wire.new_endpoints([out[number] for number in numbers],
                                               self._wire.apart and alone)
            self.send_items(remotes, numbers, messages, None)
        for remote in remotes:
            remote.sent_count = last
        self._beats = 0
        self._book(self._constants.discovery_heartbeat_period_ns)

    def found(self, remote: RemoteParticipant) -> None:
        """Advertisement all items to a new participant, and ask for its own."""
        constants, delay_ns = self._constants, self._constants.initial_acknack_ns
        self._beats = 0
        if constants.initial_heartbeat_ns:
            self._book(constants.initial_heartbeat_ns)
        else:
            self._beat([remote], self._wire.built_in_writers, directed=True)
            self._book(constants.discovery_heartbeat_period_ns)
        if delay_ns is not None:
            self._me.after(delay_ns, self._send_acknack, (remote, delay_ns))

    def send_first_heartbeat(self, remote: RemoteParticipant, topic: str) -> None:
        """Send the first heartbeat of a writer that every node has, because it has matched a reader
        of ``remote``."""
        readers, size = [remote], self._wire.heartbeats(1)
        if self._constants.first_heartbeat_to_all:
            readers = [other for other in self._me.direct()
                       if (DataKind.BUILT_IN_READER, topic) in other.built_in]
            if len(readers) > 1:
                size = self._wire.heartbeat_to_all()
        if self._wire.apart or self._multicast:
            self._send_all("endpoints", readers, [size], Endpoints.heartbeat,
                           lambda other: (topic, other is remote))
            return
        for other in readers:  # for one that had it before it only shows that this one lives
            send = self._send if other is remote else self._send_in_advance
            send("endpoints", other, [size], Endpoints.heartbeat, topic, other is remote)

    def expect_first_heartbeat(self, remote: RemoteParticipant, topic: str) -> None:
        """A reader that every node has, has matched a writer of ``remote``. It asks for a heartbeat
        unless one arrives."""
        delay_ns = self._constants.initial_acknack_ns
        if self._wire.apart and delay_ns is not None and topic not in remote.heard_writers:
            self._me.after(delay_ns, self._send_preemptive_acknack, (remote, topic))

    def _send_preemptive_acknack(self, what: tuple[RemoteParticipant, str]) -> None:
        remote, topic = what
        if topic not in remote.heard_writers and self._me.remotes.get(remote.guid) is remote:
            self._send("acknack", remote, [self._wire.acknacks(1)], Endpoints.preemptive_acknack,
                       topic)

    def assert_liveliness(self, remotes: list[RemoteParticipant]) -> None:
        self._send_all("liveliness", remotes, [self._wire.liveliness()], Endpoints.heartbeat,
                       lambda remote: ("", True))

    def send_items(self, remotes: list[RemoteParticipant], numbers: Sequence[int],
                   messages: list[wire.SedpSize], known: int | None) -> None:
        """Send items of these numbers, the same to all; with ``known`` a heartbeat in the last
        message tells that so many exist."""
        out, at = remotes[0].out, 0
        train: list[SedpMessage] = []
        for size, count in messages:
            part = numbers[at:at + count]
            items = zip(part, map(out.__getitem__, part), strict=True)
            train.append(SedpMessage(size.packets, tuple(items), None))
            at += count
        train[-1] = train[-1]._replace(known=known)
        self._send_all("sedp", remotes, [size for size, _ in messages], Endpoints.receive,
                       lambda remote: (remote.series, tuple(train)))

    def _send(self, kind: str, remote: RemoteParticipant, sizes: list[wire.WireSize],
              handler: Callable[..., object], *content: object) -> None:
        self._send_all(kind, [remote], sizes, handler, lambda _: content)

    def _send_in_advance(self, kind: str, remote: RemoteParticipant, sizes: list[wire.WireSize],
                         handler: Callable[..., object], *content: object) -> None:
        """``_send`` a message that only shows ``remote`` that this participant lives."""
        you = self._me.dds.on(remote.host, remote.number)
        runs = you is not None and you.guid == remote.guid
        self._send_all(kind, [remote], sizes, handler, lambda _: content,
                       partial(self._me.in_advance, remote.number) if runs else None)

    def _send_all(self, kind: str, remotes: list[RemoteParticipant], sizes: list[wire.WireSize],
                  handler: Callable[..., object],
                  content: Callable[[RemoteParticipant], tuple[object, ...]],
                  in_advance: Callable[[int], InAdvance | None] | None = None) -> None:
        """Send messages in one train: by multicast if that is usual and there are several remotes.
        """
        size = sizes[0] if len(sizes) == 1 else wire.together(sizes)
        me, dds = self._me, self._me.dds
        if me.outbox is not None and not self._multicast:
            post = me.outbox.post
            for remote in remotes:
                post(kind, remote.host, OutgoingMessage(size, dds.take, (
                    me.guid, remote.guid, handler, content(remote))))
            return
        for group in [remotes] if self._multicast else [[remote] for remote in remotes]:
            to: dict[int, list[Envelope]] = {}
            for remote in group:
                to.setdefault(remote.host, []).append(
                    (me.guid, remote.guid, handler, content(remote)))
            if me.host in to:
                me.life.after(LOOPBACK_NS, partial(dds.received, {me.host: to.pop(me.host)}),
                              me.host)
            if to:
                self._context.send(kind, me.host, list(to), size.size_bytes, dds.received, to,
                                   segments=size.packets, multicast=len(group) > 1,
                                   in_part=dds.received, in_advance=in_advance,
                                   socket=me.socket)

    def send_heartbeat_soon(self) -> None:
        """Send a heartbeat after the usual period, and the next ones with the shortest pauses: it
        may be lost, or its answer."""
        self._beats = 0
        self._book(self._constants.discovery_heartbeat_period_ns)

    def _book(self, delay_ns: int) -> None:
        """Send a heartbeat at that time, or earlier."""
        due_ns = self._context.now_ns + delay_ns
        if due_ns < self._beat_ns:
            self._beat_ns = due_ns
            self._me.after(delay_ns, self._heartbeat, due_ns)

    def _heartbeat(self, due_ns: int) -> None:
        """Send heartbeats to those that have not acknowledged everything; of Fast DDS, then to all.
        """
        if self._beat_ns != due_ns:
            return
        self._beat_ns = NEVER
        constants = self._constants
        known = self._me.direct()
        behind = [remote for remote in known
                  if not remote.answered or remote.acked_count < remote.sent_count]
        if not behind:
            return
        new = [remote for remote in behind if not remote.answered]
        self._beat(new, self._wire.built_in_writers, directed=False)
        others = known if constants.discovery_heartbeats_all else behind
        self._beat([remote for remote in others if remote.answered], 2, directed=False)
        self._beats += 1
        self._book(min(constants.discovery_heartbeat_limit_ns,
                       constants.discovery_heartbeat_period_ns
                       << min(16, max(0, self._beats - 2))))

    def _beat(self, remotes: list[RemoteParticipant], writers: int, *, directed: bool) -> None:
        """Send a heartbeat of each of so many writers."""
        for spent in self._repairs.spent:
            spent.sent()
        self.send_heartbeats(remotes, writers, directed=directed)

    def send_heartbeats(self, remotes: list[RemoteParticipant], count: int, *, directed: bool
                        ) -> None:
        """Send so many heartbeats, each of one writer."""
        if remotes and count:
            sizes = [self._wire.heartbeats(count)] if directed or not self._wire.apart \
                else [self._wire.heartbeat_to_all()] * count
            self._send_all("sedp_heartbeat", remotes, sizes, Endpoints.heartbeats,
                           lambda remote: (remote.series, remote.sent_count, count, directed))

    # Handlers.

    def acknack(self, remote: RemoteParticipant, _: Collection[int], series: int, got: int,
                     missing: tuple[int, ...], asks: bool) -> None:
        """``remote`` has the first ``got`` items of a series and lacks those ``missing``; with
        ``asks`` it wants a heartbeat. If the series is an earlier one, it has none of the present
        items."""
        first = not remote.answered
        if first:
            remote.answered = True
            if self._me.asserting_ns:
                self.assert_liveliness([remote])
        if series != remote.series:
            got, missing, asks = 0, (), True
        remote.acked_count = got
        if missing:
            self._repairs.request(remote, missing)
        elif asks:
            self._me.thread.answer((remote.guid, "asks"), self._answer_preemptive, (remote, first))

    def _answer_preemptive(self, what: tuple[RemoteParticipant, bool]) -> None:
        remote, first = what
        writers = self._wire.built_in_writers if first else 2
        self._beat([remote], writers, directed=True)
        # It may be lost, or its answer.
        self._book(self._constants.discovery_heartbeat_period_ns)

    def receive(self, remote: RemoteParticipant, lost: Collection[int], series: int,
                train: Sequence[SedpMessage]) -> None:
        """Items have arrived, in messages of a train without the packets ``lost``."""
        if not self._goes_on(remote, series):
            return
        known, held = None, remote.held
        for message in wire.whole(train, lost):
            known = message.known
            for number, item in message.items:
                if number >= remote.got:
                    held[number] = item
        learn = self._me.learn
        while remote.got in held:
            item = held.pop(remote.got)
            remote.got += 1
            learn(remote, item)
        if known is not None:
            self.heartbeats(remote, (), series, known, 2, True)

    def heartbeats(self, remote: RemoteParticipant, lost: Collection[int], series: int, known: int,
                   count: int, directed: bool) -> None:
        """So many heartbeats, maybe ``directed`` to this participant alone: ``known`` items exist.
        """
        if not self._goes_on(remote, series):
            return
        remote.known = max(remote.known, known)
        if directed:
            remote.nack_timing.directed = True
        count -= len(lost)
        remote.beating = max(remote.beating, count)
        if not remote.answering:
            remote.answering = True
            self._me.after(self._constants.discovery_heartbeat_response_ns, self._answer, remote)
        elif self._wire.apart and not self._me.thread.stands:
            # It answers each, as they are further apart than its response delay.
            self._me.after(self._constants.discovery_heartbeat_response_ns, self._acknowledge,
                           (remote, count))

    def _acknowledge(self, what: tuple[RemoteParticipant, int]) -> None:
        remote, readers = what
        self._send("sedp_acknack", remote, [self._wire.acknacks(readers)], Endpoints.acknack,
                   remote.received_series, remote.got, (), False)

    def _goes_on(self, remote: RemoteParticipant, series: int) -> bool:
        """Whether a message belongs to the present series. A message of a later one begins that."""
        if series > remote.received_series:
            remote.begin(series)
            self._me.after(remote.lease_ns, self._me.forget_others, (remote, series))
        return series == remote.received_series

    def _answer(self, remote: RemoteParticipant) -> None:
        """Acknowledge, and ask for what is missing if that was not done just now."""
        now_ns = self._context.now_ns
        missing = tuple(range(remote.got, remote.known))
        if remote.held:
            missing = tuple([number for number in missing if number not in remote.held])
        if missing:
            first = missing[0], 0
            wait_ns = remote.nack_timing.wait_ns(first, now_ns, ASK_AGAIN_NS)
            if wait_ns:
                self._me.after(wait_ns, self._answer, remote)
                return
            remote.nack_timing.requests(first, (missing[-1] + 1, 0), now_ns)
        remote.answering = False
        readers = remote.beating if remote.asked else self._wire.built_in_writers
        remote.asked, remote.beating = True, 0
        self._send("sedp_acknack", remote, [self._wire.acknacks(readers, len(missing))],
                   Endpoints.acknack, remote.received_series, remote.got, missing, False)

    def _send_acknack(self, what: tuple[RemoteParticipant, int]) -> None:
        """Ask for a first heartbeat, and repeat that after pauses that double."""
        remote, delay_ns = what
        if remote.asked or self._me.remotes.get(remote.guid) is not remote:
            return
        self._send("sedp_acknack", remote, [self._wire.acknacks(self._wire.built_in_writers)],
                   Endpoints.acknack, remote.received_series, remote.got, (), True)
        limit_ns = self._constants.initial_acknack_limit_ns
        delay_ns = min(2 * delay_ns, self._me.announcing_ns if limit_ns is None else limit_ns)
        self._me.after(delay_ns, self._send_acknack, (remote, delay_ns))

    def heartbeat(self, remote: RemoteParticipant, _: Collection[int], topic: str, new: bool
                  ) -> None:
        """A heartbeat of a writer that every node has, or of liveliness (no topic): a reader that
        is ``new`` to it answers if it knows the writer."""
        if not self._wire.apart:
            if new:
                self._acknowledge_writer(remote)
        elif not topic or (DataKind.BUILT_IN_WRITER, topic) in remote.built_in:
            remote.heard_writers[topic] = None
            self._me.after(self._constants.heartbeat_response_ns, self._acknowledge_writer, remote)

    def _acknowledge_writer(self, remote: RemoteParticipant) -> None:
        self._send_in_advance("acknack", remote, [self._wire.acknacks(1)], Endpoints.alive)

    def preemptive_acknack(self, remote: RemoteParticipant, _: Collection[int], topic: str) -> None:
        """A reader wants the heartbeat of a writer that every node has."""
        if (DataKind.BUILT_IN_READER, topic) in remote.built_in:
            self.send_first_heartbeat(remote, topic)

    def alive(self, remote: RemoteParticipant, _: Collection[int]) -> None:
        """The message shows that the remote lives, which renews its lease; that is all."""

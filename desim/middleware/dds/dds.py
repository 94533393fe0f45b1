"""The middleware ``dds``: the participants of a run, and the messages between them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from functools import lru_cache

from desim.engine.kernel import Phase, pair
from desim.errors import InputError, host_index
from desim.middleware.dds.blocked_calls import BlockedCalls
from desim.middleware.dds.domains import check_ports, domains_of
from desim.middleware.dds.endpoints import Envelope
from desim.middleware.dds.parameters import CYCLONE, DdsParams
from desim.middleware.dds.participant import Participant
from desim.middleware.dds.reader_proxy import ReaderProxy
from desim.middleware.dds.remote import NOBODY, RemoteParticipant
from desim.middleware.dds.stateful_writer import StatefulWriter
from desim.middleware.dds.stateless_writer import StatelessWriter
from desim.middleware.dds.wire import LONG_TRAIN_BYTES, Guid, SampleTrain
from desim.middleware.timers import Timers
from desim.ports.middleware import (
    Addressing,
    Advertisement,
    Endpoint,
    MiddlewareContext,
    Transport,
    TransportKind,
)

# Cuts a sample of so many bytes into trains, with heartbeats on some of its messages.
Cuts = Callable[[int, tuple[bool, ...]], tuple[SampleTrain, ...]]


class Dds:
    """A participant per host, as if all of its nodes were one process (ROS 2 components), with a
    writer and a reader per topic; and further ones, if wanted, without topics of the fleet. A
    stream is reliable, a datagram best effort; a latched topic is ``transient_local``.
    ``participants`` are the first ones of hosts that run; ``matches`` counts the changes of matches
    between readers and writers."""

    Params = DdsParams
    informed = "subscriber"

    def __init__(self, params: DdsParams | None = None) -> None:
        self.params = DdsParams() if params is None else params
        self.constants = self.params.constants
        self.server: int | None = None
        self.matches = 0
        self.wire = self.params.wire
        fragment_bytes, most = self.constants.fragment_bytes, self.constants.message_fragments
        # Functions of a sample's bytes and of the messages with heartbeats, called with each.
        self.message_sizes = lru_cache(1 << 12)(
            lambda size_bytes: self.wire.messages(size_bytes, fragment_bytes, most))
        self.trains: Cuts = lru_cache(1 << 12)(lambda size_bytes, beats: self.wire.trains(
            size_bytes, fragment_bytes, most, beats))
        self.long_trains: Cuts = lru_cache(1 << 12)(lambda size_bytes, beats: self.wire.trains(
            size_bytes, fragment_bytes, most, beats, LONG_TRAIN_BYTES))
        self.heartbeat_size, self.acknack_size = self.wire.heartbeats(1), self.wire.acknacks(1)

    def domains(self, hosts: Sequence[str]) -> list[int]:
        params = self.params
        found = domains_of(hosts, params.domain, params.domains)
        if params.discovery == "server" and len({*found}) > 1:
            raise InputError(".domains: all hosts are clients of one discovery server, which is "
                             "not modelled for several domains; allowed: one domain")
        if params.preset not in CYCLONE:  # whose participants take ports that Linux chooses
            check_ports(found, params.participants)
        return found

    def start(self, context: MiddlewareContext) -> None:
        params, hosts = self.params, context.hosts
        self._domains = self.domains(hosts)
        if params.server is not None:
            self.server = host_index("server", params.server, hosts)
        for name in params.leases:
            host_index("leases", name, hosts)
        if (params.discovery == "server") != (params.server is not None):
            raise InputError(".server: the host of the discovery server is wanted with discovery: "
                             "server, and only then")
        self.context = context
        self.timers = Timers(context.kernel, self.constants.heartbeat_period_ns // 4)
        self.leases_ns = [params.leases.get(host, params.lease_ns) for host in hosts]
        self.participants: dict[int, Participant] = {}
        self._processes: list[tuple[Participant, ...]] = [()] * len(hosts)
        self._writers: list[dict[str, list[StatefulWriter]]] = [{} for _ in hosts]
        self._proxies: dict[tuple[int, int, str], list[ReaderProxy]] = {}
        self._calls: dict[tuple[int, str], BlockedCalls] = {}

    def switched(self, host: int, up: bool) -> None:
        former, self._processes[host] = self._processes[host], ()
        for process in former:
            process.life.end()
            for remote in process.remotes.values():
                self.book_arrivals(remote, host)
        if former:
            del self.participants[host]
            for (_, receiver, _), proxies in self._proxies.items():
                for proxy in proxies if receiver == host else ():
                    proxy.writer_proxy.drop("host_down")
            self._writers[host] = {}
        self.matches += 1
        if up:
            count = 1 if host == self.server else self.params.participants
            self._processes[host] = tuple(Participant(self, (host, self.context.life(host), number))
                                          for number in range(count))
            self.participants[host] = self._processes[host][0]

    def pairs(self) -> tuple[int, int]:
        """``CountsPairs``. The server's client has to know what the server has for it."""
        processes = [one for several in self._processes for one in several]
        items = {one.guid: len(one.endpoints.items) for one in processes}
        if self.server is None:
            domains = [self._domains[one.host] for one in processes]
            matched = sum([0 < items.get(remote.guid, 0) <= remote.got
                           for one in processes for remote in one.remotes.values()
                           if remote.direct])
            return matched, sum(map(domains.count, domains)) - len(domains)
        server = self.participants.get(self.server)
        clients = [] if server is None else server.direct()
        found = sum(0 < items.get(remote.guid, 0) <= remote.got for remote in clients)
        known = sum(remote.answered and remote.acked_count >= len(remote.out) for remote in clients)
        return found + known, 2 * sum(one.host != self.server for one in processes)

    def on(self, host: int, number: int) -> Participant | None:
        """The participant of this number that runs on ``host``."""
        processes = self._processes[host]
        return processes[number] if number < len(processes) else None

    def advertise(self, advertised: Advertisement) -> None:
        self.participants[advertised.publisher.host].advertise(advertised.publisher.topic)

    def subscribe(self, subscriber: Endpoint) -> None:
        known = subscriber.topic in self.participants[subscriber.host].readers
        self.participants[subscriber.host].subscribe(subscriber.topic)
        if not known:
            self.context.changed(subscriber.topic)

    def subscribers(self, publisher: Endpoint) -> tuple[Endpoint, ...]:
        """The hosts whose readers the publisher's participant has matched; its own host is among
        them if it has a reader."""
        me, topic = self.participants[publisher.host], publisher.topic
        hosts = {remote.host: None for remote in me.remotes.values() if topic in remote.readers}
        if topic in me.readers:
            hosts[me.host] = None
        return tuple([Endpoint(host, "", topic) for host in sorted(hosts)])

    def transport(self, advertised: Advertisement) -> Transport:
        if advertised.transport != TransportKind.STREAM or advertised.via != Addressing.UNICAST:
            return StatelessWriter(self, advertised)
        writer, (host, _, topic) = StatefulWriter(self, advertised), advertised.publisher
        self._writers[host].setdefault(topic, []).append(writer)
        return writer

    def calls(self, host: int, node: str) -> BlockedCalls:
        """The calls of ``node`` that wait."""
        return self._calls.setdefault((host, node), BlockedCalls(self, host, node))

    def changed(self, host: int, topic: str) -> None:
        """``host`` has matched a reader of ``topic``, or lost one."""
        self.matches += 1
        for writer in self._writers[host].get(topic, ()):
            writer.matches()
        self.context.changed(topic)

    # Matches, for transports.

    def reader(self, host: int, receiver: int, topic: str) -> Guid:
        """The participant on ``receiver`` whose reader a writer of ``host`` has matched, the
        latest if there are several."""
        found = NOBODY
        for guid, remote in self.participants[host].remotes.items():
            if guid[0] == receiver and guid > found and guid[2] == 0 and topic in remote.readers:
                found = guid
        return found

    def writer(self, guid: Guid, receiver: int, topic: str) -> RemoteParticipant | None:
        """The state that ``receiver`` keeps of ``guid``, if it reads its ``topic``."""
        me = self.participants.get(receiver)
        if me is None or topic not in me.readers:
            return None
        remote = me.remotes.get(guid)
        return remote if remote is not None and topic in remote.writers else None

    def linked(self, proxy: ReaderProxy) -> None:
        """Register ``proxy``, which is open, under its two ends."""
        self._proxies.setdefault(proxy.ends, []).append(proxy)

    def unlinked(self, proxy: ReaderProxy) -> None:
        """``proxy`` closes. Its writer's participant keeps the instant of the last acknowledgement.
        """
        self._proxies[proxy.ends].remove(proxy)
        remote = self.participants[proxy.ends[0]].remotes.get(proxy.guid)
        if remote is not None:
            self._renew_lease(proxy, remote)

    def take_acknowledgements(self, me: Participant, remote: RemoteParticipant) -> None:
        """Renew the lease of ``remote`` at ``me`` by its acknowledgements."""
        for (host, receiver, _), proxies in self._proxies.items():
            if host == me.host and receiver == remote.host:
                for proxy in proxies:
                    self._renew_lease(proxy, remote)

    def _renew_lease(self, proxy: ReaderProxy, remote: RemoteParticipant) -> None:
        proxy.take_acknowledgements(self.context.now_ns)
        if proxy.guid == remote.guid and proxy.received_ns > remote.received_ns:
            remote.received_ns = proxy.received_ns

    def book_arrivals(self, remote: RemoteParticipant, receiver: int) -> None:
        """``receiver`` forgets ``remote``: arrivals that it had taken in advance become events."""
        context = self.context
        ids = context.host_ids
        remote.take_arrivals(context.now_ns)
        for time_ns, arrived, token in remote.coming:
            context.kernel.at(time_ns, Phase.DELIVER, pair(ids[remote.host], ids[receiver]),
                              lambda what: what[0](what[1], receiver), (arrived, token))

    # Messages for participants, which may have gone meanwhile.

    def joined(self, me: Participant, remote: RemoteParticipant, topic: str) -> None:
        """A reader of participant ``me`` has matched a writer."""
        for proxy in self._proxies.get((remote.host, me.host, topic), ()):
            proxy.writer_proxy.joined()

    def announced(self, token: tuple[tuple[Guid, int], bool, int | None], receiver: int,
                  lost: Collection[int] = ()) -> None:
        """An announcement has arrived at ``receiver``, for all of its participants or for one. That
        of another domain came to a port where nobody listens."""
        if lost:
            return
        (guid, lease_ns), wants_response, number = token
        processes = self._processes[receiver]
        for me in processes if number is None else processes[number:number + 1]:
            if me.guid == guid:
                continue
            remote = me.remotes.get(guid)
            if remote is not None and remote.direct:  # as nearly always
                remote.received_ns = self.context.now_ns
            elif me.awake and self._domains[receiver] == self._domains[guid[0]] and (
                    self.server is None or self.server in (receiver, guid[0])):
                me.announced(guid, lease_ns, wants_response)

    def received(self, to: dict[int, list[Envelope]], receiver: int, lost: Collection[int] = ()
                 ) -> None:
        """A message of a participant has arrived at ``receiver``, or a train of messages without
        the packets ``lost``."""
        for envelope in to[receiver]:
            self.take(envelope, receiver, lost)

    def take(self, envelope: Envelope, receiver: int, lost: Collection[int]) -> None:
        """The same for one of its participants. A message from an unknown participant or for a
        former life is not read. Of several heartbeats or acknowledgements in one train any stands
        for all."""
        sender, guid, handler, content = envelope
        number, processes = guid[2], self._processes[receiver]  # ``on`` without its call
        if number >= len(processes) or (me := processes[number]).guid != guid:
            return
        remote = me.remotes.get(sender)
        if remote is not None and remote.direct:
            remote.received_ns = self.context.now_ns
            handler(me.endpoints, remote, lost, *content)

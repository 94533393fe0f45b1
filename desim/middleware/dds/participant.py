"""A participant: one process of a host, from the host's start to its stop.

It announces itself (SPDP), keeps a lease on each participant that it knows, and matches endpoints.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING

from desim.middleware.dds.discovery_server import DiscoveryServer
from desim.middleware.dds.endpoints import Endpoints
from desim.middleware.dds.event_thread import EventThread
from desim.middleware.dds.outbox import LOOPBACK_NS, Outbox, OutgoingMessage
from desim.middleware.dds.remote import RemoteParticipant
from desim.middleware.dds.wire import QUEUED, TYPE_NAME, DataKind, DiscoveredData, Guid, WireSize
from desim.middleware.timers import Lifetime
from desim.ports.middleware import HostState

if TYPE_CHECKING:
    from desim.middleware.dds.dds import Dds
    from desim.ports.middleware import InAdvance


class Participant:
    """One participant, the ``number``-th of its host: the first, 0, has the topics of the fleet,
    the others a node's own endpoints alone. ``remotes``: the participants that it believes in, in
    the order of discovery. Any message from one renews its lease, whose length that participant has
    announced."""

    def __init__(self, dds: Dds, guid: Guid) -> None:
        self.dds, self.context, self.constants = dds, dds.context, dds.constants
        self.guid = guid
        host, life, number = guid
        self.host, self.number = host, number
        self._others = [other for other in range(len(self.context.hosts)) if other != host]
        self.life = Lifetime(self.context, host)
        socket = self.socket = self.context.socket(
            host, "rtps" + f"_{number}" * bool(number))
        several = dds.params.participants > 1
        self.outbox = Outbox(self.context, host, socket) if several else None
        self.thread = EventThread(self.life, socket, self.outbox)
        self.after = self.thread.after
        self.remotes: dict[Guid, RemoteParticipant] = {}
        self.writers: dict[str, None] = {}  # topics
        self.readers: dict[str, None] = {}
        self.resent_bytes = 0  # retransmitted since its start
        self.discovery_server = DiscoveryServer(self) if dds.server == host else None
        self._series = 0  # begun so far, by a server
        self.endpoints = Endpoints(self)
        lease_ns = dds.leases_ns[host]
        self._announcement = (self.guid, lease_ns)
        self.announcing_ns = self.constants.announcing_ns(lease_ns)
        self.asserting_ns = self.constants.asserting_ns(lease_ns)
        self.awake = False
        spread_ns = self.constants.start_spread_ns
        if spread_ns:
            name = ("start", self.context.hosts[host], life, number)
            stream = self.context.stream(*name[:4 if number else 3])
            self.after(int(stream.integers(spread_ns)), self._wake)
        else:
            self._wake(None)

    def _wake(self, _: object) -> None:
        """The process runs: from now on it sends and receives."""
        self.awake = True
        self._announce(0)
        self.after(self.constants.endpoint_delay_ns, self.endpoints.appear)
        if self.asserting_ns:
            self.after(self.asserting_ns, self._assert_liveliness)

    # Its own endpoints.

    def advertise(self, topic: str) -> None:
        if topic not in self.writers:
            self.writers[topic] = None
            self.endpoints.write(DiscoveredData(
                self.guid, DataKind.WRITER, topic,
                self.dds.wire.writer_bytes("rt" + topic, TYPE_NAME, QUEUED)))

    def subscribe(self, topic: str) -> None:
        if topic not in self.readers:
            self.readers[topic] = None
            self.endpoints.write(DiscoveredData(
                self.guid, DataKind.READER, topic,
                self.dds.wire.reader_bytes("rt" + topic, TYPE_NAME, QUEUED)))
            for remote in self.remotes.values():
                if topic in remote.writers:
                    self._reads(remote, topic)

    # Other participants.

    def of(self, host: int, number: int = 0) -> Iterator[RemoteParticipant]:
        """The participants on ``host`` of this number: the one that runs, and its former lives that
        are believed in."""
        return (remote for remote in self.remotes.values()
                if remote.host == host and remote.number == number)

    def _leads(self, remote: RemoteParticipant) -> bool:
        """Whether both are the first of their hosts, which alone have topics and beliefs."""
        return self.number == remote.number == 0

    def direct(self) -> list[RemoteParticipant]:
        """The participants with which this one exchanges messages."""
        return [remote for remote in self.remotes.values() if remote.direct]

    def _announce(self, k: int) -> None:
        """Announce this participant for the k-th time: a client of a server to that server alone,
        the server to its clients."""
        constants, dds = self.constants, self.dds
        known = self.direct()
        period_ns = self.announcing_ns
        if dds.server is None:
            self._announce_to_all(constants.first_times if k == 0 else 1,
                                  known if k and dds.params.allow_multicast == "spdp" else [])
            if k + 1 < constants.initial_announcements:
                period_ns = constants.initial_period_ns
        elif dds.server == self.host:
            self._announce_to_each(known)
        else:
            self._announce_to([dds.server], dds.wire.announcement(), 0, calls=True)
            if not known:
                period_ns = constants.server_period_ns
        self.after(period_ns, self._announce, k + 1)

    def _announce_to_all(self, times: int, known: list[RemoteParticipant]) -> None:
        """Announce this participant by multicast, and to each participant that is ``known``."""
        self._announce_to(self._others, self.dds.wire.announcement(times), None)
        self._announce_to_each(known)

    def _announce_to_each(self, known: list[RemoteParticipant]) -> None:
        by_number: dict[int, list[int]] = {}
        for remote in known:
            by_number.setdefault(remote.number, []).append(remote.host)
        for number, hosts in by_number.items():
            self._announce_to(hosts, self.dds.wire.announcement(), number)

    def _announce_to(self, hosts: list[int], size: WireSize, number: int | None, calls: bool = False
                     ) -> None:
        """Announce this participant to those of this ``number`` on ``hosts``; without one to all,
        by multicast, which those of this host hear, too."""
        multicast = number is None
        token = self._announcement, multicast or calls, number
        away = [host for host in hosts if host != self.host]
        if self.outbox is not None and not multicast:
            for host in away:
                self.outbox.post("spdp", host, OutgoingMessage(size, self.dds.announced, token))
            away = []
        if self.outbox is not None and (multicast or len(away) < len(hosts)):
            self.life.after(LOOPBACK_NS, partial(self.dds.announced, token), self.host)
        if away:
            self.context.send("spdp", self.host, away, size.size_bytes, self.dds.announced, token,
                              segments=size.packets, multicast=multicast,
                              in_advance=None if number is None
                              else partial(self.in_advance, number), socket=self.socket)

    def in_advance(self, number: int, host: int) -> InAdvance | None:
        """A shortcut for messages that only show that this participant lives: a function that notes
        the arrival at ``host`` at once, without an event. None if the participant of this
        ``number`` there does not know this one from itself."""
        you = self.dds.on(host, number)
        remote = None if you is None else you.remotes.get(self.guid)
        if remote is None or not remote.direct:
            return None
        remote.take_arrivals(self.context.now_ns)
        return lambda *arrival: remote.coming.append(arrival)

    def announced(self, guid: Guid, lease_ns: int, wants_response: bool) -> None:
        """Meet a participant that was unknown, or known only through a server."""
        self.thread.answer(guid, self._find, (guid, lease_ns, wants_response))

    def _find(self, announcement: tuple[Guid, int, bool]) -> None:
        guid, lease_ns, wants_response = announcement
        self._series += self.discovery_server is not None
        remote = RemoteParticipant(guid, lease_ns, self.context.now_ns, True,
                                   [] if self.discovery_server else self.endpoints.items,
                                   self._series)
        self._meet(remote)
        self.after(lease_ns, self._check_lease, remote)
        if self.constants.announces_when_found and self.dds.server is None:
            self._announce_to_all(1, self.direct())
        if wants_response:
            self._respond((remote, self.constants.responses if self.dds.server is None else 1))
        self.endpoints.found(remote)

    def _meet(self, remote: RemoteParticipant) -> None:
        self.remotes[remote.guid] = remote
        if self._leads(remote):
            self.context.sees(self.host, remote.host, HostState.ONLINE)

    def _respond(self, what: tuple[RemoteParticipant, int]) -> None:
        """Announce this participant to a newcomer, which may not have heard of it."""
        remote, times = what
        if times and self.remotes.get(remote.guid) is remote:
            self._announce_to_each([remote])
            if times > 1:
                self.after(self.constants.response_period_ns, self._respond, (remote, times - 1))

    def _check_lease(self, remote: RemoteParticipant) -> None:
        """Lose ``remote`` if its lease has ended."""
        if self.remotes.get(remote.guid) is not remote:
            return
        now_ns = self.context.now_ns
        remote.take_arrivals(now_ns)
        if remote.received_ns + remote.lease_ns <= now_ns and self._leads(remote):
            self.dds.take_acknowledgements(self, remote)
        left_ns = remote.received_ns + remote.lease_ns - now_ns
        if left_ns > 0:
            self.after(left_ns, self._check_lease, remote)
        else:
            self.lose(remote)

    def lose(self, remote: RemoteParticipant) -> None:
        """Forget a participant that is gone, with its endpoints."""
        del self.remotes[remote.guid]
        self.dds.book_arrivals(remote, self.host)
        context, dds, left = self.context, self.dds, list(self.of(remote.host))
        if self._leads(remote) and not left:
            context.sees(self.host, remote.host, HostState.REMOVED)
        for topic in remote.writers:
            if topic in self.readers and not any(topic in other.writers for other in left):
                context.knows(self.host, remote.host, topic, False)
        dds.matches += 1
        for topic in remote.readers:
            if topic in self.writers:
                dds.changed(self.host, topic)
        if self.discovery_server is not None:
            self.discovery_server.forget(remote.guid)

    # Matching.

    def learn(self, source: RemoteParticipant, item: DiscoveredData) -> None:
        """Take an item that ``source`` announces, unless it is of this one's former lives."""
        owner, kind, topic, _ = item
        if owner[0] == self.host and owner[2] == self.number:
            return
        source.named[owner] = None
        if kind == DataKind.GONE:
            if owner in self.remotes and not self.remotes[owner].direct:
                self.lose(self.remotes[owner])
            return
        remote = source if owner == source.guid else self._known_through_server(owner)
        if kind == DataKind.WRITER:
            remote.writers[topic] = None
            if topic in self.readers:
                self._reads(remote, topic)
        elif kind == DataKind.READER:
            remote.readers[topic] = None
            if topic in self.writers:
                self.dds.changed(self.host, topic)
        elif topic:  # of an endpoint that every node has
            remote.built_in[kind, topic] = None
            if kind == DataKind.BUILT_IN_READER:
                self.endpoints.send_first_heartbeat(remote, topic)
            elif kind == DataKind.BUILT_IN_WRITER:
                self.endpoints.expect_first_heartbeat(remote, topic)
        if self.discovery_server is not None:
            self.discovery_server.add(item)

    def _known_through_server(self, owner: Guid) -> RemoteParticipant:
        """The participant that a server announces. A new life of a host ends beliefs in old ones.
        """
        remote = self.remotes.get(owner)
        if remote is None:
            remote = RemoteParticipant(owner, 0, self.context.now_ns, False, [])
            former = [other for other in self.of(owner[0], owner[2])
                      if not other.direct and other.guid < owner]
            self._meet(remote)
            for other in former:
                self.lose(other)
        return remote

    def forget_others(self, what: tuple[RemoteParticipant, int]) -> None:
        """Forget the participants that no server has named: a server has had the time of its lease
        to announce all anew."""
        server, series = what
        if self.remotes.get(server.guid) is not server or server.received_series != series:
            return
        direct = [remote for remote in self.remotes.values() if remote.direct]
        for remote in list(self.remotes.values()):
            if not (remote.direct or any(remote.guid in other.named for other in direct)):
                self.lose(remote)

    def _reads(self, remote: RemoteParticipant, topic: str) -> None:
        """A reader of ``topic`` on this host has matched a writer."""
        self.dds.matches += 1
        self.context.knows(self.host, remote.host, topic, True)
        self.dds.joined(self, remote, topic)

    def _assert_liveliness(self, _: object) -> None:
        self.endpoints.assert_liveliness(self.direct())
        self.after(self.asserting_ns, self._assert_liveliness)

"""The middleware ``dds``: the participants of a run, and what travels between them."""

from __future__ import annotations

from collections.abc import Collection
from functools import lru_cache, partial
from typing import Any

from desim.engine.kernel import Phase, pair
from desim.errors import InputError, did_you_mean
from desim.middleware.dds.best_effort import BestEffort
from desim.middleware.dds.parameters import DdsParams
from desim.middleware.dds.participant import Participant
from desim.middleware.dds.reliable import ReliableLink
from desim.middleware.dds.remote import Guid, Remote
from desim.middleware.dds.wire import LONG_TRAIN_BYTES
from desim.middleware.dds.writer import Reliable
from desim.middleware.timers import Timers
from desim.ports.middleware import Endpoint, MiddlewareContext, Offer, Transport

To = dict[int, tuple[Any, ...]]  # by host: who says it, to which life of it, and what


class Dds:
    """One participant per host, as if all of its nodes were one process (ROS 2 components); a
    writer and a reader per host and topic. A stream is reliable, a datagram best effort; a latched
    topic is ``transient_local``. ``matches`` counts changes of who reads whom."""

    Params = DdsParams
    informed = "subscriber"

    def __init__(self, params: DdsParams | None = None) -> None:
        self.params = DdsParams() if params is None else params
        self.server: int | None = None
        self.matches = 0
        self.wire = self.params.wire
        cut = {"fragment_bytes": self.params.fragment_bytes,
               "most": self.params.message_fragments}
        # Of a sample's bytes and on what heartbeats ride, asked for with every message.
        self.message_sizes = lru_cache(1 << 12)(partial(self.wire.messages, **cut))
        self.trains = lru_cache(1 << 12)(
            lambda size_bytes, beats: self.wire.trains(size_bytes, **cut, beats=beats))
        self.long_trains = lru_cache(1 << 12)(lambda size_bytes, beats: self.wire.trains(
            size_bytes, **cut, beats=beats, train_bytes=LONG_TRAIN_BYTES))
        self.beat_chunk, self.ack_chunk = self.wire.heartbeats(1), self.wire.acknacks(1)

    def start(self, context: MiddlewareContext) -> None:
        params, hosts = self.params, context.hosts
        named = [("server", params.server)] if params.server is not None else []
        for key, name in [*named, *(("leases", name) for name in params.leases)]:
            if name not in hosts:
                raise InputError(f".{key}: no host {name!r}{did_you_mean(name, hosts)}; allowed: "
                                 f"{', '.join(hosts)}")
        if (params.discovery == "server") != (params.server is not None):
            raise InputError(".server: the host of the discovery server is wanted with discovery: "
                             "server, and only then")
        self.context = context
        self.timers = Timers(context.kernel, params.heartbeat_period_ns // 4)
        self.leases_ns = [params.leases.get(host, params.lease_ns) for host in hosts]
        self.participants: list[Participant | None] = [None] * len(hosts)
        self._lives = [0] * len(hosts)
        self._writers: list[dict[str, list[Reliable]]] = [{} for _ in hosts]
        self._links: dict[tuple[int, int, str], list[ReliableLink]] = {}
        if params.server is not None:
            self.server = hosts.index(params.server)

    def switched(self, host: int, up: bool) -> None:
        former = self.participants[host]
        if former is not None:
            former.alive = False
            self.participants[host] = None
            for remote in former.remotes.values():
                self.hears_later(remote, host)
            for (_, receiver, _), links in self._links.items():
                for link in links if receiver == host else ():
                    link.forgotten()
            self._writers[host] = {}
        self.matches += 1
        if up:
            self._lives[host] += 1
            self.participants[host] = Participant(self, host, self._lives[host])

    def advertise(self, offer: Offer) -> None:
        self.participants[offer.publisher.host].advertise(offer.publisher.topic)

    def subscribe(self, subscriber: Endpoint) -> None:
        known = subscriber.topic in self.participants[subscriber.host].readers
        self.participants[subscriber.host].subscribe(subscriber.topic)
        if not known:
            self.context.changed(subscriber.topic)

    def subscribers(self, publisher: Endpoint) -> tuple[Endpoint, ...]:
        """The hosts whose readers the publisher's participant has matched, and its own."""
        me, topic = self.participants[publisher.host], publisher.topic
        hosts = {remote.host: None for remote in me.remotes.values() if topic in remote.readers}
        if topic in me.readers:
            hosts[me.host] = None
        return tuple(Endpoint(host, "", topic) for host in sorted(hosts))

    def transport(self, offer: Offer) -> Transport:
        if offer.transport != "stream" or offer.via != "unicast":
            return BestEffort(self, offer)
        writer, (host, _, topic) = Reliable(self, offer), offer.publisher
        self._writers[host].setdefault(topic, []).append(writer)
        return writer

    def changed(self, host: int, topic: str) -> None:
        """``host`` has matched a reader of ``topic``, or lost one."""
        self.matches += 1
        for writer in self._writers[host].get(topic, ()):
            writer.matches()
        self.context.changed(topic)

    # What transports ask.

    def reader(self, host: int, receiver: int, topic: str) -> Guid | None:
        """The participant on ``receiver`` whose reader a writer of ``host`` has matched, the
        latest if there are several."""
        me = self.participants[host]
        return max((remote.guid for remote in me.of(receiver) if topic in remote.readers),
                   default=None)

    def writer(self, guid: Guid, receiver: int, topic: str) -> Remote | None:
        """What ``receiver`` knows of ``guid`` if it reads its ``topic``."""
        me = self.participants[receiver]
        remote = None if me is None else me.remotes.get(guid)
        if remote is None or topic not in remote.writers or topic not in me.readers:
            return None
        return remote

    def linked(self, link: ReliableLink) -> None:
        """``link`` is open."""
        self._links.setdefault(link.ends, []).append(link)

    def unlinked(self, link: ReliableLink) -> None:
        """``link`` closes. Its writer's participant remembers when it last heard from there."""
        self._links[link.ends].remove(link)
        remote = self.participants[link.ends[0]].remotes.get(link.guid)
        if remote is not None:
            self._heard(link, remote)

    def look(self, me: Participant, remote: Remote) -> None:
        """Let ``me`` see what acknowledgements it has heard of ``remote``."""
        for (host, receiver, _), links in self._links.items():
            if host == me.host and receiver == remote.host:
                for link in links:
                    self._heard(link, remote)

    def _heard(self, link: ReliableLink, remote: Remote) -> None:
        link.look(self.context.now_ns)
        if link.guid == remote.guid and link.heard_ns > remote.heard_ns:
            remote.heard_ns = link.heard_ns

    def hears_later(self, remote: Remote, receiver: int) -> None:
        """``receiver`` forgets ``remote``: what it took note of before it is there it hears."""
        context = self.context
        ids = context.host_ids
        remote.look(self.context.now_ns)
        for due_ns, heard, token in remote.coming:
            context.kernel.at(due_ns, Phase.DELIVER, pair(ids[remote.host], ids[receiver]),
                              lambda what: what[0](what[1], receiver), (heard, token))

    # What participants are told; a message may come to one that is no more.

    def joined(self, me: Participant, remote: Remote, topic: str) -> None:
        """A reader of ``me`` has matched a writer."""
        for link in self._links.get((remote.host, me.host, topic), ()):
            link.joined()

    def announced(self, token: tuple[tuple[Guid, int], bool], receiver: int) -> None:
        me, ((guid, lease_ns), wants_response) = self.participants[receiver], token
        remote = None if me is None else me.remotes.get(guid)
        if remote is not None and remote.direct:  # as nearly always
            remote.heard_ns = self.context.now_ns
        elif me is not None and me.awake and (
                self.server is None or self.server in (receiver, guid[0])):
            me.announced(guid, lease_ns, wants_response)

    def told(self, to: To, receiver: int, lost: Collection[int] = ()) -> None:
        self._hear("told", to, receiver, lost)

    def offered(self, to: To, receiver: int, lost: Collection[int] = ()) -> None:
        self._hear("offered", to, receiver)

    def acknowledged(self, to: To, receiver: int, lost: Collection[int] = ()) -> None:
        self._hear("acknowledged", to, receiver)

    def greeted(self, to: To, receiver: int, lost: Collection[int] = ()) -> None:
        self._hear("greeted", to, receiver)

    def asked_to_greet(self, to: To, receiver: int, lost: Collection[int] = ()) -> None:
        self._hear("asked_to_greet", to, receiver)

    def heard(self, to: To, receiver: int, lost: Collection[int] = ()) -> None:
        self._hear("heard", to, receiver)

    def _hear(self, what: str, to: To, receiver: int, *more: Any) -> None:
        """A message from one participant to another: from strangers and for former lives it is
        not read. Of several heartbeats or acknowledgements in one train any stands for all."""
        me, token = self.participants[receiver], to[receiver]
        if me is None or me.guid != token[1]:
            return
        remote = me.remotes.get(token[0])
        if remote is not None and remote.direct:
            remote.heard_ns = self.context.now_ns
            getattr(me.endpoints, what)(remote, *token[2:], *more)

"""A participant: the process of one host in one life of it. It announces itself (SPDP), keeps a
lease on everybody it hears, and matches endpoints."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from desim.middleware.dds.endpoints import Endpoints
from desim.middleware.dds.relay import Relay
from desim.middleware.dds.remote import Guid, Item, Remote
from desim.middleware.dds.riding import Resent
from desim.middleware.dds.wire import QUEUED, TYPE_NAME, Chunk

if TYPE_CHECKING:
    from desim.middleware.dds.dds import Dds
    from desim.ports.middleware import InAdvance


class Participant:
    """``remotes`` are the participants that it believes in, in the order of discovery. Anything
    that is heard from one renews its lease, which is as long as that one says."""

    def __init__(self, dds: Dds, host: int, life: int) -> None:
        self.dds, self.context, self.params = dds, dds.context, dds.params
        self.host = host
        self._others = [other for other in range(len(self.context.hosts)) if other != host]
        self.guid: Guid = (host, life)
        self.alive = True
        self.remotes: dict[Guid, Remote] = {}
        self.writers: dict[str, None] = {}  # topics
        self.readers: dict[str, None] = {}
        self.resent = Resent()
        self.relay = Relay(self) if dds.server == host else None
        self._series = 0  # begun so far
        self.endpoints = Endpoints(self)
        lease_ns = dds.leases_ns[host]
        self._hello = (self.guid, lease_ns)
        self.announcing_ns = self.params.announcing_ns(lease_ns)
        self.asserting_ns = self.params.asserting_ns(lease_ns)
        self.awake = False
        spread_ns = self.params.start_spread_ns
        if spread_ns:
            luck = self.context.stream("start", self.context.hosts[host], life)
            self.after(int(luck.integers(spread_ns)), self._wake, None)
        else:
            self._wake(None)

    def _wake(self, _: Any) -> None:
        """The process runs: from now on it talks and listens."""
        self.awake = True
        self._announce(0)
        self.after(self.params.endpoint_delay_ns, self.endpoints.appear, None)
        if self.asserting_ns:
            self.after(self.asserting_ns, self._assert_liveliness, None)

    def after(self, delay_ns: int, fn: Callable[[Any], Any], arg: Any) -> Any:
        """Call ``fn(arg)`` then, if this life still lasts."""
        return self.context.at(self.context.now_ns + delay_ns, self.host, self._run, (fn, arg))

    def _run(self, what: tuple[Callable[[Any], Any], Any]) -> None:
        if self.alive:
            fn, arg = what
            fn(arg)

    # Its own endpoints.

    def advertise(self, topic: str) -> None:
        if topic not in self.writers:
            self.writers[topic] = None
            size_bytes = self.dds.wire.writer_bytes("rt" + topic, TYPE_NAME, QUEUED)
            self.endpoints.write(Item(self.guid, "writer", topic, size_bytes))

    def subscribe(self, topic: str) -> None:
        if topic not in self.readers:
            self.readers[topic] = None
            size_bytes = self.dds.wire.reader_bytes("rt" + topic, TYPE_NAME, QUEUED)
            self.endpoints.write(Item(self.guid, "reader", topic, size_bytes))
            for remote in self.remotes.values():
                if topic in remote.writers:
                    self._reads(remote, topic)

    # Who else there is.

    def of(self, host: int) -> Iterator[Remote]:
        """Those on ``host``: the one that runs, and what is believed of its former lives."""
        return (remote for remote in self.remotes.values() if remote.host == host)

    def direct(self) -> list[Remote]:
        """Those that it talks to."""
        return [remote for remote in self.remotes.values() if remote.direct]

    def _announce(self, k: int) -> None:
        """The k-th time. A client of a server talks to that alone, the server to its clients."""
        params, dds = self.params, self.dds
        known = [remote.host for remote in self.direct()]
        period_ns = self.announcing_ns
        if dds.server is None:
            self._announce_to_all(params.first_times if k == 0 else 1,
                                  known if k and params.allow_multicast == "spdp" else [])
            if k + 1 < params.initial_announcements:
                period_ns = params.initial_period_ns
        elif dds.server == self.host:
            self._hello_to(known, dds.wire.announcement(), False)
        else:
            self._hello_to([dds.server], dds.wire.announcement(), False, calls=True)
            if not known:
                period_ns = params.server_period_ns
        self.after(period_ns, self._announce, k + 1)

    def _announce_to_all(self, times: int, known: list[int]) -> None:
        """By multicast, and to each of those that are ``known``."""
        self._hello_to(self._others, self.dds.wire.announcement(times), True)
        self._hello_to(known, self.dds.wire.announcement(), False)

    def _hello_to(self, hosts: list[int], chunk: Chunk, multicast: bool,
                  calls: bool = False) -> None:
        if hosts:
            self.context.send("spdp", self.host, hosts, chunk.size_bytes, self.dds.announced,
                              (self._hello, multicast or calls), segments=chunk.packets,
                              multicast=multicast, in_advance=self.notes)

    def notes(self, host: int) -> InAdvance | None:
        """What ``host`` notes of something that only says that this participant lives, if it knows
        this one already."""
        you = self.dds.participants[host]
        remote = None if you is None else you.remotes.get(self.guid)
        if remote is None or not remote.direct:
            return None
        remote.look(self.context.now_ns)
        return lambda *coming: remote.coming.append(coming)

    def announced(self, guid: Guid, lease_ns: int, wants_response: bool) -> None:
        """Somebody says that it is there who was not talked to so far."""
        if self.relay is None:
            remote = Remote(guid, lease_ns, self.context.now_ns, True, self.endpoints.items)
        else:
            self._series += 1
            remote = Remote(guid, lease_ns, self.context.now_ns, True, [], self._series)
        self._meet(remote)
        self.after(lease_ns, self._look, remote)
        if self.params.announces_when_found and self.dds.server is None:
            self._announce_to_all(1, [other.host for other in self.direct()])
        if wants_response:
            self._respond((remote, self.params.responses if self.dds.server is None else 1))
        self.endpoints.meet(remote)

    def _meet(self, remote: Remote) -> None:
        self.remotes[remote.guid] = remote
        self.context.sees(self.host, remote.host, "online")

    def _respond(self, what: tuple[Remote, int]) -> None:
        """Announce this participant to a newcomer, which may not have heard of it."""
        remote, times = what
        if times and self.remotes.get(remote.guid) is remote:
            self._hello_to([remote.host], self.dds.wire.announcement(), False)
            if times > 1:
                self.after(self.params.response_period_ns, self._respond, (remote, times - 1))

    def _look(self, remote: Remote) -> None:
        """Its lease may have ended."""
        if self.remotes.get(remote.guid) is not remote:
            return
        now_ns = self.context.now_ns
        remote.look(now_ns)
        if remote.heard_ns + remote.lease_ns <= now_ns:
            self.dds.look(self, remote)
        left_ns = remote.heard_ns + remote.lease_ns - now_ns
        if left_ns > 0:
            self.after(left_ns, self._look, remote)
        else:
            self.lose(remote)

    def lose(self, remote: Remote) -> None:
        """It is gone, and its endpoints with it."""
        del self.remotes[remote.guid]
        self.dds.hears_later(remote, self.host)
        context, dds, left = self.context, self.dds, list(self.of(remote.host))
        if not left:
            context.sees(self.host, remote.host, "removed")
        for topic in remote.writers:
            if topic in self.readers and not any(topic in other.writers for other in left):
                context.knows(self.host, remote.host, topic, False)
        dds.matches += 1
        for topic in remote.readers:
            if topic in self.writers:
                dds.changed(self.host, topic)
        if self.relay is not None:
            self.relay.gone(remote.guid)

    # Matching.

    def learn(self, source: Remote, item: Item) -> None:
        """``source`` says ``item``. Of this host's former lives nothing is believed."""
        owner, kind, topic, _ = item
        if owner[0] == self.host:
            return
        source.named[owner] = None
        if kind == "gone":
            if owner in self.remotes and not self.remotes[owner].direct:
                self.lose(self.remotes[owner])
            return
        remote = source if owner == source.guid else self._by_hearsay(owner)
        if kind == "writer":
            remote.writers[topic] = None
            if topic in self.readers:
                self._reads(remote, topic)
        elif kind == "reader":
            remote.readers[topic] = None
            if topic in self.writers:
                self.dds.changed(self.host, topic)
        elif topic:
            self._learn_built_in(remote, kind, topic)
        if self.relay is not None:
            self.relay.add(item)

    def _learn_built_in(self, remote: Remote, kind: str, topic: str) -> None:
        """Each node has a reader and a writer of ``topic``."""
        remote.built_in[kind, topic] = None
        if kind == "built_in_reader":
            self.endpoints.greet(remote, topic)
        elif kind == "built_in_writer":
            self.endpoints.expect_greeting(remote, topic)

    def _by_hearsay(self, owner: Guid) -> Remote:
        """Whom a server tells of. A new life of a host ends what is believed of the old ones."""
        remote = self.remotes.get(owner)
        if remote is None:
            remote = Remote(owner, 0, self.context.now_ns, False, [])
            former = [other for other in self.of(owner[0])
                      if not other.direct and other.guid < owner]
            self._meet(remote)
            for other in former:
                self.lose(other)
        return remote

    def forget_others(self, what: tuple[Remote, int]) -> None:
        """A server has had the time of its lease to tell anew: whom no server has named is gone."""
        server, series = what
        if self.remotes.get(server.guid) is not server or server.heard_series != series:
            return
        direct = [remote for remote in self.remotes.values() if remote.direct]
        for remote in list(self.remotes.values()):
            if not (remote.direct or any(remote.guid in other.named for other in direct)):
                self.lose(remote)

    def _reads(self, remote: Remote, topic: str) -> None:
        """This host's reader of ``topic`` has matched a writer."""
        self.dds.matches += 1
        self.context.knows(self.host, remote.host, topic, True)
        self.dds.joined(self, remote, topic)

    def _assert_liveliness(self, _: Any) -> None:
        known = self.direct()
        if known:
            self.endpoints.assert_liveliness(known)
        self.after(self.asserting_ns, self._assert_liveliness, None)

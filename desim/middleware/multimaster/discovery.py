"""master_discovery: own heartbeats, and the other masters as their heartbeats show them."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from enum import StrEnum
from typing import NamedTuple

from desim.middleware.headers import UDP_HEADER_BYTES
from desim.middleware.multimaster.parameters import (
    DiscoveryTiming,
    MultimasterConstants,
    MultimasterParams,
    timing,
)
from desim.middleware.ros1.master import Uri
from desim.middleware.ros1.processes import Processes
from desim.middleware.ros1.sizes import Sizes
from desim.middleware.timers import Lifetime
from desim.ports.middleware import HostState

# Payload ('cBBiiHii') and headers; master_discovery itself reckons with 68 B.
HEARTBEAT_BYTES = 24 + UDP_HEADER_BYTES
# masterContacts; estimated from getParam, 300 and 330 B, which answers less.
CONTACTS = Sizes(300, 0, 500, 0)


class Side(StrEnum):
    """An end of a topic."""

    PUBLISHER = "publisher"
    SUBSCRIBER = "subscriber"


class HeartbeatKind(StrEnum):
    """The purpose of a heartbeat."""

    BEAT = "beat"
    REQUEST = "request"  # asks for a beat of the receiver
    LEAVE = "leave"  # the sender stops


Registration = tuple[Side, str, Uri]  # side, topic, address


class MasterState(NamedTuple):
    """The state of a master: the time of its last change, which heartbeats carry, and the
    registrations of its own host, which are fetched by a call."""

    changed_ns: int
    registrations: tuple[Registration, ...]


class Beat(NamedTuple):
    """A heartbeat of ``host``: the time of the last change of its own state, and of its master's,
    to which registrations copied by sync belong too."""

    host: int
    what: HeartbeatKind
    changed_ns: int
    stirred_ns: int


class MasterNews(StrEnum):
    """A change that discovery notices at a remote master, or the need to ask it."""

    ONLINE = "online"  # new, or again
    CHANGED = "changed"
    OFFLINE = "offline"
    REMOVED = "removed"
    REQUEST = "request"


class RemoteMaster:
    """The master of another ``host``, as its heartbeats show it: online, silent, gone. ``known``:
    its identity is known. ``quality``: percent of the expected heartbeats that have arrived, 0
    where these are too slow for that."""

    def __init__(self, host: int) -> None:
        self.host = host
        self.known = False
        self.online = False
        self.changed_ns = -1  # the last change of its state, by its last heartbeat
        self.stirred_ns = -1  # the last change of its master
        self.received_ns = 0
        self.offline_ns = 0  # when it became so
        self.requests = 0  # unanswered
        self.quality = 0
        self._beats: deque[int] = deque()

    def receive(self, now_ns: int) -> None:
        self.received_ns = now_ns
        self.requests = 0
        self._beats.append(now_ns)

    def verdict(self, now_ns: int, timing: DiscoveryTiming, constants: MultimasterConstants
                ) -> MasterNews | None:
        """The meaning of the master's silence: offline, removed, a request (which is counted), or
        None. With quick heartbeats silence is enough; with slow ones the master is asked first."""
        silent_ns = now_ns - self.received_ns
        if silent_ns > constants.remove_after_ns:
            return MasterNews.REMOVED
        if timing.counted:
            return MasterNews.OFFLINE if silent_ns > timing.timeout_ns else None
        if not constants.active_request_after_ns or silent_ns <= constants.active_request_after_ns:
            return None
        if self.requests >= constants.offline_after_requests:
            return MasterNews.OFFLINE
        self.requests += 1
        return MasterNews.REQUEST

    def measure(self, now_ns: int, timing: DiscoveryTiming) -> bool:
        """Update the quality; returns whether it has changed: beats / (rate * window + unanswered
        requests)."""
        beats = self._beats
        while beats and beats[0] <= now_ns - timing.window_ns:
            beats.popleft()
        if not timing.counted:
            return False
        before = self.quality
        self.quality = min(100, int(100 * len(beats) / (timing.expected + self.requests)))
        return self.quality != before


class Discovery:
    """The master_discovery of one host, from its start to its stop. It calls ``notify(news,
    remote)``; ``receive(beat, host)`` is called with heartbeats that arrive at a host."""

    def __init__(self, processes: Processes, params: MultimasterParams, host: int,
                 notify: Callable[[MasterNews, RemoteMaster], object],
                 receive: Callable[[Beat, int], object]) -> None:
        self._processes, self._params, self._host = processes, params, host
        self._constants = constants = params.constants
        self._notify, self._receive = notify, receive
        self._context = context = processes.context
        self._timing = timing(constants)
        self._others = [other for other in range(len(context.hosts)) if other != host]
        self._named = [other for other in self._others
                       if context.hosts[other] in params.robot_hosts]
        self._life = Lifetime(context, host)
        self._firsts = 0 if self._timing.counted else constants.first_notifications
        self._seen_changes = -1  # changes of the own master at the last poll
        self._stirred_ns = context.now_ns  # when one was seen last
        self.state = MasterState(context.now_ns, ())
        self.remotes: dict[int, RemoteMaster] = {}
        start_ns = int(context.stream("discovery", context.hosts[host], context.life(host)
                                      ).integers(constants.start_jitter_ns + 1))
        self._life.after(start_ns, self._tick)
        self._life.after(start_ns + (self._timing.heartbeat_ns if self._firsts else 0),
                           self._beat)

    def stop(self) -> None:
        """The host has stopped."""
        if self._params.leave:
            self._send(HeartbeatKind.LEAVE)
        self._life.end()

    # Own state.

    def _beat(self, _: object) -> None:
        self._life.after(self._timing.heartbeat_ns, self._beat)
        self._send(HeartbeatKind.BEAT)

    def _tick(self, _: object) -> None:
        self._life.after(self._timing.tick_ns, self._tick)
        self._poll_own_master()
        if self._firsts:
            self._firsts -= 1
            self._send(HeartbeatKind.BEAT)
            self._send(HeartbeatKind.REQUEST)
        for remote in list(self.remotes.values()):
            self._check(remote)

    def _poll_own_master(self) -> None:
        registry, host = self._processes.masters[self._host].registry, self._host
        if registry.changes == self._seen_changes:
            return
        self._seen_changes, self._stirred_ns = registry.changes, self._context.now_ns
        registrations = tuple((side, topic, known[host])
                              for side, topics in ((Side.PUBLISHER, registry.publishers),
                                                   (Side.SUBSCRIBER, registry.subscribers))
                              for topic, known in topics.items() if host in known)
        if registrations != self.state.registrations:
            self.state = MasterState(self._context.now_ns, registrations)
        if not self._timing.counted:
            self._send(HeartbeatKind.BEAT)

    def _send(self, what: HeartbeatKind, to: int | None = None) -> None:
        beat = Beat(self._host, what, self.state.changed_ns, self._stirred_ns)
        receive = self._receive
        if to is not None:
            self._context.send("heartbeat", self._host, [to], HEARTBEAT_BYTES, receive, beat)
            return
        if self._params.multicast:
            self._context.send("heartbeat", self._host, self._others, HEARTBEAT_BYTES, receive,
                               beat, multicast=True)
        if self._named:
            self._context.send("heartbeat", self._host, self._named, HEARTBEAT_BYTES, receive, beat)

    # Others.

    def receive(self, beat: Beat) -> None:
        """A heartbeat has come."""
        remote = self.remotes.get(beat.host)
        if beat.what == HeartbeatKind.LEAVE:
            if remote is not None:
                self._remove(remote)
            return
        if beat.what == HeartbeatKind.REQUEST:
            self._send(HeartbeatKind.BEAT, beat.host)
        now_ns = self._context.now_ns
        if remote is None:
            remote = self.remotes[beat.host] = RemoteMaster(beat.host)
            self._life.after(self._constants.contact_after_ns, self._contact, remote)
        remote.receive(now_ns)
        news = (beat.changed_ns, beat.stirred_ns) != (remote.changed_ns, remote.stirred_ns)
        remote.changed_ns, remote.stirred_ns = beat.changed_ns, beat.stirred_ns
        if remote.known and not remote.online:
            remote.online = True
            self._announce(MasterNews.ONLINE, remote)
        elif remote.known and news:
            self._notify(MasterNews.CHANGED, remote)

    def _contact(self, remote: RemoteMaster) -> None:
        """Ask a new master for its identity."""
        if self.remotes.get(remote.host) is not remote:
            return
        call = self._processes.rpc.call(
            self._host, remote.host, "monitor", "masterContacts", CONTACTS.call,
            ("masterContacts",), lambda ok, _: self._contacted(remote, ok, call.reason),
            timeout_ns=self._constants.contact_timeout_ns, fresh=True)

    def _contacted(self, remote: RemoteMaster, ok: bool, reason: str | None) -> None:
        if self.remotes.get(remote.host) is not remote:
            return
        if ok:
            remote.known = remote.online = True
            self._announce(MasterNews.ONLINE, remote)
        else:
            constants = self._constants
            self._life.after(constants.unreachable_retry_ns if reason == "unreachable"
                               else constants.contact_retry_ns, self._contact, remote)

    def _check(self, remote: RemoteMaster) -> None:
        verdict = remote.verdict(self._context.now_ns, self._timing, self._constants)
        if verdict == MasterNews.REMOVED:
            self._remove(remote)
        elif verdict == MasterNews.REQUEST:
            self._send(HeartbeatKind.REQUEST, remote.host)
        elif verdict == MasterNews.OFFLINE and remote.online:
            remote.online = False
            remote.offline_ns = self._context.now_ns
            self._announce(MasterNews.OFFLINE, remote)
        if remote.measure(self._context.now_ns, self._timing):
            self._context.record("link_quality", self._host, self._context.host_ids[remote.host],
                                 remote.quality)

    def _remove(self, remote: RemoteMaster) -> None:
        del self.remotes[remote.host]
        if remote.known:
            self._announce(MasterNews.REMOVED, remote)

    def _announce(self, what: MasterNews, remote: RemoteMaster) -> None:
        self._context.sees(self._host, remote.host, HostState(what))
        self._notify(what, remote)

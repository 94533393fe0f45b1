"""master_discovery: heartbeats, and who is there by those of others."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

from desim.middleware.multimaster.parameters import MultimasterParams, watch
from desim.middleware.multimaster.remote import Remote
from desim.middleware.multimaster.timers import Timers
from desim.middleware.ros.sizes import Sizes
from desim.middleware.ros.xmlrpc import Call

if TYPE_CHECKING:
    from desim.middleware.ros.processes import Processes

# Payload ('cBBiiHii'), UDP, IP, Ethernet and its check sequence; master_discovery itself reckons
# with 68 B.
HEARTBEAT_BYTES = 24 + 8 + 20 + 14 + 4
# masterContacts; estimated from getParam, 300 and 330 B, which answers less.
CONTACTS = Sizes(300, 0, 500, 0)

Registration = tuple[str, str, Any]  # side, topic, uri


class State(NamedTuple):
    """What a heartbeat tells of its master: when it last changed, and what is registered there by
    nodes of its own host. The latter is fetched by a call."""

    changed_ns: int
    registrations: tuple[Registration, ...]


class Beat(NamedTuple):
    """A heartbeat of ``host``. ``what``: beat, request (answer by yours) or leave. It tells when
    the state there has changed, and when the master has, be it by what sync copied."""

    host: int
    what: str
    changed_ns: int
    stirred_ns: int


class Discovery:
    """On one host, from its start to its end. ``told(what, remote)``: online (new, or again),
    changed, offline, removed. ``hear(beat, host)`` is where heartbeats go that come to a host."""

    def __init__(self, processes: Processes, params: MultimasterParams, host: int,
                 told: Callable[[str, Remote], Any], hear: Callable[[Beat, int], Any]) -> None:
        self._processes, self._params, self._host = processes, params, host
        self._told, self._hear = told, hear
        self._context = context = processes.context
        self._watch = watch(params)
        self._others = [other for other in range(len(context.hosts)) if other != host]
        named = sorted(context.hosts.index(name) for name in dict.fromkeys(params.robot_hosts))
        self._named = [other for other in named if other != host]
        self._timers = Timers(context, host)
        self._firsts = 0 if self._watch.counted else params.first_notifications
        self._looked = -1  # changes of the own master at the last look
        self._stirred_ns = context.now_ns  # when one was seen last
        self.state = State(context.now_ns, ())
        self.remotes: dict[int, Remote] = {}
        start_ns = int(context.stream("discovery", context.hosts[host], processes.on(
            host).uri.life).integers(params.start_jitter_ns + 1))
        self._timers.after(start_ns, self._tick)
        self._timers.after(start_ns + (self._watch.heartbeat_ns if self._firsts else 0),
                           self._beat)

    def stop(self) -> None:
        """The host has stopped."""
        if self._params.leave:
            self._send("leave")
        self._timers.stop()

    def serve(self, call: Call) -> None:
        """masterContacts."""
        call.reply(CONTACTS.answer, True)

    # Own state.

    def _beat(self, _: Any) -> None:
        self._timers.after(self._watch.heartbeat_ns, self._beat)
        self._send("beat")

    def _tick(self, _: Any) -> None:
        self._timers.after(self._watch.tick_ns, self._tick)
        self._look_at_own()
        if self._firsts:
            self._firsts -= 1
            self._send("beat")
            self._send("request")
        for remote in list(self.remotes.values()):
            self._look_at(remote)

    def _look_at_own(self) -> None:
        changes = self._processes.masters[self._host].registry.changes
        if changes == self._looked:
            return
        self._looked = changes
        self._stirred_ns = self._context.now_ns
        registrations = tuple(self._own())
        if registrations != self.state.registrations:
            self.state = State(self._context.now_ns, registrations)
        if not self._watch.counted:
            self._send("beat")

    def _own(self) -> list[Registration]:
        registry = self._processes.masters[self._host].registry
        return [(side, topic, known[self._host])
                for side, topics in (("publisher", registry.publishers),
                                     ("subscriber", registry.subscribers))
                for topic, known in topics.items() if self._host in known]

    def _send(self, what: str, to: int | None = None) -> None:
        beat = Beat(self._host, what, self.state.changed_ns, self._stirred_ns)
        heard = self._hear
        if to is not None:
            self._context.send("heartbeat", self._host, [to], HEARTBEAT_BYTES, heard, beat)
            return
        if self._params.multicast:
            self._context.send("heartbeat", self._host, self._others, HEARTBEAT_BYTES, heard, beat,
                               multicast=True)
        if self._named:
            self._context.send("heartbeat", self._host, self._named, HEARTBEAT_BYTES, heard, beat)

    # Others.

    def heard(self, beat: Beat) -> None:
        """A heartbeat has come."""
        remote = self.remotes.get(beat.host)
        if beat.what == "leave":
            if remote is not None:
                self._remove(remote)
            return
        if beat.what == "request":
            self._send("beat", beat.host)
        now_ns = self._context.now_ns
        if remote is None:
            remote = self.remotes[beat.host] = Remote(beat.host)
            remote.heard(now_ns)
            self._timers.after(self._params.contact_after_ns, self._contact, remote)
        else:
            remote.heard(now_ns)
        news = (beat.changed_ns, beat.stirred_ns) != (remote.changed_ns, remote.stirred_ns)
        remote.changed_ns, remote.stirred_ns = beat.changed_ns, beat.stirred_ns
        if remote.known and not remote.online:
            remote.online = True
            self._say("online", remote)
        elif remote.known and news:
            self._told("changed", remote)

    def _contact(self, remote: Remote) -> None:
        """Ask whoever is new who it is."""
        if self.remotes.get(remote.host) is not remote:
            return
        call = self._processes.rpc.call(
            self._host, remote.host, "monitor", "masterContacts", CONTACTS.call,
            ("masterContacts",), lambda ok, _: self._contacted(remote, ok, call.reason),
            timeout_ns=self._params.contact_timeout_ns, fresh=True)

    def _contacted(self, remote: Remote, ok: bool, reason: str | None) -> None:
        if self.remotes.get(remote.host) is not remote:
            return
        if ok:
            remote.known = remote.online = True
            self._say("online", remote)
        else:
            params = self._params
            self._timers.after(params.unreachable_retry_ns if reason == "unreachable"
                               else params.contact_retry_ns, self._contact, remote)

    def _look_at(self, remote: Remote) -> None:
        verdict = remote.judged(self._context.now_ns, self._watch, self._params)
        if verdict == "removed":
            self._remove(remote)
        elif verdict == "request":
            self._send("request", remote.host)
        elif verdict == "offline" and remote.online:
            remote.online = False
            remote.offline_ns = self._context.now_ns
            self._say("offline", remote)
        if remote.measure(self._context.now_ns, self._watch):
            self._context.record("link_quality", self._host, self._context.host_ids[remote.host],
                                 remote.quality)

    def _remove(self, remote: Remote) -> None:
        del self.remotes[remote.host]
        if remote.known:
            self._say("removed", remote)

    def _say(self, what: str, remote: Remote) -> None:
        self._context.sees(self._host, remote.host, what)
        self._told(what, remote)

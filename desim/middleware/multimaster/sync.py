"""master_sync: registrations at the masters of other hosts are copied into the own master."""

from __future__ import annotations

from fnmatch import fnmatchcase

from desim.middleware.multimaster.discovery import (
    CONTACTS,
    Discovery,
    MasterNews,
    MasterState,
    Registration,
    RemoteMaster,
    Side,
)
from desim.middleware.multimaster.parameters import MultimasterParams
from desim.middleware.ros1.master import Master, Uri
from desim.middleware.ros1.processes import Processes
from desim.middleware.ros1.sizes import CALLS, Sizes
from desim.middleware.ros1.xmlrpc import Done, XmlRpcCall
from desim.middleware.timers import Lifetime
from desim.ports.networks import Handle

# masterInfoFiltered; estimated from getPublishedTopics, 306 B and 3585 B for 20 topics.
MASTER_INFO = Sizes(306, 0, 345, 162)
# Counted from the formats of xmlrpc.client and of multimaster_fkie 1.3.2's server, which has eleven
# methods: which of them there are, asked twice of each remote master; and the checksums of types,
# each for a name like std_msgs/String.
_ASKED = {"masterContacts": CONTACTS, "listMethods": Sizes(264, 0, 795, 0),
          "md5Sums": Sizes(360, 48, 278, 158)}
UPDATE_TIMEOUT_NS = 3_000_000_000  # sync_thread.py setdefaulttimeout

Update = tuple[str, Uri, tuple[Uri, ...]]  # topic, subscriber, publishers


class Copy:
    """The registrations of one remote master that stand in the own one, as of ``changed_ns``.
    ``known``: the methods of the remote server are known."""

    def __init__(self) -> None:
        self.registrations: dict[Registration, None] = {}
        self.changed_ns = -1
        self.restarts = 0
        self.timer: Handle | None = None
        self.asking = False
        self.known = False


class Sync:
    """The master_sync of one host, from its start to its stop."""

    def __init__(self, processes: Processes, params: MultimasterParams, host: int) -> None:
        self._processes, self._params, self._host = processes, params, host
        self._constants = params.constants
        self.discovery: Discovery
        self._context = context = processes.context
        self._stream = context.stream("sync", context.hosts[host], context.life(host))
        self._copies: dict[int, Copy] = {}
        self._life = Lifetime(context, host)
        self._life.after(params.constants.sync_poll_ns, self._poll)

    def stop(self) -> None:
        """The host has stopped."""
        self._life.end()

    def serve(self, call: XmlRpcCall) -> None:
        """Answer a call to discovery's XML-RPC server: masterInfoFiltered with the registrations of
        this host (those of others count as bytes only), the others without any content."""
        method, *arguments = call.request
        if method == "masterInfo":
            state = self.discovery.state
            call.reply(MASTER_INFO.answer + MASTER_INFO.answer_each * len(state.registrations),
                       state)
        else:
            sizes = _ASKED[method]
            call.reply(sizes.answer + sizes.answer_each * sum(arguments), True)

    def notify(self, what: MasterNews, remote: RemoteMaster) -> None:
        """Discovery has news of a remote master."""
        if what == MasterNews.REMOVED:
            copy = self._copies.pop(remote.host, None)
            if copy is not None:
                self._rest(copy)
                self._write(copy, ())
        elif what != MasterNews.OFFLINE:
            copy = self._copies.setdefault(remote.host, Copy())
            if what == MasterNews.ONLINE and copy.registrations and self._to_redo(remote):
                self._write(copy, ())
                copy.changed_ns = -1
            self._want(remote, copy)

    def _to_redo(self, remote: RemoteMaster) -> bool:
        """Whether a master that comes back is copied anew."""
        offline_ns = self._context.now_ns - remote.offline_ns
        return (self._params.resync_on_reconnect
                and offline_ns >= self._constants.resync_on_reconnect_timeout_ns)

    def _poll(self, _: object) -> None:
        """Fetch states of masters that were left out."""
        self._life.after(self._constants.sync_poll_ns, self._poll)
        for remote in self.discovery.remotes.values():
            copy = self._copies.get(remote.host)
            if copy is not None and remote.online and copy.timer is None:
                self._want(remote, copy)

    def _want(self, remote: RemoteMaster, copy: Copy) -> None:
        """Fetch a master's state after a delay, unless it is known."""
        if copy.asking or copy.changed_ns >= remote.changed_ns:
            return
        if copy.timer is not None:
            if copy.restarts >= self._constants.sync_restarts:
                return
            copy.restarts += 1
            copy.timer.cancel()
        delay_ns = int(self._stream.integers(self._constants.sync_delay_ns + 1))
        copy.timer = self._life.after(delay_ns, self._fetch, (remote, copy))

    def _fetch(self, what: tuple[RemoteMaster, Copy]) -> None:
        remote, copy = what
        self._rest(copy)
        copy.asking = True
        if copy.known:
            self._fetch_state(remote, copy)
        else:
            self._ask("listMethods", remote, 0, lambda ok, _: self._fetch_state(remote, copy))

    def _fetch_state(self, remote: RemoteMaster, copy: Copy) -> None:
        self._call("masterInfo", remote, MASTER_INFO.call, (),
                   lambda ok, state: self._fetched(remote, copy, state))

    def _fetched(self, remote: RemoteMaster, copy: Copy, state: MasterState | None) -> None:
        """Take a fetched state. If it could not be fetched, it waits for the next change or poll.
        """
        copy.asking = False
        if state is None or self._copies.get(remote.host) is not copy:
            return
        copy.changed_ns = state.changed_ns
        fresh = self._write(copy, tuple(
            one for one in state.registrations
            if not any(fnmatchcase(one[1], topics) for topics in self._params.ignore_topics)))
        if copy.known:
            self._ask("md5Sums", remote, fresh)
        else:
            copy.known = True
            self._ask("listMethods", remote, 0, lambda ok, _: self._ask("md5Sums", remote, fresh))
        self._want(remote, copy)

    def _ask(self, method: str, remote: RemoteMaster, count: int,
             done: Done = lambda ok, _: None) -> None:
        """Make a call of which only the bytes matter here."""
        sizes = _ASKED[method]
        self._call(method, remote, sizes.call + sizes.call_each * count, (count,), done)

    def _call(self, method: str, remote: RemoteMaster, size_bytes: int, arguments: tuple[int, ...],
              done: Done) -> None:
        """Call the server of the remote discovery. It speaks HTTP/1.0: a connection for each call.
        """
        self._processes.rpc.call(
            self._host, remote.host, "monitor", method, size_bytes, (method, *arguments), done,
            timeout_ns=self._constants.sync_timeout_ns, fresh=True)

    def _write(self, copy: Copy, wanted: tuple[Registration, ...]) -> int:
        """Make one MultiCall to the own master: unregister old registrations, register new ones.
        New subscribers of published topics then get the publishers of that moment, one after
        another. Returns the number of new registrations."""
        old, copy.registrations = copy.registrations, dict.fromkeys(wanted)
        gone = [one for one in old if one not in copy.registrations]
        new = [one for one in copy.registrations if one not in old]
        if gone or new:
            self._processes.rpc.call(
                self._host, self._host, "master", "multicall", 0, ("multicall", gone, new),
                lambda ok, updates: self._update_publishers(list(updates)))
        return len(new)

    def _update_publishers(self, updates: list[Update]) -> None:
        """Call publisherUpdate as if from the master (sync_thread.py 1.3.2; earlier versions made
        the master call by a dummy publisher). What the master itself tells in the meantime is
        newer."""
        if updates:
            topic, uri, publishers = updates.pop(0)
            sizes = CALLS["publisherUpdate"]
            self._processes.rpc.call(
                self._host, uri.host, uri.slave, "publisherUpdate",
                sizes.call + sizes.call_each * len(publishers),
                ("publisherUpdate", topic, publishers),
                lambda ok, _: self._update_publishers(updates),
                timeout_ns=UPDATE_TIMEOUT_NS, fresh=True)

    def _rest(self, copy: Copy) -> None:
        if copy.timer is not None:
            copy.timer.cancel()
        copy.timer, copy.restarts = None, 0


def multicall(master: Master, gone: list[Registration], new: list[Registration]
              ) -> tuple[Update, ...]:
    """The method of a master that ``Sync`` calls at its own. Returns the publishers that the new
    subscribers have."""
    unregister = {Side.PUBLISHER: master.unregister_publisher,
                  Side.SUBSCRIBER: master.unregister_subscriber}
    register = {Side.PUBLISHER: master.register_publisher,
                Side.SUBSCRIBER: master.register_subscriber}
    for side, topic, uri in gone:
        unregister[side](topic, uri)
    answers = [(side, (topic, uri, register[side](topic, uri))) for side, topic, uri in new]
    return tuple(update for side, update in answers if side == Side.SUBSCRIBER and update[2])

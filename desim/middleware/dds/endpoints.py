"""SEDP: one participant tells every other one of its endpoints, reliably.

The two writers (publications, subscriptions) are told of as one series: their heartbeats and
acknowledgements travel together anyhow. With the first exchange those of the other built-in
writers travel along.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from desim.middleware.dds import wire
from desim.middleware.dds.remote import Item, Remote
from desim.middleware.dds.riding import Spent

if TYPE_CHECKING:
    from desim.middleware.dds.participant import Participant

# Until a reader asks again for endpoints that are on their way: NackDelay of Cyclone DDS. Fast DDS
# asks at each heartbeat, but its sender blocks while a buffer is full, which is not modelled.
ASK_AGAIN_NS = 100_000_000
TRAIN = 10  # messages in one frame, so that a large fleet's start is not a frame for each of them


class Mail(NamedTuple):
    """One message of endpoints: its packets, the items and their numbers; and how many there are,
    if it says so."""

    packets: int
    items: tuple[tuple[int, Item], ...]
    known: int | None


class Endpoints:
    """What ``me`` has to tell, and the answers to what it is told. A message is for one life of a
    participant; those that are for a former one, or from strangers, are not read."""

    def __init__(self, me: Participant) -> None:
        self._me = me
        self._params = me.params
        self._wire = me.dds.wire
        self._context = me.context
        self._multicast = me.params.allow_multicast == "all"
        self.items: list[Item] = []  # those that exist
        # A node's endpoints are made some time after its participant.
        self._coming: list[Item] | None = [
            Item(me.guid, f"built_in_{told.kind}", told.shared, told.size_bytes)
            for told in self._wire.built_in_endpoints(self._context.hosts[me.host])]
        self._beat: Any = None
        self._beats = 0
        limit_bytes = me.params.heartbeat_after_bytes
        self._spent = None if limit_bytes is None else (Spent(limit_bytes), Spent(limit_bytes))

    def write(self, item: Item) -> None:
        """There is, or will soon be, one more endpoint."""
        if self._coming is not None:
            self._coming.append(item)
        else:
            self._add([item])

    def appear(self, _: Any) -> None:
        """The endpoints are there."""
        coming, self._coming = self._coming, None
        self._add(coming)

    def _add(self, items: list[Item]) -> None:
        me = self._me
        self.items += items
        if me.relay is not None:
            for item in items:
                me.relay.add(item)
            return
        known = me.direct()
        if self._multicast and len(known) > 1:
            self._tell_new(known)
        else:
            for remote in known:
                self.tell_new(remote)

    # What is told.

    def tell_new(self, remote: Remote) -> None:
        """Tell what has not been told yet; what is lost of it, the next heartbeats bring up."""
        self._tell_new([remote])

    def _tell_new(self, remotes: list[Remote]) -> None:
        """The same to all of these, by multicast if there are several."""
        first, last = remotes[0].told, len(remotes[0].out)
        alone = len(self._me.remotes) == 1
        for start in range(first, last, TRAIN):
            numbers = range(start, min(last, start + TRAIN))
            out = remotes[0].out
            letters = self._wire.new_endpoints([out[number] for number in numbers],
                                               self._wire.apart and alone)
            self._send(remotes, numbers, letters, None)
        for remote in remotes:
            remote.told = last
        self._beats = 0
        self._book(self._params.discovery_heartbeat_period_ns)

    def meet(self, remote: Remote) -> None:
        """Somebody new: offer all there is, and ask for what it has."""
        params, delay_ns = self._params, self._params.initial_acknack_ns
        self._beats = 0
        if params.initial_heartbeat_ns:
            self._book(params.initial_heartbeat_ns)
        else:
            self._offer([remote], self._wire.built_in_writers, directed=True)
            self._book(params.discovery_heartbeat_period_ns)
        if delay_ns is not None:
            self._me.after(delay_ns, self._ask, (remote, delay_ns))

    def greet(self, remote: Remote, topic: str) -> None:
        """A writer that every node has has matched a reader of ``remote``: its first heartbeat."""
        readers, chunk = [remote], self._wire.heartbeats(1)
        if self._params.greets_all:
            readers = [other for other in self._me.direct()
                       if ("built_in_reader", topic) in other.built_in]
            if len(readers) > 1:
                chunk = self._wire.heartbeat_to_all()
        heard = self._me.dds.greeted
        if self._wire.apart or self._multicast:
            self._tell_all("endpoints", readers, [chunk], heard,
                           lambda other: (topic, other is remote))
            return
        for other in readers:  # who was greeted before only notes that it comes
            say = self._tell if other is remote else self._say
            say("endpoints", other, [chunk], heard, topic, other is remote)

    def expect_greeting(self, remote: Remote, topic: str) -> None:
        """A reader that every node has has matched a writer of ``remote``: it asks if that one is
        not heard."""
        delay_ns = self._params.initial_acknack_ns
        if self._wire.apart and delay_ns is not None and topic not in remote.greeted:
            self._me.after(delay_ns, self._ask_for_greeting, (remote, topic))

    def _ask_for_greeting(self, what: tuple[Remote, str]) -> None:
        remote, topic = what
        if topic not in remote.greeted and self._me.remotes.get(remote.guid) is remote:
            self._tell("acknack", remote, [self._wire.acknacks(1)], self._me.dds.asked_to_greet,
                       topic)

    def assert_liveliness(self, remotes: list[Remote]) -> None:
        self._tell_all("liveliness", remotes, [self._wire.liveliness()], self._me.dds.greeted,
                       lambda remote: ("", True))

    def _tell_known(self, remote: Remote, numbers: Sequence[int]) -> None:
        """Items of these numbers, which it has asked for."""
        out, most_bytes = remote.out, self._params.repeated_message_bytes
        if self._wire.apart:
            numbers = sorted(numbers, key=lambda n: wire.is_reader(out[n]))
            parts = self._parted([out[number] for number in numbers])
            letters = [letter for part in parts if part
                       for letter in self._wire.known_endpoints(part, most_bytes, False)]
            self._send([remote], numbers, letters, None)
            if len(parts) > 1:
                self._offer(self._me.direct(), 1, directed=False, times=len(parts) - 1)
            return
        for start in range(0, len(numbers), TRAIN):
            part = numbers[start:start + TRAIN]
            last = start + TRAIN >= len(numbers)
            letters = self._wire.known_endpoints([out[number] for number in part], most_bytes, last)
            self._send([remote], part, letters, remote.told if last else None)

    def _send(self, remotes: list[Remote], numbers: Sequence[int], letters: list[wire.Letter],
              known: int | None) -> None:
        """Items of these numbers, the same to all; with ``known`` a heartbeat in the last letter
        says that there are so many."""
        out, at, told = remotes[0].out, 0, []
        for chunk, count in letters:
            told.append(Mail(chunk.packets, tuple(
                (number, out[number]) for number in numbers[at:at + count]), None))
            at += count
        told[-1] = told[-1]._replace(known=known)
        self._tell_all("sedp", remotes, [chunk for chunk, _ in letters], self._me.dds.told,
                       lambda remote: (remote.series, tuple(told)))

    def _parted(self, items: list[Item]) -> list[list[Item]]:
        """What is repeated, cut where a heartbeat to all rides (see ``riding.Spent``): that one is
        a message of its own, and ends the one before it."""
        parts: list[list[Item]] = [[]]
        if self._spent is None:
            return [items]
        resent = self._me.resent
        for item in items:
            resent.bytes += wire.TIME_BYTES + item.size_bytes + (
                0 if parts[-1] else self._wire.head_bytes)
            parts[-1].append(item)
            if self._spent[wire.is_reader(item)].over(resent.bytes):
                resent.bytes += self._wire.head_bytes + wire.HEARTBEAT_BYTES
                parts.append([])
        return parts

    def _tell(self, kind: str, remote: Remote, chunks: list[wire.Chunk], heard: Callable[..., Any],
              *what: Any) -> None:
        self._tell_all(kind, [remote], chunks, heard, lambda _: what)

    def _say(self, kind: str, remote: Remote, chunks: list[wire.Chunk], heard: Callable[..., Any],
             *what: Any) -> None:
        """``_tell`` something that says no more to ``remote`` than that this participant lives."""
        me, you = self._me, self._me.dds.participants[remote.host]
        size_bytes, packets = wire.together(chunks)
        self._context.send(kind, me.host, [remote.host], size_bytes, heard,
                           {remote.host: (me.guid, remote.guid, *what)}, segments=packets,
                           in_part=heard, in_advance=(
                               me.notes if you is not None and you.guid == remote.guid else None))

    def _tell_all(self, kind: str, remotes: list[Remote], chunks: list[wire.Chunk],
                  heard: Callable[..., Any], what: Callable[[Remote], tuple[Any, ...]]) -> None:
        """Messages in one train: by multicast if that is usual and there are several to hear it."""
        chunk, guid = wire.together(chunks), self._me.guid
        groups = [remotes] if self._multicast else [[remote] for remote in remotes]
        for group in groups:
            to = {remote.host: (guid, remote.guid, *what(remote)) for remote in group}
            self._context.send(kind, self._me.host, list(to), chunk.size_bytes, heard, to,
                               segments=chunk.packets, multicast=len(to) > 1, in_part=heard)

    def _book(self, delay_ns: int) -> None:
        """A heartbeat not later than then."""
        due_ns = self._context.now_ns + delay_ns
        if self._beat is None or due_ns < self._beat[0]:
            self._beat = due_ns, self._me.after(delay_ns, self._heartbeat, due_ns)

    def _heartbeat(self, due_ns: int) -> None:
        """To all that have not acknowledged everything, or to all if one has not."""
        if self._beat is None or self._beat[0] != due_ns:
            return
        self._beat = None
        params = self._params
        known = self._me.direct()
        behind = [remote for remote in known
                  if not remote.answered or remote.acked < remote.told]
        if not behind:
            return
        new = [remote for remote in behind if not remote.answered]
        self._offer(new, self._wire.built_in_writers, directed=False)
        others = known if params.discovery_heartbeats_all else behind
        self._offer([remote for remote in others if remote.answered], 2, directed=False)
        self._beats += 1
        self._book(min(params.discovery_heartbeat_limit_ns,
                       params.discovery_heartbeat_period_ns
                       << min(16, max(0, self._beats - 2))))

    def _offer(self, remotes: list[Remote], writers: int, *, directed: bool, times: int = 1
               ) -> None:
        """Heartbeats of so many writers, several ``times`` in one train."""
        if remotes:
            chunks = [self._wire.heartbeats(writers)] if directed or not self._wire.apart \
                else [self._wire.heartbeat_to_all()] * writers
            self._tell_all("sedp_heartbeat", remotes, chunks * times,
                           self._me.dds.offered, lambda remote: (
                               remote.series, remote.told, writers, directed))

    def acknowledged(self, remote: Remote, series: int, got: int, missing: tuple[int, ...],
                     asks: bool) -> None:
        """``remote`` has ``got`` so many of a series and misses some; with ``asks`` it wants a
        heartbeat. One that speaks of an earlier series has got nothing of this one."""
        first = not remote.answered
        if first:
            remote.answered = True
            if self._me.asserting_ns:
                self.assert_liveliness([remote])
        if series != remote.series:
            got, missing, asks = 0, (), True
        remote.acked = got
        if missing:
            pending, remote.wanted = remote.wanted, missing
            if not pending:
                self._me.after(self._params.discovery_nack_response_ns, self._repeat, remote)
        elif asks:
            self._offer([remote], self._wire.built_in_writers if first else 2, directed=True)
            self._book(self._params.discovery_heartbeat_period_ns)  # it may be lost, or its answer

    def _repeat(self, remote: Remote) -> None:
        wanted, remote.wanted = remote.wanted, ()
        if self._me.remotes.get(remote.guid) is remote:
            self._tell_known(remote, wanted)
            self._beats = 0
            self._book(self._params.discovery_heartbeat_period_ns)

    # What is heard.

    def told(self, remote: Remote, series: int, mails: Sequence[Mail],
             lost: Collection[int] = ()) -> None:
        """Some messages of a train, without packets that were ``lost``."""
        if not self._goes_on(remote, series):
            return
        start, known = 0, None
        for mail in mails:
            if not any(number in lost for number in range(start, start + mail.packets)):
                known = mail.known
                remote.held.update(each for each in mail.items if each[0] >= remote.got)
            start += mail.packets
        while remote.got in remote.held:
            item = remote.held.pop(remote.got)
            remote.got += 1
            self._me.learn(remote, item)
        if known is not None:
            self.offered(remote, series, known, 2, True)

    def offered(self, remote: Remote, series: int, known: int, writers: int, directed: bool
                ) -> None:
        """Heartbeats of so many writers, ``directed`` to this participant alone: there are
        ``known`` items."""
        if not self._goes_on(remote, series):
            return
        remote.known = max(remote.known, known)
        if directed:
            remote.asking.directed = True
        remote.beating = max(remote.beating, writers)
        if not remote.answering:
            remote.answering = True
            self._me.after(self._params.discovery_heartbeat_response_ns, self._answer, remote)

    def _goes_on(self, remote: Remote, series: int) -> bool:
        """Whether what is told is not of an earlier series; a new one may begin."""
        if series > remote.heard_series:
            remote.begin(series)
            self._me.after(remote.lease_ns, self._me.forget_others, (remote, series))
        return series == remote.heard_series

    def _answer(self, remote: Remote) -> None:
        """Acknowledge, and ask for what is missing if that was not done just now."""
        now_ns = self._context.now_ns
        missing = tuple(number for number in range(remote.got, remote.known)
                        if number not in remote.held)
        if missing:
            first = missing[0], 0
            wait_ns = remote.asking.wait_ns(first, now_ns, ASK_AGAIN_NS)
            if wait_ns:
                self._me.after(wait_ns, self._answer, remote)
                return
            remote.asking.asks(first, (missing[-1] + 1, 0), now_ns)
        remote.answering = False
        readers = remote.beating if remote.asked else self._wire.built_in_writers
        remote.asked, remote.beating = True, 0
        self._tell("sedp_acknack", remote, [self._wire.acknacks(readers, len(missing))],
                   self._me.dds.acknowledged, remote.heard_series, remote.got, missing, False)

    def _ask(self, what: tuple[Remote, int]) -> None:
        """Without a heartbeat so far, a reader asks for one, and again in doubled times."""
        remote, delay_ns = what
        if remote.asked or self._me.remotes.get(remote.guid) is not remote:
            return
        self._tell("sedp_acknack", remote, [self._wire.acknacks(self._wire.built_in_writers)],
                   self._me.dds.acknowledged, remote.heard_series, remote.got, (), True)
        limit_ns = self._params.initial_acknack_limit_ns
        delay_ns = min(2 * delay_ns, self._me.announcing_ns if limit_ns is None else limit_ns)
        self._me.after(delay_ns, self._ask, (remote, delay_ns))

    def greeted(self, remote: Remote, topic: str, new: bool) -> None:
        """A heartbeat of a writer that every node has, or of liveliness (no topic): one that is new
        to it answers if it knows the writer."""
        if not self._wire.apart:
            if new:
                self._greet_back(remote)
        elif not topic or ("built_in_writer", topic) in remote.built_in:
            remote.greeted[topic] = None
            self._me.after(self._params.heartbeat_response_ns, self._greet_back, remote)

    def _greet_back(self, remote: Remote) -> None:
        self._say("acknack", remote, [self._wire.acknacks(1)], self._me.dds.heard)

    def asked_to_greet(self, remote: Remote, topic: str) -> None:
        """A reader wants to hear a writer that every node has."""
        if ("built_in_reader", topic) in remote.built_in:
            self.greet(remote, topic)

    def heard(self, remote: Remote) -> None:
        """It is there, and that is all."""

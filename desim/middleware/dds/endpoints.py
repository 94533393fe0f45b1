"""SEDP: one participant tells every other one of its endpoints, reliably.

The two writers (publications, subscriptions) are told of as one series: their heartbeats and
acknowledgements travel together anyhow. With the first exchange those of the other built-in
writers travel along.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from desim.middleware.dds import wire
from desim.middleware.dds.remote import Item, Remote

if TYPE_CHECKING:
    from desim.middleware.dds.participant import Participant

TRAIN = 10  # samples in one frame, so that a large fleet's start is not a frame for each of them


class Endpoints:
    """What ``me`` has to tell, and the answers to what it is told. A message is for one life of a
    participant; those that are for a former one, or from strangers, are not read."""

    def __init__(self, me: Participant) -> None:
        self._me = me
        self._params = me.params
        self._context = me.context
        self.items: list[Item] = []  # those that exist
        # A node's endpoints are made some time after its participant.
        self._coming: list[Item] | None = [
            Item(me.guid, "built_in", "matched" if k in (1, 4) else "", size_bytes)
            for k, size_bytes in enumerate(
                wire.built_in_endpoints(self._context.hosts[me.host]))]
        self._beat: Any = None
        self._beats = 0

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
        for remote in me.remotes.values():
            if remote.direct:
                self.tell_new(remote)

    # What is told.

    def tell_new(self, remote: Remote) -> None:
        """Tell what has not been told yet; what is lost of it, the next heartbeats bring up."""
        apart, most_bytes = self._params.endpoints_apart, self._params.repeated_message_bytes
        first, remote.told = remote.told, len(remote.out)
        self._send(remote, range(first, remote.told), 0 if apart else most_bytes,
                   heartbeat=not apart, addressed=False)
        self._beats = 0
        self._book(self._params.heartbeat_period_ns)

    def meet(self, remote: Remote) -> None:
        """Somebody new: offer all there is, and ask for what it has."""
        delay_ns = self._params.initial_acknack_ns
        self._beats = 0
        self._book(self._params.initial_heartbeat_ns)
        if delay_ns is not None:
            self._me.after(delay_ns, self._ask, (remote, delay_ns))

    def greet(self, remote: Remote) -> None:
        """A built-in writer has matched a reader of ``remote``: its first heartbeat."""
        self._tell("endpoints", remote, wire.heartbeats(1), self._me.dds.greeted, True)

    def assert_liveliness(self, remote: Remote) -> None:
        self._tell("liveliness", remote, wire.liveliness(), self._me.dds.greeted, True)

    def _send(self, remote: Remote, numbers: Any, message_bytes: int, *, heartbeat: bool,
              addressed: bool) -> None:
        """Items of these numbers, in trains."""
        for first in range(0, len(numbers), TRAIN):
            train = numbers[first:first + TRAIN]
            last = heartbeat and first + TRAIN >= len(numbers)
            items = tuple((number, remote.out[number]) for number in train)
            chunks = wire.endpoints([item.size_bytes for _, item in items], message_bytes, last,
                                    addressed)
            self._tell("sedp", remote, wire.Chunk(sum(chunk.size_bytes for chunk in chunks),
                                                  sum(chunk.packets for chunk in chunks)),
                       self._me.dds.told, remote.series, items, remote.told if last else None)

    def _tell(self, kind: str, remote: Remote, chunk: wire.Chunk, heard: Any, *what: Any) -> None:
        self._context.tell(kind, self._me.host, [remote.host], chunk.size_bytes, heard,
                           (self._me.guid, remote.guid, *what), segments=chunk.packets)

    def _book(self, delay_ns: int) -> None:
        """A heartbeat not later than then."""
        due_ns = self._context.now_ns + delay_ns
        if self._beat is None or due_ns < self._beat[0]:
            self._beat = due_ns, self._me.after(delay_ns, self._heartbeat, due_ns)

    def _heartbeat(self, due_ns: int) -> None:
        """To all that have not acknowledged everything."""
        if self._beat is None or self._beat[0] != due_ns:
            return
        self._beat = None
        behind = [remote for remote in self._me.remotes.values()
                  if remote.direct and (not remote.answered or remote.acked < remote.told)]
        for remote in behind:
            self._offer(remote, False)
        if behind:
            self._beats += 1
            self._book(min(self._params.heartbeat_limit_ns,
                           self._params.heartbeat_period_ns << min(16, max(0, self._beats - 2))))

    def _offer(self, remote: Remote, directed: bool) -> None:
        writers = 2 if remote.answered else wire.BUILT_IN_WRITERS
        self._tell("sedp_heartbeat", remote, wire.heartbeats(writers), self._me.dds.offered,
                   remote.series, remote.told, directed)

    def acknowledged(self, remote: Remote, series: int, got: int, missing: tuple[int, ...],
                     asks: bool) -> None:
        """``remote`` has ``got`` so many of a series and misses some; with ``asks`` it wants a
        heartbeat. One that speaks of an earlier series has got nothing of this one."""
        if not remote.answered:
            remote.answered = True
            if self._me.asserting_ns:
                self.assert_liveliness(remote)
        if series != remote.series:
            got, missing, asks = 0, (), True
        remote.acked = got
        if missing:
            pending, remote.wanted = remote.wanted, missing
            if not pending:
                self._me.after(self._params.nack_response_ns, self._repeat, remote)
        elif asks:
            self._offer(remote, True)
            self._book(self._params.heartbeat_period_ns)  # this one may be lost, or its answer

    def _repeat(self, remote: Remote) -> None:
        wanted, remote.wanted = remote.wanted, ()
        if self._me.remotes.get(remote.guid) is remote:
            self._send(remote, wanted, self._params.repeated_message_bytes, heartbeat=True,
                       addressed=True)
            self._beats = 0
            self._book(self._params.heartbeat_period_ns)

    # What is heard.

    def told(self, remote: Remote, series: int, items: tuple[tuple[int, Item], ...],
             known: int | None) -> None:
        if not self._goes_on(remote, series):
            return
        for number, item in items:
            if number >= remote.got:
                remote.held[number] = item
        while remote.got in remote.held:
            item = remote.held.pop(remote.got)
            remote.got += 1
            self._me.learn(remote, item)
        if known is not None:
            self.offered(remote, series, known, True)

    def offered(self, remote: Remote, series: int, known: int, directed: bool) -> None:
        """A heartbeat, ``directed`` to this participant alone: there are ``known`` items."""
        if not self._goes_on(remote, series):
            return
        remote.known = max(remote.known, known)
        if directed:
            remote.asking.directed = True
        if not remote.answering:
            remote.answering = True
            self._me.after(self._params.heartbeat_response_ns, self._answer, remote)

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
            wait_ns = remote.asking.wait_ns(first, now_ns, self._params.nack_again_ns)
            if wait_ns:
                self._me.after(wait_ns, self._answer, remote)
                return
            remote.asking.asks(first, (missing[-1] + 1, 0), now_ns)
        remote.answering = False
        readers = 2 if remote.asked else wire.BUILT_IN_WRITERS
        remote.asked = True
        self._tell("sedp_acknack", remote, wire.acknacks(readers, len(missing)),
                   self._me.dds.acknowledged, remote.heard_series, remote.got, missing, False)

    def _ask(self, what: tuple[Remote, int]) -> None:
        """Without a heartbeat so far, a reader asks for one, and again in doubled times."""
        remote, delay_ns = what
        if remote.asked or self._me.remotes.get(remote.guid) is not remote:
            return
        self._tell("sedp_acknack", remote, wire.acknacks(wire.BUILT_IN_WRITERS),
                   self._me.dds.acknowledged, remote.heard_series, remote.got, (), True)
        delay_ns = min(2 * delay_ns, self._me.announcing_ns)
        self._me.after(delay_ns, self._ask, (remote, delay_ns))

    def greeted(self, remote: Remote, wants_answer: bool) -> None:
        if wants_answer:
            self._tell("acknack", remote, wire.acknacks(1), self._me.dds.greeted, False)

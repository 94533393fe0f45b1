"""The reader's side of one reliable link: in order, exactly once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from desim.kernel import Phase
from desim.middleware.dds import wire
from desim.trace import pack

if TYPE_CHECKING:
    from desim.middleware.dds.plugin import Dds
    from desim.middleware.dds.reliable import ReliableLink
    from desim.middleware.dds.remote import Remote
    from desim.middleware.graph import Host
    from desim.middleware.medium import Medium
    from desim.middleware.topics import Message
    from desim.ports.middleware import Offer

OPEN, HELD, DONE = 0, 1, 2  # states of a sample at its reader
MOST = 256  # numbers in an ACKNACK (RTPS)
_NETWORK = Phase.NETWORK  # cheaper than to look it up each time
_ALL_THERE = wire.acknacks(1)


class Sample:
    """A message on one link. ``kept``: the writer can send it again; ``flying``: frames of it on
    their way; ``lacks``: those of its UDP messages that the reader does not have, None for all."""

    __slots__ = ("message", "number", "parts", "kept", "flying", "state", "lacks", "sent_ns")

    def __init__(self, message: Message, number: int, parts: int) -> None:
        self.message = message
        self.number = number
        self.parts = parts  # UDP messages
        self.kept = True
        self.flying = 0
        self.state = OPEN
        self.lacks: dict[int, None] | None = None
        self.sent_ns = message.born_ns


class Reader:
    """Delivers samples in the order of their numbers; those that the writer no longer has are
    passed over. It sees nothing of the writer but what arrives, and it is its own carrier of
    acknowledgements."""

    __slots__ = ("_link", "_dds", "_graph", "_kernel", "_params", "_host", "_writer", "_topic",
                 "_to", "_to_id", "_send", "_post", "_next", "_known", "_held", "_parts", "_timer",
                 "_due_ns", "_seen", "_remote", "_asking", "_row")

    def __init__(self, link: ReliableLink, dds: Dds, offer: Offer, host: Host,
                 medium: Medium) -> None:
        source = offer.publisher.host
        self._link, self._dds, self._params = link, dds, dds.params
        self._graph = dds.context.graph
        self._kernel = self._graph.kernel
        self._host = host
        self._writer = dds.participants[source].guid
        self._topic = offer.publisher.topic
        self._to, self._to_id = (source,), self._graph.hosts[source].id
        self._send, self._post = medium.transmit, medium.post
        self._next = 1
        self._known = 0
        self._held: dict[int, Sample] = {}
        self._parts: dict[int, Sample] = {}  # of which some parts are there
        self._timer: Any = None
        self._due_ns = 0
        self._seen = -1  # state of the matches when it last looked for its writer
        self._remote: Remote | None = None
        self._asking = False
        self._row = self._graph.names.id("acknack")

    def _match(self) -> Remote | None:
        """What this host knows of the writer's participant, None if it has not matched it."""
        dds = self._dds
        if self._seen != dds.matches:
            self._seen = dds.matches
            me = dds.participants[self._host.index]
            current = me is not None and me.guid == self._link.guid
            self._remote = (dds.writer(self._writer, self._host.index, self._topic) if current
                            else None)
        return self._remote

    def take(self, sample: Sample, part: range, first: int, asks: bool) -> bool:
        """A part of a sample has arrived; False if nobody reads here."""
        remote = self._match()
        if remote is None:
            return False
        remote.heard_ns = self._kernel.now_ns
        number = sample.number
        if sample.state == OPEN and number >= self._next and self._complete(sample, part):
            if number == self._next and not self._held:
                self._deliver(sample)
            else:
                sample.state = HELD
                self._held[number] = sample
        if part.stop == sample.parts:
            self._heartbeat(first, number, asks)
        elif first > self._next or self._held:
            self._advance(first)
        return True

    def _complete(self, sample: Sample, part: range) -> bool:
        if len(part) == sample.parts:
            if self._parts:
                self._parts.pop(sample.number, None)
            return True
        if sample.lacks is None:
            sample.lacks = dict.fromkeys(range(sample.parts))
            self._parts[sample.number] = sample
        for index in part:
            sample.lacks.pop(index, None)
        if sample.lacks:
            return False
        self._parts.pop(sample.number, None)
        return True

    def _deliver(self, sample: Sample) -> None:
        sample.state = DONE
        link = self._link
        link.waiting -= 1
        self._next = sample.number + 1
        self._graph.deliver(sample.message, self._host, sample.message.born_ns, sample.sent_ns)

    def _advance(self, first: int) -> None:
        """The writer has nothing before ``first``."""
        held = self._held
        if held:
            for number in sorted(held):
                if number == self._next or number < first:
                    self._deliver(held.pop(number))
                elif number == max(first, self._next):
                    self._next = number
                    self._deliver(held.pop(number))
                else:
                    break
        if first > self._next:
            self._next = first
        for number in [number for number in self._parts if number < self._next]:
            del self._parts[number]

    def _heartbeat(self, first: int, last: int, asks: bool) -> None:
        if first > self._next or self._held:
            self._advance(first)
        if last > self._known:
            self._known = last
        if asks:
            self._answer_in(self._params.heartbeat_response_ns)
        elif self._next <= self._known:
            self._answer_in(self._params.nack_delay_ns)

    def offered(self, first: int, last: int) -> None:
        """A heartbeat of its own has arrived."""
        remote = self._match()
        if remote is not None:
            remote.heard_ns = self._kernel.now_ns
            self._heartbeat(first, last, True)

    def joined(self) -> None:
        """It has matched the writer now, which may have sent something already."""
        if self._params.initial_acknack_ns is not None:
            self._asking = True
            self._answer_in(self._params.initial_acknack_ns)

    def _answer_in(self, delay_ns: int) -> None:
        """Answer then, or when an answer is due anyhow."""
        kernel = self._kernel
        due_ns = kernel.now_ns + delay_ns
        if self._timer is not None:
            if self._due_ns <= due_ns:
                return
            self._timer.cancel()
            self._timer = None
        if delay_ns:
            self._due_ns = due_ns
            self._timer = kernel.after(delay_ns, _NETWORK, self._host.id, self._answer)
        else:
            self._answer(None)

    def _answer(self, _: Any) -> None:
        """Acknowledge what is before the next number, and ask for what is missing from there."""
        self._timer = None
        if self._match() is None:
            return
        graph, own, base = self._graph, self._host, self._next
        missing = self._missing() if base <= self._known else ()
        asks, self._asking = self._asking, False
        graph.put(pack(self._kernel.now_ns, self._row, own.id, self._to_id, base, len(missing)))
        if missing or asks:
            chunk = wire.acknacks(1, len(missing))
            self._send(own.index, self._to, chunk.size_bytes, chunk.packets, False, self,
                       (base, missing, asks))
        else:  # the writer need not do anything
            due_ns = self._post(own.index, self._to, _ALL_THERE.size_bytes, self, (base, (), False))
            if due_ns is not None:
                self._link.note(due_ns, base)

    def _missing(self) -> tuple[tuple[int, tuple[int, ...]], ...]:
        """Numbers that it lacks, each with the parts that it lacks (none: all)."""
        parts, last = self._parts, min(self._known, self._next + MOST - 1)
        return tuple((number, tuple(parts[number].lacks) if number in parts else ())
                     for number in range(self._next, last + 1) if number not in self._held)

    def drop(self, reason: str) -> None:
        """What it held is gone."""
        for sample in self._held.values():
            sample.state = DONE
            self._link.waiting -= 1
            self._graph.drop(sample.message, self._host.index, reason, sample.message.born_ns,
                             sample.sent_ns)
        self._held.clear()
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    # The carrier of its acknowledgements.

    def arrived(self, token: Any, receiver: int) -> None:
        self._link.acknowledged(token, receiver)

    def lost(self, token: Any, receiver: int, reason: str) -> None:
        """The writer's next heartbeat asks again."""

    def repeated(self, token: Any, receiver: int) -> None:
        self._link.acknowledged(token, receiver)

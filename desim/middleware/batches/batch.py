"""A batch, its places for each reception, and the links that are lent to batches."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from desim.engine.kernel import Kernel, Phase, pair
from desim.middleware.contents import Content
from desim.middleware.message import Message
from desim.network.carrier import Carrier
from desim.units import NEVER_NS

if TYPE_CHECKING:
    from desim.middleware.batches.publisher import BatchPublisher
    from desim.middleware.host import Host
    from desim.middleware.topics import PolledSubscription, Publisher
    from desim.middleware.transports import StreamLink


class Batch:
    """Messages that were born at ``born_ns``, the ``ordinal``-th batch of its publishers. Message m
    is number ``seq + m`` of its host and number ``number + m`` of the run; ``content(k)`` is the
    content of publisher k's message. The message at place i arrives at ``arrivals[i]`` ns
    (``NEVER_NS``: that is not known, or its link delivers it); without delay, in round ``round`` of
    the instant of birth. ``open``: the places that are not counted as delivered yet. ``given``: by
    place, those that their links have taken."""

    __slots__ = ("born_ns", "round", "seq", "number", "ordinal", "arrivals", "content", "messages",
                 "sent", "open", "given")

    def __init__(self, born_ns: int, round_: int, seq: int, number: int, ordinal: int,
                 messages: int, places: int, content: Callable[[int], Content]) -> None:
        self.born_ns, self.round = born_ns, round_
        self.seq, self.number, self.ordinal = seq, number, ordinal
        self.arrivals = [NEVER_NS] * places
        self.content = content
        self.messages: list[Message | None] = [None] * messages  # those that were made
        self.sent = False  # whether it is counted as sent
        self.open = dict.fromkeys(range(places))
        self.given: dict[int, Message] = {}

    def over_ns(self, kernel: Kernel) -> int:
        """Messages with arrivals up to this time have landed by now."""
        return kernel.last_over_ns(Phase.DELIVER,
                                   self.round if kernel.now_ns == self.born_ns else 0)


class Member(Carrier[Batch]):
    """One place of a publisher's batches, in the place of the link to one receiver. ``latest``
    keeps the messages there; None: a callback waits for each. It is the carrier of the frames."""

    protocol = "tcp"
    __slots__ = ("publisher", "link", "host", "latest", "ahead", "index", "message_index",
                 "_batches", "_number", "entity", "_elsewhere")

    def __init__(self, batches: BatchPublisher, index: int, message_index: int, number: int,
                 link: StreamLink, publisher: Publisher, host: Host) -> None:
        self.publisher, self.link, self.host = publisher, link, host
        self.latest = publisher.topic.latest.get(host.index)
        self.ahead = True
        self._batches, self._number = batches, number
        self.index, self.message_index = index, message_index
        self.entity = pair(publisher.host.id, host.id)
        self._elsewhere = batches.published  # earlier batches, and messages that the link has taken

    @property
    def ends(self) -> tuple[StreamLink, PolledSubscription | None]:
        """The link, and where messages are kept at its other end."""
        return self.link, self.latest

    @property
    def socket(self) -> object:
        return self.link.socket

    def topics(self, batch: Batch) -> tuple[str, ...]:
        return (self.publisher.topic.name,)

    def expected(self, batch: Batch, receiver: int, arrival_ns: int) -> None:
        if self.index in batch.given:
            self._book(batch, arrival_ns)
        else:
            batch.arrivals[self.index] = arrival_ns
            if self.latest is None:
                kernel = self._batches.kernel
                kernel.after(arrival_ns - kernel.now_ns, Phase.DELIVER, self.entity,
                             self.hand_over, batch)

    def hand_over(self, batch: Batch) -> None:
        """The message has arrived, for a callback that waits for it."""
        if self.index not in batch.given:
            self.host.receive(self.message(batch))

    def message(self, batch: Batch) -> Message:
        """The message at this place."""
        m = self.message_index
        message = batch.messages[m]
        if message is None:
            publisher, make = self.publisher, batch.content
            message = batch.messages[m] = Message(
                publisher.host, publisher.topic, batch.seq + m, self._batches.size_bytes,
                batch.born_ns, make(self._number))
            message.number = batch.number + m
        return message

    def newer(self, known: Message | None) -> Message | None:
        """The last message that has arrived, unless it is ``known`` or older."""
        batch, m = self._batches.last, self.message_index
        if batch is not None and batch.arrivals[self.index] >= self._batches.kernel.now_ns:
            batch = self._last_over()
            if batch is not None and batch.arrivals[self.index] == NEVER_NS:
                return None  # its link delivers it
        if batch is None or known is not None and batch.seq + m <= known.seq:
            return None
        return batch.messages[m] or self.message(batch)

    @property
    def size_bytes(self) -> int:
        """The size of each message."""
        return self._batches.size_bytes

    def landed(self) -> int:
        """The number of messages that have arrived in batches."""
        batch, last = self._last_over(), self._batches.last
        if batch is None or last is None:
            return 0
        return batch.ordinal - self._elsewhere + (batch is not last and self.index in last.given)

    def release(self) -> None:
        """Make events of arrivals that are still to come, at all places of the batches."""
        self._batches.release()

    def give(self, batch: Batch) -> None:
        """Hand the message, which is on its way, over to its link."""
        if self.latest is not None:
            self.latest.catch_up()
        index, arrivals = self.index, batch.arrivals
        arrival_ns, arrivals[index] = arrivals[index], NEVER_NS
        del batch.open[index]
        self._elsewhere += 1
        self._batches.mixed = True
        batch.given[index] = message = self.message(batch)
        self.link.take(message)
        if arrival_ns != NEVER_NS:
            self._book(batch, arrival_ns)

    def _last_over(self) -> Batch | None:
        """The last batch whose message has landed here. It is one of the last two, because a batch
        sets out only when each message of the one before has landed or been taken by its link."""
        batches = self._batches
        last, kernel = batches.last, batches.kernel
        if last is not None:
            arrival_ns = last.arrivals[self.index]
            if arrival_ns >= kernel.now_ns and arrival_ns > last.over_ns(kernel):
                return batches.before
        return last

    def _book(self, batch: Batch, arrival_ns: int) -> None:
        """Make an event of the arrival of a frame that the link has taken."""
        self.link.book(batch.given[self.index], arrival_ns)

    # Unusual fates.

    def arrived(self, batch: Batch, receiver: int) -> None:
        self.link.arrived(self._given(batch), receiver)

    def arrived_in_part(self, batch: Batch, receiver: int, lost: dict[int, str]) -> None:
        self.link.arrived_in_part(self._given(batch), receiver, lost)

    def lost(self, batch: Batch, receiver: int, reason: str) -> None:
        self.link.lost(self._given(batch), receiver, reason)

    def _given(self, batch: Batch) -> Message:
        """The message, which the link takes now if it has not done so."""
        if self.index not in batch.given:
            self._batches.catch_up()  # it waits by the round trips that were measured so far
            self.give(batch)
        return batch.given[self.index]

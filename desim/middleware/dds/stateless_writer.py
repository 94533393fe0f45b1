"""The stateless writer of RTPS (8.4.7.2): best effort, lost with any frame of a sample."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

from desim.network.carrier import Carrier
from desim.ports.middleware import Addressing

if TYPE_CHECKING:
    from desim.middleware.dds.dds import Dds
    from desim.middleware.dds.wire import Guid
    from desim.middleware.message import Message
    from desim.ports.middleware import Advertisement, Route


class BestEffortSample:
    """A message on its way in several frames. ``left``: by receiver, the number of its frames
    without a fate. ``failed``: by receiver, the reason why one of them was lost."""

    __slots__ = ("message", "number", "left", "failed")

    def __init__(self, message: Message, number: int, receivers: tuple[int, ...], frames: int
                 ) -> None:
        self.message = message
        self.number = number
        self.left = dict.fromkeys(receivers, frames)
        self.failed: dict[int, str] = {}


class StatelessWriter(Carrier[BestEffortSample]):
    """The transport of one writer: unicast to each matched reader, or one multicast on each medium.
    A sample at a host that has not matched the writer (yet, or any more) is dropped as
    ``unmatched``. A sample that arrives after a later one is of no use to the reader, and is
    dropped as ``overtaken``."""

    socket = "rtps"  # a participant sends all by one

    def __init__(self, dds: Dds, advertised: Advertisement) -> None:
        self._dds, self._topic = dds, advertised.publisher.topic
        self._context = dds.context
        self._host = advertised.publisher.host
        self._udp = self._context.socket(self._host, self.socket)
        self._node = advertised.publisher.node
        self._guid = dds.participants[self._host].guid
        self._multicast = advertised.via == Addressing.BROADCAST
        self._routes: Sequence[tuple[Route, tuple[int, ...]]] = ()
        self._known: dict[int, Guid] = {}  # receivers and their participants
        self._unrouted: list[int] = []
        self._flying = self._sent = 0
        self._newest: dict[int, int] = {}  # number that each receiver has had

    def connect(self, receivers: list[int]) -> list[int]:
        old = self._known
        self._routes, self._unrouted = self._context.frames(
            self._host, sorted(receivers), self._topic, self._multicast)
        self._known = {receiver: self._dds.reader(self._host, receiver, self._topic)
                       for _, group in self._routes for receiver in group}
        return [receiver for receiver, guid in self._known.items() if old.get(receiver) != guid]

    def send(self, message: Message, only: list[int] | None = None) -> None:
        for medium, group in self._routes:
            wanted = group if only is None else tuple(one for one in group if one in only)
            if wanted:
                self._send(message, medium, wanted)
        if only is None:
            for receiver in self._unrouted:
                self._context.drop(message, receiver, "no_route")

    def _send(self, message: Message, medium: Route, group: tuple[int, ...]) -> None:
        context, host = self._context, self._host
        trains = self._dds.trains(message.size_bytes, ())
        to = medium.id if self._multicast else context.host_ids[group[0]]
        self._sent += 1
        sample = BestEffortSample(message, self._sent, group, len(trains))
        self._flying += len(group)
        for train in trains:
            size = train.size
            context.record_frame(context.host_ids[host], to, message.seq, size.size_bytes)
            self._udp.send(medium, group, size.size_bytes, size.packets, self._multicast, self,
                           sample, train.messages[0].packets, self._node)

    def topics(self, sample: BestEffortSample) -> tuple[str, ...]:
        return (self._topic,)

    def arrived(self, sample: BestEffortSample, receiver: int) -> None:
        self._settle(sample, receiver)

    def arrived_in_part(self, sample: BestEffortSample, receiver: int,
                        lost: dict[int, str]) -> None:
        """A sample is lost with any fragment of it."""
        self.lost(sample, receiver, next(iter(lost.values())))

    def lost(self, sample: BestEffortSample, receiver: int, reason: str) -> None:
        sample.failed.setdefault(receiver, reason)
        self._settle(sample, receiver)

    def missed(self, sample: BestEffortSample, receivers: Collection[int], reason: str,
               medium: object) -> None:
        for receiver in receivers:
            self.lost(sample, receiver, reason)

    def repeated(self, sample: BestEffortSample, receiver: int) -> None:
        """A reader recognises a sample that it has already by its number, and discards it."""
        self._context.repeat(sample.message, receiver)

    def _settle(self, sample: BestEffortSample, receiver: int) -> None:
        sample.left[receiver] -= 1
        if sample.left[receiver]:
            return
        self._flying -= 1
        context, message = self._context, sample.message
        born_ns, reason = message.born_ns, sample.failed.get(receiver)
        if reason is None:
            writer = self._dds.writer(self._guid, receiver, self._topic)
            reason = "unmatched"
            if writer is not None:
                writer.received_ns = context.now_ns
                reason = "overtaken"
                if sample.number > self._newest.get(receiver, 0):
                    self._newest[receiver] = sample.number
                    context.deliver(message, receiver, born_ns, born_ns)
                    return
        context.drop(message, receiver, reason, born_ns, born_ns)

    def close(self, reason: str) -> None:
        """Do nothing: no sample waits here, and frames on their way go on."""
        self._routes, self._known, self._unrouted = [], {}, []

    def waiting(self) -> int:
        return self._flying

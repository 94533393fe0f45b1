"""The way of batches: their receivers and medium, and the counts of what has arrived."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from desim.engine.kernel import Phase
from desim.engine.trace import ROW
from desim.middleware.batches.batch import Batch, Member
from desim.middleware.kernels import DELIVERY
from desim.network.medium import Medium
from desim.units import NEVER_NS

if TYPE_CHECKING:
    from desim.middleware.host import Host
    from desim.middleware.topics import Publisher


@dataclass(frozen=True, slots=True)
class BatchWay:
    """The way of batches of ``host``, with messages of ``size_bytes`` in frames of ``frame`` (bytes
    and segments): the ``members``, one a place, and the ``publishers`` of the messages with their
    places. ``topics``, ``tallied``: of each message, its topic's trace id and place in the tallies.
    ``messages``, ``receivers``, ``hosts``: of each place, the message's number in its batch, and
    the receiver's index and trace id.
    """

    host: Host
    size_bytes: int
    frame: tuple[int, int]
    medium: Medium
    members: list[Member]
    publishers: list[tuple[Publisher, slice]]
    topics: np.ndarray
    tallied: np.ndarray
    messages: np.ndarray
    receivers: tuple[int, ...]
    hosts: np.ndarray
    awaited: list[Member]  # those with a callback
    shortest_ns: np.ndarray  # trip of each place so far

    @classmethod
    def of(cls, host: Host, size_bytes: int, frame: tuple[int, int], members: list[Member]
           ) -> BatchWay | None:
        """The way of ``members``; None if they have no one medium in common."""
        medium = members[0].link.medium if members else None
        if not isinstance(medium, Medium) or any(
                member.link.medium is not medium for member in members):
            return None
        places: dict[Publisher, list[int]] = {}
        for member in members:
            places.setdefault(member.publisher, []).append(member.index)
        publishers = [(publisher, slice(own[0], own[-1] + 1)) for publisher, own in places.items()]
        return cls(host, size_bytes, frame, medium, members, publishers,
                   np.array([publisher.topic.id for publisher, _ in publishers], np.int64),
                   np.array([publisher.topic.place for publisher, _ in publishers], np.int64),
                   np.array([member.message_index for member in members], np.int64),
                   tuple(member.host.index for member in members),
                   np.array([member.host.id for member in members], np.int64),
                   [member for member in members if member.latest is None],
                   np.full(len(members), NEVER_NS))

    def expected_many(self, batch: Batch, delays_ns: Sequence[int]) -> None:
        """See ``Carriers``."""
        now_ns, arrivals = batch.born_ns, batch.arrivals
        arrivals[:len(delays_ns)] = [now_ns + delay_ns for delay_ns in delays_ns]
        after = self.host.graph.kernel.after
        for member in self.awaited:
            arrival_ns = arrivals[member.index]
            if arrival_ns != NEVER_NS:
                after(arrival_ns - now_ns, Phase.DELIVER, member.entity, member.hand_over, batch)

    def count_sent(self, batches: list[Batch]) -> None:
        """Write the rows ``sent`` and ``frame`` of batches."""
        graph, own, born_ns = self.host.graph, self.host.id, _of(batches, "born_ns")[:, None]
        seqs = _of(batches, "seq")[:, None]
        graph.trace.put_rows(_rows(born_ns, graph.SENT, own, self.topics,
                                   seqs + np.arange(len(self.topics)), self.size_bytes))
        graph.trace.put_rows(_rows(born_ns, graph.FRAME, own, self.hosts, seqs + self.messages,
                                   self.frame[0]))
        for batch in batches:
            batch.sent = True
        for publisher, places in self.publishers:
            publisher.topic.counts.intended += len(batches) * (places.stop - places.start)

    def count_arrived(self, batches: list[Batch], arrivals: np.ndarray, landed: np.ndarray) -> None:
        """Write the rows ``delivered`` of the messages that have ``landed`` [batches, places], and
        notify all that count them."""
        graph, births = self.host.graph, _of(batches, "born_ns")
        self._note_trips(np.where(landed, arrivals - births[:, None], NEVER_NS).min(axis=0))
        self.medium.flights.landed_each(self.receivers, *self.frame, landed.sum(axis=0).tolist())
        which, places = landed.nonzero()
        messages, here = self.messages[places], np.empty(len(which), DELIVERY)
        here["number"] = _of(batches, "number")[which] + messages
        here["seq"] = _of(batches, "seq")[which] + messages
        here["topic"], here["place"] = self.topics[messages], self.tallied[messages]
        here["source"], here["receiver"] = self.host.index, np.array(self.receivers)[places]
        here["born_ns"] = here["first_ns"] = here["last_ns"] = births[which]
        here["arrived_ns"], here["size_bytes"] = arrivals[landed], self.size_bytes
        graph.arrivals.note_all(here)
        on_fate = graph.arrivals.on_fate
        if on_fate is not None:
            for k, index in np.argwhere(landed).tolist():
                member, batch = self.members[index], batches[k]
                on_fate(member.message(batch), member.host.index, batch.arrivals[index], None,
                        batch.born_ns, batch.born_ns)

    def _note_trips(self, least_ns: np.ndarray) -> None:
        """Tell the links of trips that are shorter than those before, ``least_ns`` [places]."""
        for index in (least_ns < self.shortest_ns).nonzero()[0].tolist():
            self.shortest_ns[index] = trip_ns = int(least_ns[index])
            self.members[index].link.note_trip(trip_ns)


def _of(batches: list[Batch], field: str) -> np.ndarray:
    return np.array([getattr(batch, field) for batch in batches], np.int64)


def _rows(t_ns: np.ndarray, kind: int, entity: int | np.ndarray, a: int | np.ndarray,
          b: np.ndarray, c: int | np.ndarray) -> np.ndarray:
    """Trace rows of all messages of some batches."""
    rows = np.empty(b.shape, ROW)
    rows["t_ns"], rows["kind"], rows["entity"] = t_ns, kind, entity
    rows["a"], rows["b"], rows["c"] = a, b, c
    return rows.ravel()

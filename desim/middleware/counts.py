"""The counts of messages: fates by topic, latencies in logarithmic bins."""

from __future__ import annotations

import numpy as np

BINS_PER_DECADE = 20
_DECADES = 13  # 1 ns to 10**4 s

# Left edges of all bins but the first, which holds 0 and 1 ns.
EDGES_NS = np.unique(np.ceil(10.0 ** (np.arange(1, _DECADES * BINS_PER_DECADE + 1)
                                      / BINS_PER_DECADE)).astype(np.int64))


class Tallies:
    """Deliveries by topic: ``counts`` [topics], ``bytes`` [topics] without any header, and
    ``latencies`` [topics, bins], where bin i is [EDGES_NS[i-1], EDGES_NS[i])."""

    def __init__(self) -> None:
        self._topics = 0
        self.counts, self.bytes = np.zeros(1, np.int64), np.zeros(1, np.int64)
        self.latencies = np.zeros((1, len(EDGES_NS) + 1), np.int64)

    def join(self) -> int:
        """The place of one more topic."""
        place, self._topics = self._topics, self._topics + 1
        if place == len(self.counts):
            self.counts, self.bytes, self.latencies = (
                np.concatenate((now, np.zeros_like(now)))
                for now in (self.counts, self.bytes, self.latencies))
        return place


class TopicCounts:
    """The fates of one topic's messages.

    Between hosts, one per message and receiving host: published = intended + unmatched, intended =
    delivered + dropped + in flight. A message is unmatched at a host that listened and that the
    publisher did not know; if that gets a latched message later, this is taken back. Delivered
    means that the receiving host has it. Its fate there is a second account, one per message and
    subscription, loopback included: queued = called + overwritten (the queue was full, its oldest
    went: ``messages_replaced`` of a summary) + discarded (the host stopped) + still waiting.
    ``repeated`` counts copies that came after a delivery, which are not in the first account; those
    of datagrams are in the second one, streams throw theirs away.
    """

    __slots__ = ("intended", "unmatched", "dropped", "repeated", "queued", "called", "overwritten",
                 "discarded", "_tallies", "_place")

    def __init__(self, tallies: Tallies, place: int) -> None:
        self._tallies, self._place = tallies, place
        self.intended = self.unmatched = self.repeated = 0
        self.dropped: dict[str, int] = {}
        self.queued = self.called = self.overwritten = self.discarded = 0

    @property
    def published(self) -> int:
        return self.intended + self.unmatched

    @property
    def delivered(self) -> int:
        return int(self._tallies.counts[self._place])

    @property
    def bytes(self) -> int:
        """Delivered, without any header."""
        return int(self._tallies.bytes[self._place])

    @property
    def latencies(self) -> np.ndarray:
        """[len(EDGES_NS) + 1] int64: deliveries by latency."""
        latencies: np.ndarray = self._tallies.latencies[self._place]
        return latencies

    @property
    def in_flight(self) -> int:
        """Waiting in an outbox or on its way."""
        return self.intended - self.delivered - sum(self.dropped.values())

    def drop(self, reason: str, count: int = 1) -> None:
        self.dropped[reason] = self.dropped.get(reason, 0) + count

"""The counts of messages: fates by topic, latencies in logarithmic bins."""

from __future__ import annotations

import numpy as np

BINS_PER_DECADE = 20
_BATCH = 4096
_DECADES = 13  # 1 ns to 10**4 s

# Left edges of all bins but the first, which holds 0 and 1 ns.
EDGES_NS = np.unique(np.ceil(10.0 ** (np.arange(1, _DECADES * BINS_PER_DECADE + 1)
                                      / BINS_PER_DECADE)).astype(np.int64))


class LatencyHistogram:
    """Latencies in bins of a twentieth of a decade; bin i is [EDGES_NS[i-1], EDGES_NS[i]).

    ``add(latency_ns)`` and ``extend`` only append; call ``flush`` now and then to empty the list.
    """

    __slots__ = ("add", "extend", "_bins", "_new", "_folded")

    def __init__(self) -> None:
        self._bins = np.zeros(len(EDGES_NS) + 1, np.int64)
        self._new: list[int] = []
        self._folded = 0  # latencies in bins
        self.add, self.extend = self._new.append, self._new.extend

    @property
    def count(self) -> int:
        """The number of latencies."""
        return self._folded + len(self._new)

    def bins(self) -> np.ndarray:
        """[len(EDGES_NS) + 1] int64 counts."""
        self._fold()
        return self._bins.copy()

    def flush(self) -> None:
        """Sort new latencies into the bins if there are many."""
        if len(self._new) >= _BATCH:
            self._fold()

    def _fold(self) -> None:
        if self._new:
            at = np.searchsorted(EDGES_NS, np.array(self._new, np.int64), side="right")
            self._bins += np.bincount(at, minlength=len(self._bins))
            self._folded += len(self._new)
            self._new.clear()


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

    __slots__ = ("intended", "unmatched", "dropped", "bytes", "latency", "repeated", "queued",
                 "called", "overwritten", "discarded")

    def __init__(self) -> None:
        self.intended = self.unmatched = self.repeated = 0
        self.dropped: dict[str, int] = {}
        self.bytes = 0  # delivered, without any header
        self.latency = LatencyHistogram()
        self.queued = self.called = self.overwritten = self.discarded = 0

    @property
    def published(self) -> int:
        return self.intended + self.unmatched

    @property
    def delivered(self) -> int:
        return self.latency.count

    @property
    def in_flight(self) -> int:
        """Waiting in an outbox or on its way."""
        return self.intended - self.delivered - sum(self.dropped.values())

    def drop(self, reason: str, count: int = 1) -> None:
        self.dropped[reason] = self.dropped.get(reason, 0) + count

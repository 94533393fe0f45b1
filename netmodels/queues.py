"""Queues in front of a line: finite and counted in packets, or one of any length per sender."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from desim import ports
from desim.units import airtime_ns
from netmodels.random_loss import drop


class DropTailQueue:
    """A finite queue: packets leave it one by one as they are sent."""

    def __init__(self, limit: int) -> None:
        self._begins: deque[int] = deque()
        self._limit = limit

    def join(self, now_ns: int, begin_ns: int, each_ns: int, packets: int) -> int:
        """Let in as many of ``packets`` as fit, and return how many. They would be sent from
        ``begin_ns`` on, one each ``each_ns``; one that is sent at once takes no place."""
        begins = self._begins
        while begins and begins[0] <= now_ns:
            begins.popleft()
        at_once = begin_ns <= now_ns
        fit = min(packets, self._limit - len(begins) + at_once)
        begins.extend(begin_ns + k * each_ns for k in range(at_once, fit))
        return fit


def fitting(sizes: Sequence[int], free_bytes: int, idle: bool) -> int:
    """The number of packets, from the first on, for which a queue of bytes has room. The first one
    always passes an ``idle`` line."""
    fit = int(np.searchsorted(np.cumsum(sizes), free_bytes, side="right"))
    return max(fit, 1) if idle else fit


def refuse(context: ports.Context, frame: ports.Frame, fit: int) -> None:
    """Drop all but the first ``fit`` packets of ``frame``: the queue is full."""
    if fit < frame.segments:
        context.settle_many(frame, frame.receivers,
                            drop("queue_full", range(fit, frame.segments), frame.segments))


class QueuedTrain(NamedTuple):
    """The first ``packets`` of a frame, for which its sender's queue had places, and their bytes.
    """

    frame: ports.Frame
    packets: int
    size_bytes: int


def admit(context: ports.Context, frame: ports.Frame, free: int) -> QueuedTrain | None:
    """Let those packets of ``frame`` into a queue for which it has ``free`` places, and drop the
    rest. None: there is none."""
    if free >= frame.segments:
        return QueuedTrain(frame, frame.segments, frame.size_bytes)
    refuse(context, frame, free)
    if not free:
        return None
    sizes = ports.packet_sizes(frame.size_bytes, frame.segments)
    return QueuedTrain(frame, free, sum(sizes[:free]))


class SenderQueues:
    """One unbounded queue per sender. Its frames go out one after another at ``rate_bps``, and
    nobody hinders anybody else: delay = wait behind the sender's own earlier frames + size * 8 /
    rate. Their parts are entered in ``ledger``."""

    def __init__(self, hosts: int, rate_bps: int, ledger: ports.Ledger) -> None:
        self._free_ns = [0] * hosts
        self._rate_bps = rate_bps
        self._ledger = ledger

    def departure_ns(self, host: int) -> int:
        """``ports.KnowsDepartures``."""
        return self._free_ns[host]

    def delay_ns(self, frame: ports.Frame, now_ns: int) -> int:
        """The time until all of ``frame``, which is sent now, is out."""
        return self.taken_ns(frame, now_ns, airtime_ns(frame.size_bytes, self._rate_bps))

    def taken_ns(self, frame: ports.Frame, now_ns: int, sent_ns: int, repeated_ns: int = 0) -> int:
        """The same where it takes ``sent_ns``, and ``repeated_ns`` to repeat parts of it."""
        source = frame.source
        begin_ns = max(now_ns, self._free_ns[source])
        self._free_ns[source] = end_ns = begin_ns + sent_ns + repeated_ns
        self._ledger.spent(frame, ports.TimePart.QUEUE, begin_ns - now_ns)
        self._ledger.spent(frame, ports.TimePart.AIRTIME, sent_ns)
        self._ledger.spent(frame, ports.TimePart.RETRANSMISSION, repeated_ns)
        return end_ns - now_ns

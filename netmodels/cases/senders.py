"""Many senders to one receiver at a given load, and how long to measure them."""

from __future__ import annotations

from typing import NamedTuple

from desim.ports.cases import Arrivals, Flow

_SETTLING = 2000  # packets until a queue that can carry its load is as full as it usually is


def numbered(name: str, count: int) -> tuple[str, ...]:
    """``sender_1``, ``sender_2``, ..."""
    return tuple(f"{name}_{number}" for number in range(1, count + 1))


def flows(sources: tuple[str, ...], receiver: str, size_bytes: int, payload_bytes: int,
          arrivals: Arrivals, every_ns: float = 0, backlog: int = 0) -> list[Flow]:
    """Equal flows, one from each of ``sources``."""
    return [Flow(source, (receiver,), size_bytes, payload_bytes, arrivals, round(every_ns), backlog)
            for source in sources]


class MeasuredSpan(NamedTuple):
    """The duration to play, and its first part, which is not counted. Under overload each sender
    begins with a ``backlog`` of packets, so that queues are full at once."""

    duration_ns: int
    warm_up_ns: int
    backlog: int


def measured_span(packet_ns: float, load: float, queue: int, queues: int, senders: int,
          packets: int, measured_ns: int | None) -> MeasuredSpan:
    """The warm-up until ``queues`` queues of ``queue`` packets each are in a steady state and have
    sent what they began with; then the time of ``packets``, or ``measured_ns``."""
    each_ns, waiting = packet_ns / min(load, 1), queue * queues if load > 1 else 0
    warm_up_ns = round((_SETTLING + waiting) * each_ns)
    return MeasuredSpan(warm_up_ns + (measured_ns or round(packets * each_ns)), warm_up_ns,
                 -(-waiting // senders))

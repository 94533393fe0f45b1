"""Many that send to one at a given load, and how long to watch them."""

from __future__ import annotations

from desim.ports.cases import Arrivals, Flow

_SETTLING = 2000  # packets until a queue that can carry its load is as full as it usually is


def numbered(name: str, count: int) -> tuple[str, ...]:
    """``sender_1``, ``sender_2``, ..."""
    return tuple(f"{name}_{number}" for number in range(1, count + 1))


def flows(sources: tuple[str, ...], receiver: str, size_bytes: int, payload_bytes: int,
          arrivals: Arrivals, every_ns: float = 0) -> list[Flow]:
    """Alike, from each of ``sources``."""
    return [Flow(source, (receiver,), size_bytes, payload_bytes, arrivals, round(every_ns))
            for source in sources]


def spans_ns(packet_ns: float, load: float, room: int, measured_ns: int | None,
             packets: int) -> tuple[int, int]:
    """The whole time, and its first part until queues with ``room`` for so many packets are in a
    steady state: under overload, until they are full and half as long again. So many ``packets``
    are measured unless a time is given."""
    each_ns = packet_ns / min(load, 1)
    filling = 1.5 * room / (load - 1) if load > 1 else 0
    warm_up_ns = round((_SETTLING + filling) * each_ns)
    return warm_up_ns + (measured_ns or round(packets * each_ns)), warm_up_ns

"""The contract with those who listen to the fates of messages."""

from __future__ import annotations

from collections.abc import Callable
from struct import Struct
from typing import TYPE_CHECKING, NamedTuple, Protocol, TypeAlias, runtime_checkable

import numpy as np

if TYPE_CHECKING:
    from desim.middleware.message import Message

# ``on_fate(message, receiver, time_ns, reason, first_ns, last_ns)`` is called with each message's
# fate at each receiving host: ``reason`` None for delivered, the instants of its first and last
# frame, -1 for a message that never became a frame.
OnFate: TypeAlias = Callable[["Message", int, int, "str | None", int, int], object]


class BatchArrivals(NamedTuple):
    """Messages of one host that were delivered: the host, their size, and arrays of their numbers,
    trace ids of their topics, receiving hosts, births (when their frames were sent, too) and
    arrivals."""

    source: int
    size_bytes: int
    numbers: np.ndarray
    topics: np.ndarray
    receivers: np.ndarray
    born_ns: np.ndarray
    arrived_ns: np.ndarray


# A message that was delivered: number, topic's id, source, receiver, bytes, the times (ns) of its
# birth, of its first frame and of its last one, 0, and the time (ns) of its arrival.
pack_delivered = Struct("<10q").pack


@runtime_checkable
class TakesArrivals(Protocol):
    """A listener to the fates of messages that takes deliveries as rows, and many at once."""

    @property
    def note_delivered(self) -> Callable[[bytes], object]:
        """A message was delivered: ``pack_delivered`` of it."""

    def flush_if_full(self) -> object:
        """Now and then there is time to pass on what was delivered."""

    def arrivals(self, batch: BatchArrivals) -> object:
        """All of these messages were delivered."""

"""The contract with those who listen to the fates of messages."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol, TypeAlias, runtime_checkable

import numpy as np

if TYPE_CHECKING:
    from desim.middleware.message import Message

# ``on_fate(message, receiver, time_ns, reason, first_ns, last_ns)`` is called with each message's
# fate at each receiving host: ``reason`` None for delivered, the instants of its first and last
# frame, -1 for a message that never became a frame.
OnFate: TypeAlias = Callable[["Message", int, int, "str | None", int, int], object]


@runtime_checkable
class TakesDeliveries(Protocol):
    """A listener to the fates of messages that takes deliveries many at once, later."""

    def delivered(self, deliveries: np.ndarray) -> object:
        """All of these messages were delivered (``desim.middleware.kernels.DELIVERY``)."""

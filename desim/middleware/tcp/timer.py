"""A timer that is moved with every answer, and hardly ever goes off."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from desim.kernel import Kernel, Phase

_NETWORK = Phase.NETWORK
_NEVER = 1 << 62  # ns


class Timer:
    """Calls ``fired`` at the deadline that ``expect`` has set last, or before: ``expired`` then
    says which of the two, and goes on to the deadline. It is booked anew only for a deadline that
    would be missed otherwise, which costs the least for one that moves on and on."""

    __slots__ = ("_kernel", "_entity", "_fired", "_call", "_booked_ns", "_deadline_ns")

    def __init__(self, kernel: Kernel, entity: int, fired: Callable[[], Any]) -> None:
        self._kernel = kernel
        self._entity = entity
        self._fired = fired
        self._call: Any = None
        self._booked_ns = _NEVER
        self._deadline_ns = 0

    def expect(self, deadline_ns: int) -> None:
        """Something has to happen before ``deadline_ns``."""
        self._deadline_ns = deadline_ns
        if deadline_ns < self._booked_ns:
            if self._call is not None:
                self._call.cancel()
            self._book(deadline_ns)

    def expired(self) -> bool:
        """Whether the deadline has come."""
        deadline_ns = self._deadline_ns
        if deadline_ns <= self._kernel.now_ns:
            return True
        if deadline_ns < self._booked_ns:
            self._book(deadline_ns)
        return False

    def stop(self) -> None:
        if self._call is not None:
            self._call.cancel()
            self._call = None
            self._booked_ns = _NEVER

    def _book(self, time_ns: int) -> None:
        self._booked_ns = time_ns
        self._call = self._kernel.at(time_ns, _NETWORK, self._entity, self._fire)

    def _fire(self, _: Any) -> None:
        self._call = None
        self._booked_ns = _NEVER
        self._fired()

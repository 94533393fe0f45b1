"""A call at the earliest of several times."""

from __future__ import annotations

from collections.abc import Callable

from desim.engine.kernel import Phase
from desim.ports.middleware import Clock
from desim.ports.networks import Handle
from desim.units import NEVER_NS

_NETWORK = Phase.NETWORK  # cheaper than to look it up each time


class Earliest:
    """Calls ``fn(None)`` at ``due_ns``, the earliest of the times that were asked for, in phase
    NETWORK and in the turn of ``entity``. ``fn`` begins with ``stop`` or, as that costs a call,
    with ``due_ns = NEVER_NS``: nothing is asked for any more."""

    __slots__ = ("due_ns", "_clock", "_entity", "_fn", "_call")

    def __init__(self, clock: Clock, entity: int, fn: Callable[[object], object]) -> None:
        self.due_ns = NEVER_NS
        self._clock, self._entity, self._fn = clock, entity, fn
        self._call: Handle | None = None

    def by(self, due_ns: int) -> None:
        """Call it at ``due_ns``, unless it is called before."""
        if due_ns < self.due_ns:
            if self.due_ns < NEVER_NS:
                self.stop()
            self.due_ns, clock = due_ns, self._clock
            after = clock.after
            self._call = after(due_ns - clock.now_ns, _NETWORK, self._entity, self._fn)

    def stop(self) -> None:
        """Ask for no time any more."""
        self.due_ns = NEVER_NS
        if self._call is not None:
            self._call.cancel()
            self._call = None

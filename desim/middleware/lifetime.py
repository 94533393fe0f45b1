"""The time from a host's start to its stop, and timers that end with it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from desim.ports.middleware import MiddlewareContext
    from desim.ports.networks import Handle


class Lifetime:
    """One life of ``host``, from now until ``end``."""

    def __init__(self, context: MiddlewareContext, host: int) -> None:
        self._context, self._host = context, host
        self._lasts = True

    def after(self, delay_ns: int, fn: Callable[..., object], arg: object = None) -> Handle:
        """Call ``fn(arg)`` ``delay_ns`` from now, if this life still lasts."""
        context = self._context
        return context.at(context.now_ns + delay_ns, self._host, self._run, (fn, arg))

    def end(self) -> None:
        """The host stops: nothing is called any more."""
        self._lasts = False

    def _run(self, call: tuple[Callable[..., object], object]) -> None:
        if self._lasts:
            fn, arg = call
            fn(arg)

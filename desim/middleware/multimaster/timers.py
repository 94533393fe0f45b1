"""Timers that end with their host."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from desim.ports.middleware import MiddlewareContext


class Timers:
    """Of ``host``, from its start until ``stop``."""

    def __init__(self, context: MiddlewareContext, host: int) -> None:
        self._context, self._host = context, host
        self._running = True

    def after(self, delay_ns: int, fn: Callable[[Any], Any], arg: Any = None) -> Any:
        """Call ``fn(arg)`` in ``delay_ns``; returns what can be cancelled."""
        return self._context.at(self._context.now_ns + delay_ns, self._host, self._run, (fn, arg))

    def stop(self) -> None:
        self._running = False

    def _run(self, call: tuple[Callable[[Any], Any], Any]) -> None:
        if self._running:
            call[0](call[1])

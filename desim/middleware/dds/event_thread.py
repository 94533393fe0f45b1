"""The thread of a participant's timed events, which stands while the send buffer is full.

Fast DDS: ResourceEvent, and a UDP socket that blocks (non_blocking_send is off); Cyclone DDS: tev,
likewise. A timer that is due again meanwhile, or a message to be answered again, is one call.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from desim.middleware.dds.outbox import Outbox
    from desim.middleware.timers import Lifetime
    from desim.ports.middleware import DatagramSocket

Late = tuple[Callable[..., object], object]


class EventThread:
    """Calls functions at their times or, if nothing more can be sent then, when that is possible.
    ``outbox``: what they post leaves before the next of them."""

    def __init__(self, life: Lifetime, socket: DatagramSocket, outbox: Outbox | None) -> None:
        self._life, self.socket, self._outbox = life, socket, outbox
        self._late: dict[Hashable, Late] = {}
        self._number = 0

    @property
    def stands(self) -> bool:
        """Whether what is due has to wait."""
        return bool(self._late) or self.socket.waits

    def after(self, delay_ns: int, fn: Callable[..., object], arg: object = None) -> None:
        """Call ``fn(arg)`` ``delay_ns`` from now, if this life still lasts."""
        self._life.after(delay_ns, self._due, (fn, arg))

    def answer(self, key: Hashable, fn: Callable[..., object], arg: object) -> None:
        """Call ``fn(arg)`` now, or once for all calls with this ``key`` while the thread stands."""
        if not self.stands:
            fn(arg)
        elif key not in self._late:
            self._wait(key, (fn, arg))

    def _due(self, call: Late) -> None:
        if not self.stands:
            fn, arg = call
            fn(arg)
            return
        self._number += 1
        self._wait(self._number, call)

    def _wait(self, key: Hashable, call: Late) -> None:
        if not self._late:
            self.socket.when_free(self._go_on)
        self._late[key] = call

    def _go_on(self) -> None:
        """Catch up with what is late, as far as there is room."""
        if not self._life.lasts:
            return
        while self._late and not self.socket.waits:
            key = next(iter(self._late))
            fn, arg = self._late[key]
            fn(arg)
            del self._late[key]
            if self._outbox is not None:
                self._outbox.flush()
        if self._late:
            self.socket.when_free(self._go_on)

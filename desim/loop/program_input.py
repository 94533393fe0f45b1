"""The input of real programs, in step with the kernel: they are its federate."""

from __future__ import annotations

import select
from collections.abc import Callable

from desim.engine.kernel import Kernel
from desim.loop.clock import ProgramClock

Take = Callable[[int], object]  # reads all that is there, and books it at this instant (ns)


class ProgramInput:
    """A ``ports.Federate``. Time passes here, by the programs' ``clock``; the kernel is asked to go
    on as soon as something has come."""

    def __init__(self, kernel: Kernel, clock: ProgramClock) -> None:
        self._kernel, self._clock = kernel, clock
        self._takes: dict[int, Take] = {}
        self._epoll = select.epoll()

    def watch(self, descriptor: int, take: Take) -> None:
        """Call ``take`` whenever there is something to read from ``descriptor``."""
        self._takes[descriptor] = take
        self._epoll.register(descriptor, select.EPOLLIN)

    def forget(self, descriptor: int) -> None:
        """Do not look at ``descriptor`` any more."""
        if self._takes.pop(descriptor, None) is not None:
            self._epoll.unregister(descriptor)

    def advance(self, to_ns: int) -> int:
        """See ``ports.Federate``."""
        clock = self._clock
        while (now_ns := clock.now_ns()) < to_ns:
            ready = self._epoll.poll(0)
            if ready:
                now_ns = max(now_ns, self._kernel.now_ns)
                for descriptor, _ in ready:
                    self._takes[descriptor](now_ns)
                return now_ns
            clock.wait(self._epoll, to_ns)
        return to_ns

"""The contract of a federate: another simulator, or real programs, in step with the kernel."""

from __future__ import annotations

from typing import Protocol, runtime_checkable


@runtime_checkable
class Federate(Protocol):
    """Another simulator with a clock of its own, in conservative lock-step with the kernel
    (Chandy and Misra 1979): it is never behind the kernel, and never ahead of what the kernel may
    yet give it. ``Kernel.join`` takes one; a network model that is one joins by itself."""

    def advance(self, to_ns: int) -> int:
        """Advance to ``to_ns``, the time of the kernel's next event, or only to the first output
        before that, which is booked with ``Kernel.at`` for that time. Returns the time reached."""

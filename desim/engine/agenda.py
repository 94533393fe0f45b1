"""The entries of the kernel's agenda: calls, and the ticks of timers."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from desim.errors import KernelError
from desim.units import NS_PER_S

if TYPE_CHECKING:
    from desim.engine.kernel import Kernel, Phase


class Call:
    """One agenda entry: a function and its one argument.

    Made by ``Kernel`` without a constructor, which would be a quarter of the cost of an event. With
    ``callbacks`` it looks to SimPy like a triggered event.
    """

    __slots__ = ("callbacks", "fn", "arg")
    _ok = True
    callbacks: tuple[Callable[[Call], object]]
    fn: Callable[[Any], object]  # takes what ``arg`` is: ``after`` checks it
    arg: object

    def cancel(self) -> None:
        """Do nothing when the time comes. Cancelling twice, or too late, is harmless."""
        self.fn = nothing
        self.arg = None


def nothing(_: object) -> None:
    """The function of a cancelled entry."""


class Tick(Call):
    """The agenda entry of a timer's ticks, one at a time: ``fn`` takes the tick's number.

    Tick k is at ``start_ns + k * step // num``; ``order`` is its phase + entity. The next one is
    booked before ``fn`` is called, so that this may cancel it.
    """

    __slots__ = ("start_ns", "num", "step", "order", "k")

    def __init__(self, fn: Callable[[int], object], start_ns: int, num: int, step: int, order: int,
                 k: int = 0) -> None:
        self.fn, self.start_ns, self.num, self.step, self.order = fn, start_ns, num, step, order
        self.k = k

    def time_ns(self, k: int) -> int:
        """The time of tick ``k``."""
        return self.start_ns + k * self.step // self.num


class Ticker:
    """A timer that can pause. Tick k of f Hz is at ``start + k * 10**9 // f``: it never drifts."""

    __slots__ = ("_kernel", "_place", "_fn", "_tick", "_over")

    def __init__(self, kernel: Kernel, frequency_hz: Fraction | int, phase: Phase, entity: int,
                 fn: Callable[[int], object], start_ns: int) -> None:
        if type(frequency_hz) not in (int, Fraction) or not 0 < frequency_hz <= NS_PER_S:
            raise KernelError(f"frequency_hz must be an int or a Fraction above 0, at most 10**9, "
                              f"got {frequency_hz!r} for {name_of(fn)}")
        self._kernel, self._place, self._fn, self._over = kernel, (phase, entity), fn, False
        self._tick = Tick(fn, start_ns, frequency_hz.numerator,
                          NS_PER_S * frequency_hz.denominator, phase + entity)
        kernel.begin(self._tick, start_ns, phase, entity)

    def time_ns(self, k: int) -> int:
        """The time of tick ``k``."""
        return self._tick.time_ns(k)

    def cancel(self) -> None:
        """No further tick."""
        self._over = True
        self._tick.cancel()

    @property
    def due_ns(self) -> int:
        """The time of the last tick that has passed without a call, or of the next one."""
        return self.time_ns(max(self._tick.k, self._last()))

    def pause(self) -> None:
        """No tick until ``resume``."""
        self._tick.cancel()

    def resume(self) -> None:
        """Go on after ``pause``. Of the ticks that have been due since, the last one is called now,
        and the others are skipped (rclcpp's timers)."""
        if self._over:
            return
        due_ns, old = self.due_ns, self._tick  # which is on the agenda still
        self._tick = Tick(self._fn, old.start_ns, old.num, old.step, old.order,
                          max(old.k, self._last()))
        self._kernel.begin(self._tick, max(self._kernel.now_ns, due_ns), *self._place)

    def _last(self) -> int:
        """The number of the last tick whose time has come."""
        tick = self._tick
        return ((self._kernel.now_ns - tick.start_ns + 1) * tick.num - 1) // tick.step


def name_of(fn: object) -> str:
    """The name of a function, for messages."""
    return str(getattr(fn, "__qualname__", repr(fn)))

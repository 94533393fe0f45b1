"""Timers of nodes whose callbacks take time."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from desim.engine.agenda import Call
from desim.engine.kernel import Kernel, Phase
from desim.middleware.busy.executor import Executor
from desim.units import NS_PER_S

_CONTROL = Phase.CONTROL  # looking a member up costs more than using it


class OneShot:
    """One call of ``fn(arg)``, at ``due_ns`` or when its node is free after that."""

    __slots__ = ("cost_ns", "_executor", "_fn", "_arg", "_call")
    wants_end = False

    def __init__(self, kernel: Kernel, entity: int, executor: Executor, trigger: str,
                 delay_ns: int, fn: Callable[..., object], arg: object) -> None:
        self.cost_ns, self._executor = executor.cost_of(trigger), executor
        self._fn, self._arg = fn, arg
        self._call = kernel.after(delay_ns, Phase.CONTROL, entity, executor.add_due, self)

    def cancel(self) -> None:
        """Do nothing when the time comes."""
        self._call.cancel()
        self._executor.remove(self)

    def run(self) -> int:
        self._fn(self._arg)
        return 0

    def ended(self) -> None:
        """Do nothing: it is called once."""


class BusyTimer:
    """A timer whose callbacks do not pile up, by the rule of roscpp (ros_comm, timer_manager.h:
    ``schedule`` and ``updateNext``).

    When a callback's time is over, the next tick is due a period after this one was due. If that
    instant has passed, the next callback is called at once. If it passed more than a period ago,
    the timer starts anew from now, and ``missed`` gets the number of ticks without a callback.
    Callback number k gets k.
    """

    __slots__ = ("cost_ns", "_kernel", "_entity", "_order", "_executor", "_callback", "_missed",
                 "_num", "_step", "_start_ns", "_k", "_calls", "_call", "wants_end")

    def __init__(self, kernel: Kernel, entity: int, executor: Executor, trigger: str,
                 frequency_hz: Fraction | int, callback: Callable[[int], object], start_ns: int,
                 missed: Callable[[int], object]) -> None:
        self.cost_ns, self._executor = executor.cost_of(trigger), executor
        self._callback = callback
        self._kernel, self._entity, self._order = kernel, entity, _CONTROL + entity
        self._missed = missed
        self._num, self._step = frequency_hz.numerator, NS_PER_S * frequency_hz.denominator
        self._start_ns = start_ns
        self._k = 0  # of the next callback, since ``start_ns``
        self._calls = 0
        self.wants_end = False  # the next tick is due, and the current callback is not over
        self._call: Call | None = kernel.at(start_ns, _CONTROL, entity, self._fall_due)

    def cancel(self) -> None:
        """No further callback."""
        if self._call is not None:
            self._call.cancel()
        self._call = None
        self._executor.remove(self)

    def run(self) -> int:
        self._k = k = self._k + 1
        due_ns, kernel = self._start_ns + k * self._step // self._num, self._kernel
        self.wants_end, call = due_ns < kernel.now_ns, self._call
        if due_ns > kernel.now_ns and call is not None:  # as most often: ``_book`` without its call
            kernel.again(due_ns, self._order, call)
        elif not self.wants_end:
            self._book(due_ns)
        self._calls = calls = self._calls + 1
        self._callback(calls - 1)
        return 0

    def ended(self) -> None:
        if not self.wants_end or self._call is None:  # it is not due yet, or cancelled
            return
        missed, now_ns = self.overdue_ticks(), self._kernel.now_ns
        self.wants_end = False
        if missed:
            self._missed(missed)
            self._start_ns, self._k = now_ns, 0
        self._book(now_ns)

    def overdue_ticks(self) -> int:
        """The ticks that get no callback any more, even if the node has time for the timer now."""
        now_ns = self._kernel.now_ns
        due = self._k if self.wants_end else self._k + 1  # the last one that still gets one
        if self._call is None or self._time_ns(due + 1) >= now_ns:
            return 0
        return (now_ns - self._time_ns(due)) * self._num // self._step

    def _time_ns(self, k: int) -> int:
        return self._start_ns + k * self._step // self._num

    def _book(self, due_ns: int) -> None:
        """Have ``_fall_due`` called then. The call before, if any, has fired."""
        kernel = self._kernel
        if self._call is not None and due_ns > kernel.now_ns:
            kernel.again(due_ns, self._order, self._call)
        else:
            self._call = kernel.at(due_ns, _CONTROL, self._entity, self._fall_due)

    def _fall_due(self, _: object) -> None:
        executor = self._executor
        if executor.current is self and executor.runs(self):
            self.wants_end = True
        else:
            executor.add_due(self)

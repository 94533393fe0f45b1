"""Timers that are postponed often and rarely fire, and timers that end with their host's life."""

from __future__ import annotations

from collections.abc import Callable

from desim.engine.kernel import Phase
from desim.ports.middleware import Clock, MiddlewareContext
from desim.ports.networks import Handle
from desim.units import NEVER_NS

_NETWORK = Phase.NETWORK
NEVER = NEVER_NS


class Timers:
    """One sweep over all timers costs less than an event for each. It takes place before the first
    deadline, and finds most of them moved or met; those that are due within ``ahead_ns`` get an
    event of their own, at their own time and in their own place of that instant."""

    def __init__(self, kernel: Clock, ahead_ns: int) -> None:
        self.kernel = kernel
        self.ahead_ns = ahead_ns
        self._waiting: list[Timer] = []
        self._sweep_ns = NEVER
        self._call: Handle | None = None

    def wait(self, timer: Timer) -> None:
        """Include ``timer`` in the next sweep."""
        self._waiting.append(timer)

    def sweep_before(self, deadline_ns: int) -> None:
        """Make the next sweep no later than ``deadline_ns``, which is more than ``ahead_ns`` away.
        """
        sweep_ns = deadline_ns - self.ahead_ns // 2  # the other half is for what follows it closely
        if sweep_ns < self._sweep_ns:
            if self._call is not None:
                self._call.cancel()
            self._sweep_ns = sweep_ns
            self._call = self.kernel.at(sweep_ns, _NETWORK, 0, self._sweep)

    def _sweep(self, _: object) -> None:
        soon_ns = self._sweep_ns + self.ahead_ns
        self._call, self._sweep_ns = None, NEVER
        waiting, self._waiting = self._waiting, []
        first_ns = NEVER
        due: dict[tuple[int, int], list[Timer]] = {}
        for timer in waiting:
            deadline_ns = timer.deadline_ns
            if soon_ns < deadline_ns < NEVER:
                self._waiting.append(timer)
                if deadline_ns < first_ns:
                    first_ns = deadline_ns
            else:
                timer.waits = False
                if deadline_ns < timer.booked_ns:
                    due.setdefault((deadline_ns, timer.entity), []).append(timer)
        for timers in due.values():
            if len(timers) > 1:
                _Together(self.kernel, timers)
            else:
                timers[0].book()
        if first_ns < NEVER:
            self.sweep_before(first_ns)


class _Together:
    """One event for consecutive timers with the same entity and deadline; they fire in the order of
    booking. (A map that thirty robots share sets thirty heartbeats.) Stands for the call of each.
    """

    __slots__ = ("_timers",)

    def __init__(self, kernel: Clock, timers: list[Timer]) -> None:
        self._timers = timers
        for timer in timers:
            timer.booked_by(self)
        kernel.at(timers[0].deadline_ns, _NETWORK, timers[0].entity, self._fire)

    def cancel(self) -> None:
        """One of them goes off at another time, or not at all."""

    def _fire(self, _: object) -> None:
        for timer in self._timers:
            if timer.call is self:
                timer.fire(None)


class Timer:
    """Calls ``fired`` at ``deadline_ns``, the one that ``expect`` has set last. After the awaited
    event its owner sets it to ``NEVER``."""

    __slots__ = ("deadline_ns", "waits", "_timers", "entity", "_fired", "call", "booked_ns")

    def __init__(self, timers: Timers, entity: int, fired: Callable[[], object]) -> None:
        self.deadline_ns = NEVER
        self.waits = False  # for the next sweep
        self._timers = timers
        self.entity = entity
        self._fired = fired
        self.call: Handle | None = None
        self.booked_ns = NEVER

    def expect(self, deadline_ns: int) -> None:
        """Set the deadline."""
        self.deadline_ns = deadline_ns
        if deadline_ns < self.booked_ns:
            timers = self._timers
            if deadline_ns - timers.kernel.now_ns <= timers.ahead_ns:
                self.book()
                return
            if not self.waits:
                self.waits = True
                timers.wait(self)
            timers.sweep_before(deadline_ns)

    def book(self) -> None:
        """An event of its own, at the deadline, if it has none before."""
        if self.deadline_ns >= self.booked_ns:
            return
        self.booked_by(self._timers.kernel.at(self.deadline_ns, _NETWORK, self.entity, self.fire))

    def booked_by(self, call: Handle) -> None:
        """Its event is this one, at its deadline."""
        if self.call is not None:
            self.call.cancel()
        self.booked_ns, self.call = self.deadline_ns, call

    def stop(self) -> None:
        self.deadline_ns = NEVER
        if self.call is not None:
            self.call.cancel()
            self.call = None
            self.booked_ns = NEVER

    def fire(self, _: object) -> None:
        self.call = None
        self.booked_ns = NEVER
        deadline_ns = self.deadline_ns
        if deadline_ns > self._timers.kernel.now_ns:
            if deadline_ns < NEVER:
                self.expect(deadline_ns)
        else:
            self.deadline_ns = NEVER
            self._fired()


class Lifetime:
    """One life of ``host``, from now until ``end``, and the timers that end with it."""

    def __init__(self, context: MiddlewareContext, host: int) -> None:
        self._context, self._host = context, host
        self.lasts = True

    def after(self, delay_ns: int, fn: Callable[..., object], arg: object = None) -> Handle:
        """Call ``fn(arg)`` ``delay_ns`` from now, if this life still lasts."""
        context = self._context
        return context.at(context.now_ns + delay_ns, self._host, self._run, (fn, arg))

    def end(self) -> None:
        """The host stops: nothing is called any more."""
        self.lasts = False

    def _run(self, call: tuple[Callable[..., object], object]) -> None:
        if self.lasts:
            fn, arg = call
            fn(arg)

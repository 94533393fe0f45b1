"""The clock and the agenda: SimPy with integer nanoseconds and a declared order inside an instant.

Every event has the key (time, round, phase, entity, insertion). SimPy compares (time, priority,
insertion); we pack round, phase and entity into its priority. Insertion then only breaks ties of
one entity with itself, so the order in which robots were declared cannot show in a result.

This is the one module that imports simpy.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from enum import IntEnum
from fractions import Fraction
from typing import Any

import simpy

from desim.errors import KernelError
from desim.units import NS_PER_S

MAX_ROUNDS = 1000

_ENTITY_BITS = 64
_PHASE_BITS = 3
_LAST = 1 << 200  # after everything else of an instant


class Phase(IntEnum):
    """What happens first inside one instant. The order of these members is the definition of a
    tick (ARGoS calls it ``CSpace::Update``): matter moves, sensors look, frames travel, hosts
    receive, controllers decide, the monitor watches."""

    WORLD = 0
    SENSE = 1
    NETWORK = 2
    DELIVER = 3
    CONTROL = 4
    OBSERVE = 5


def pair(source: int, destination: int) -> int:
    """The entity of a delivery: (source, destination), each a 32-bit name id."""
    return source << 32 | destination


class Call:
    """One agenda entry: a function and its one argument. Looks to SimPy like a triggered event."""

    __slots__ = ("callbacks", "fn", "arg", "order")
    _ok = True

    def __init__(self, callbacks: tuple, fn: Callable[[Any], Any], arg: Any, order: int) -> None:
        self.callbacks = callbacks
        self.fn = fn
        self.arg = arg
        self.order = order

    def cancel(self) -> None:
        """Do nothing when the time comes. Cancelling twice, or too late, is harmless."""
        self.fn = _nothing
        self.arg = None


def _nothing(_: Any) -> None:
    pass


class _Halt(BaseException):
    """Ends ``Kernel.run``; not an Exception, so that no callback can swallow it."""


class Ticker:
    """The k-th tick of an f Hz timer is at ``start + k * 10**9 // f``: exact, never drifting."""

    __slots__ = ("_kernel", "_num", "_den", "_phase", "_entity", "_fn", "_start_ns", "_k", "_call")

    def __init__(self, kernel: Kernel, frequency_hz: Fraction, phase: Phase, entity: int,
                 fn: Callable[[int], Any], start_ns: int) -> None:
        self._kernel = kernel
        self._num, self._den = frequency_hz.numerator, frequency_hz.denominator
        self._phase, self._entity, self._fn = phase, entity, fn
        self._start_ns = start_ns
        self._k = 0
        self._call = kernel.at(start_ns, phase, entity, self._tick)

    def time_ns(self, k: int) -> int:
        """When tick ``k`` is due."""
        return self._start_ns + k * NS_PER_S * self._den // self._num

    def _tick(self, _: Any) -> None:
        k = self._k
        self._k = k + 1
        # The next tick is booked first, so that the callback may cancel it.
        self._call = self._kernel.at(self._start_ns + (k + 1) * NS_PER_S * self._den // self._num,
                                     self._phase, self._entity, self._tick)
        self._fn(k)

    def cancel(self) -> None:
        """No further tick."""
        self._call.cancel()


class Kernel:
    """Integer-nanosecond time over a SimPy environment.

    ``env`` may be a foreign SimPy environment whose clock counts integer nanoseconds: the networks
    then run inside a plain SimPy program, driven by its own ``env.run``.
    """

    def __init__(self, env: simpy.Environment | None = None) -> None:
        self.env = simpy.Environment(initial_time=0) if env is None else env
        if type(self.env.now) is not int:
            raise KernelError(f"the SimPy clock must count int nanoseconds, its now is "
                              f"{self.env.now!r}; use simpy.Environment(initial_time=0)")
        self.events = 0
        self._instant_ns = -1  # the time, round and phase of the running call
        self._order = 0
        self._callbacks = (self._fire,)

    @property
    def now_ns(self) -> int:
        return self.env.now

    def at(self, time_ns: int, phase: Phase, entity: int, fn: Callable[[Any], Any],
           arg: Any = None) -> Call:
        """Call ``fn(arg)`` at ``time_ns`` in ``phase``, ordered by ``entity`` (below 2**64).

        Raises ``KernelError`` for a time that is not an int or lies in the past.
        """
        env = self.env
        now_ns = env.now
        if type(time_ns) is not int or time_ns < now_ns:
            raise KernelError(f"time_ns must be an int >= now ({now_ns}), got {time_ns!r} "
                              f"for {_name(fn)}")
        order = phase << _ENTITY_BITS | entity
        if time_ns == now_ns == self._instant_ns:
            order += self._round_for(phase, fn) << (_ENTITY_BITS + _PHASE_BITS)
        call = Call(self._callbacks, fn, arg, order)
        env.schedule(call, order, time_ns - now_ns)
        return call

    def after(self, delay_ns: int, phase: Phase, entity: int, fn: Callable[[Any], Any],
              arg: Any = None) -> Call:
        """Call ``fn(arg)`` after ``delay_ns`` (int >= 0, else ``KernelError``)."""
        if type(delay_ns) is not int or delay_ns < 0:
            raise KernelError(f"delay_ns must be an int >= 0, got {delay_ns!r} for {_name(fn)}")
        return self.at(self.env.now + delay_ns, phase, entity, fn, arg)

    def ticker(self, frequency_hz: Fraction | int, phase: Phase, entity: int,
               fn: Callable[[int], Any], start_ns: int | None = None) -> Ticker:
        """Call ``fn(k)`` for tick k = 0, 1, ...; the first at ``start_ns`` (default: now)."""
        return Ticker(self, Fraction(frequency_hz), phase, entity, fn,
                      self.now_ns if start_ns is None else start_ns)

    def process(self, life: Generator[int, None, None], phase: Phase, entity: int) -> None:
        """Run a generator that yields int nanoseconds to sleep; its errors end the run as they are.

        Driven here and not by ``simpy.Process``, which re-creates exceptions and so masks them.
        """
        def step(_: Any) -> None:
            delay_ns = next(life, None)
            if delay_ns is not None:
                self.after(delay_ns, phase, entity, step)

        self.after(0, phase, entity, step)

    def run(self, until_ns: int) -> None:
        """Fire everything up to and including ``until_ns``, or until ``stop`` ends an instant.

        An exception leaves with its own traceback and a note of the simulated time.
        """
        if type(until_ns) is not int or until_ns < self.now_ns:
            raise KernelError(f"until_ns must be an int >= now ({self.now_ns}), got {until_ns!r}")
        halt = Call(self._callbacks, _halt, None, _LAST)
        self.env.schedule(halt, _LAST, until_ns - self.now_ns)
        step = self.env.step
        try:
            while True:
                step()
        except _Halt:
            halt.cancel()
        except Exception as error:
            error.add_note(f"at simulated time {self.now_ns / NS_PER_S:.9f} s")
            raise

    def stop(self) -> None:
        """End ``run`` when the current instant is complete."""
        self.env.schedule(Call(self._callbacks, _halt, None, _LAST), _LAST, 0)

    def _fire(self, call: Call) -> None:
        self._instant_ns = self.env.now
        self._order = call.order
        self.events += 1
        call.fn(call.arg)

    def _round_for(self, phase: Phase, fn: Callable) -> int:
        """The round for something booked for now: a phase that has passed has to wait for the
        next one."""
        current = self._order >> _ENTITY_BITS
        round_ = (current >> _PHASE_BITS) + (phase <= current & 7)
        if round_ > MAX_ROUNDS:
            raise KernelError(f"more than {MAX_ROUNDS} rounds at {self.now_ns} ns: the loop goes "
                              f"through {_name(fn)} in phase {Phase(phase).name}")
        return round_


def _halt(_: Any) -> None:
    raise _Halt


def _name(fn: Callable) -> str:
    return getattr(fn, "__qualname__", repr(fn))

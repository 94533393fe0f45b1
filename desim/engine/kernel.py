"""The clock and the agenda: SimPy with integer nanoseconds and a declared order inside an instant.

Every event has the key (time, round, phase, entity, insertion). SimPy compares (time, priority,
insertion); we pack round, phase and entity into its priority. Insertion then only breaks ties of
one entity with itself, so the order in which robots were declared cannot show in a result.

This is the one module that imports simpy.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Generator, Sequence
from enum import IntEnum
from fractions import Fraction
from functools import partial
from heapq import heapify, heappop, heappush, heapreplace
from typing import TypeAlias, TypeVar, cast

import simpy
from simpy.core import StopSimulation

from desim.engine.agenda import Call, Tick, Ticker, name_of, nothing
from desim.errors import InputError, KernelError, class_of
from desim.ports.federates import Federate
from desim.units import NS_PER_S

T = TypeVar("T")

# More rounds in one instant are a loop that never ends. (The first minute of scenarios/maze_8.yaml
# and of maze_30.yaml needs one.)
MAX_ROUNDS = 1000

# A priority, from its lowest bit: 64 bits of entity, 3 of phase, the round.
_PHASE_BIT = 64
_PHASE_MASK = 7 << _PHASE_BIT
_ROUND_BIT = 67
_LAST = 1 << 200  # after all else of an instant: MAX_ROUNDS ends below bit 78


class Phase(IntEnum):
    """The phases of an instant, in their order, which is the definition of a tick (ARGoS calls it
    ``CSpace::Update``): matter moves, sensors measure, frames travel, hosts receive, controllers
    decide, the monitor watches. A member's value is its place in the key, above the bits of the
    entity."""

    WORLD = 0 << 64
    SENSE = 1 << 64
    NETWORK = 2 << 64
    DELIVER = 3 << 64
    CONTROL = 4 << 64
    OBSERVE = 5 << 64


def pair(source: int, destination: int) -> int:
    """The entity of a delivery: (source, destination), each a 32-bit name id."""
    return source << 32 | destination


class _End(Call):
    """Ends a ``run``. It is no event of the simulation."""

    __slots__ = ()


Entry: TypeAlias = tuple[int, int, int, Call]  # of the agenda: time, priority, insertion

_new_call = Call.__new__


class Kernel:
    """Integer-nanosecond time over SimPy. ``inside`` joins a foreign environment."""

    def __init__(self) -> None:
        self.now_ns = 0  # read twenty times a message: no property
        self._enter(simpy.Environment(initial_time=0))

    @staticmethod
    def inside(env: simpy.Environment) -> Kernel:
        """A kernel in a foreign environment whose clock counts integer nanoseconds: the networks
        run inside a plain SimPy program, driven by its own ``env.run``. Raises ``KernelError`` for
        another clock."""
        if type(env.now) is not int:
            raise KernelError(f"the SimPy clock must count int nanoseconds, its now is "
                              f"{env.now!r}; use simpy.Environment(initial_time=0)")
        return _Guest(env)

    def _enter(self, env: simpy.Environment) -> None:
        """Use this environment's agenda."""
        self.env = env
        self.events = 0  # calls fired so far
        self._fired: Entry | tuple[int, int] = (-1, 0)  # the agenda entry that fired last
        self._agenda = cast(list[Entry], env._queue)  # its entries are checked when they fire
        self._numbers = env._eid
        self._stopping: Call | None = None
        self._ends = 0  # on the agenda
        self._complete_ns = -1  # the instant at which ``run`` ended last
        self._federate: Federate | None = None
        self._shared: dict[str, object] = {}

    def join(self, federate: Federate) -> None:
        """Run in step with ``federate``. Raises ``InputError`` if another one has joined: neither
        could know how far it may go."""
        if self._federate is not None:
            raise InputError(f"{class_of(self._federate)} and {class_of(federate)} would both be "
                             "in lock-step with the run; only one can")
        self._federate = federate

    def shared(self, name: str, make: Callable[[], T]) -> T:
        """The object that parts of one run have in common under this name. The first who asks makes
        it."""
        if name not in self._shared:
            self._shared[name] = make()
        return cast(T, self._shared[name])  # a name stands for one type

    def after(self, delay_ns: int, phase: Phase, entity: int, fn: Callable[[T], object],
              arg: T | None = None) -> Call:
        """Call ``fn(arg)`` after ``delay_ns`` in ``phase``, ordered by ``entity`` (below 2**64).

        Raises ``KernelError`` for a delay that is not an int (a float, a numpy integer) or is
        negative.
        """
        if type(delay_ns) is not int or delay_ns < 0:
            raise KernelError(f"delay_ns must be an int >= 0, got {delay_ns!r} for {name_of(fn)}")
        call = _new_call(Call)
        call.fn = fn
        call.arg = arg
        # SimPy's ``schedule`` without its call.
        heappush(self._agenda, (self.now_ns + delay_ns,
                                phase + entity if delay_ns else self._next(phase, entity, fn),
                                next(self._numbers), call))
        return call

    def after_all(self, delay_ns: int, phase: Phase, entities: Sequence[int],
                  fn: Callable[[Sequence[T]], object], args: Sequence[T]) -> None:
        """Like ``after`` for each of ``entities`` (ascending) and its own one of ``args``, but
        ``fn`` gets many of these at once: the group splits where another event comes between.
        Raises as ``after`` does."""
        self.after(delay_ns, phase, entities[0], self._fire_all, (entities, fn, args))

    def at(self, time_ns: int, phase: Phase, entity: int, fn: Callable[[T], object],
           arg: T | None = None) -> Call:
        """Call ``fn(arg)`` at ``time_ns``, like ``after``. Raises ``KernelError`` for a time that
        is not an int or lies in the past."""
        self._check_time(time_ns, fn)
        return self.after(time_ns - self.now_ns, phase, entity, fn, arg)

    def _check_time(self, time_ns: int, fn: Callable[..., object]) -> None:
        if type(time_ns) is not int or time_ns < self.now_ns:
            raise KernelError(f"time_ns must be an int >= now ({self.now_ns}), got {time_ns!r} "
                              f"for {name_of(fn)}")

    def ticker(self, frequency_hz: Fraction | int, phase: Phase, entity: int,
               fn: Callable[[int], object], start_ns: int | None = None) -> Ticker:
        """Call ``fn(k)`` for tick k = 0, 1, ...; the first at ``start_ns`` (default: now)."""
        return Ticker(self, frequency_hz, phase, entity, fn,
                      self.now_ns if start_ns is None else start_ns)

    def begin(self, tick: Tick, time_ns: int, phase: Phase, entity: int) -> None:
        """Book the first tick of a timer, or the first one after a pause. Raises as ``at`` does."""
        self._check_time(time_ns, tick.fn)
        self.again(time_ns, phase + entity if time_ns > self.now_ns
                   else self._next(phase, entity, tick.fn), tick)

    def soon(self, call: Call, phase: Phase, entity: int) -> None:
        """Book a call that is not on the agenda for now, in ``phase``, ordered by ``entity``."""
        now_ns, (fired_ns, order, *_) = self.now_ns, self._fired
        if now_ns == fired_ns and order & _PHASE_MASK < phase:  # ``_next`` without its call
            order = phase + entity + (order >> _ROUND_BIT << _ROUND_BIT)
        else:
            order = self._next(phase, entity, call.fn)
        heappush(self._agenda, (now_ns, order, next(self._numbers), call))

    def process(self, life: Generator[int, None, None], phase: Phase, entity: int) -> None:
        """Run a generator that yields int nanoseconds to sleep; its errors end the run as they are.

        Driven here and not by ``simpy.Process``, which re-creates exceptions and so masks them.
        """
        def step(_: object) -> None:
            for delay_ns in life:
                self.after(delay_ns, phase, entity, step)
                return

        step.__qualname__ = name_of(life)  # an error message shall name the generator
        self.after(0, phase, entity, step)

    def run(self, until_ns: int) -> None:
        """Fire everything up to and including ``until_ns``, or until ``stop`` ends an instant.

        An exception leaves with its own type, arguments and traceback, and a note of the
        simulated time.
        """
        if type(until_ns) is not int or until_ns < self.now_ns:
            raise KernelError(f"until_ns must be an int >= now ({self.now_ns}), got {until_ns!r}")
        if self._federate is None:
            self._run(until_ns)
            return
        while not self._run(reached_ns := self._advanced(self._federate, until_ns)):
            if reached_ns == until_ns:
                return

    def _run(self, until_ns: int) -> bool:
        """Fire everything up to and including ``until_ns``; returns whether ``stop`` ended it."""
        self._end_after(until_ns - self.now_ns)
        try:
            self._loop()
        except Exception as error:
            error.add_note(f"at simulated time {self.now_ns / NS_PER_S:.9f} s")
            raise
        finally:
            stopped = self._stopping is not None
            self._drop_ends()
        self._complete_ns = self.now_ns
        return stopped

    def _advanced(self, federate: Federate, until_ns: int) -> int:
        """The time that ``federate`` has reached on its way to the next entry of the agenda."""
        to_ns = int(min(self.next_ns(), until_ns))
        reached_ns = federate.advance(to_ns)
        if type(reached_ns) is not int or not self.now_ns <= reached_ns <= to_ns:
            raise KernelError(f"{class_of(federate)}.advance({to_ns}) at {self.now_ns} ns must "
                              f"return an int between these, got {reached_ns!r}")
        return reached_ns

    def next_ns(self) -> float:
        """The time of the next entry of the agenda; inf if there is none."""
        return self._agenda[0][0] if self._agenda else math.inf

    @property
    def round(self) -> int:
        """The round that runs now: how often this instant has begun anew."""
        time_ns, order = self._fired[:2]
        return order >> _ROUND_BIT if time_ns == self.now_ns else 0

    def last_over_ns(self, phase: Phase, round_: int = 0) -> int:
        """The last instant at which all that was booked for ``phase``, in its round ``round_`` (see
        ``round_of``), has fired."""
        now_ns, (time_ns, order) = self.now_ns, self._fired[:2]
        running = now_ns == time_ns and now_ns != self._complete_ns
        return now_ns - (running and order >> _PHASE_BIT
                         <= (phase >> _PHASE_BIT) + (round_ << _ROUND_BIT - _PHASE_BIT))

    def round_of(self, phase: Phase) -> int:
        """The round of this instant in which a call would fire that is booked for ``phase`` now."""
        return self._next(phase, 0, self.round_of) >> _ROUND_BIT

    def _loop(self) -> None:
        """Like ``env.run()``, but it calls the function directly. SimPy's ``step`` and callback
        list would double the cost of an event. The heap is never empty, because an end is in it.
        ``while queue`` would do as well, but Python 3.11 specializes a running
        function's instructions only at unconditional jumps back: ``while True`` takes 7 % off the
        instructions of a message between hosts (101.7 to 94.1 thousand)."""
        env, queue, numbers = self.env, self._agenda, self._numbers
        while True:
            entry = queue[0]
            call = entry[3]
            env._now = self.now_ns = entry[0]
            if type(call) is Call:
                heappop(queue)
                self._fired = entry
                self.events += 1
                fn = call.fn
                fn(call.arg)
            elif type(call) is Tick:
                self._fired = entry
                self.events += 1
                fn, k = call.fn, call.k
                if fn is nothing:
                    heappop(queue)
                else:
                    call.k = following = k + 1  # ``again`` without its call
                    heapreplace(queue, (call.start_ns + following * call.step // call.num,
                                        call.order, next(numbers), call))
                fn(k)
            elif type(call) is _End:
                heappop(queue)
                self._ends -= 1
                return
            else:  # an event of a foreign environment
                env.step()

    def _drop_ends(self) -> None:
        """Take the ends that did not come off the agenda: the run was stopped, or failed."""
        self._stopping = None
        if self._ends:
            self._agenda[:] = [entry for entry in self._agenda if type(entry[3]) is not _End]
            heapify(self._agenda)
            self._ends = 0

    def stop(self) -> None:
        """End ``run`` (or the foreign environment's) when the current instant is complete."""
        if self._stopping is None:
            self._stopping = self._end_after(0)

    def _end_after(self, delay_ns: int) -> Call:
        """Ends the environment's ``run`` after everything of that instant."""
        call = _new_call(_End)
        call.callbacks = (lambda end: end.fn(end.arg),)
        call.fn, call.arg = self._end, None
        self._ends += 1
        heappush(self._agenda, (self.now_ns + delay_ns, _LAST, next(self._numbers), call))
        return call

    def _end(self, _: object) -> None:
        """End a foreign environment's ``run``."""
        self._stopping = None
        raise StopSimulation(None)

    def again(self, time_ns: int, order: int, call: Call) -> None:
        """Book a call that has fired again, at a later time: ``order`` is phase + entity. It costs
        a third of a new one."""
        heappush(self._agenda, (time_ns, order, next(self._numbers), call))

    def _fire_all(self, group: tuple[Sequence[int], Callable[[Sequence[T]], object], Sequence[T]]
                  ) -> None:
        """Fire those of a group that come before anything else does. What they book themselves
        comes after all of them: it is of a later phase, or of the next round."""
        entities, fn, args = group
        time_ns, order, number, _ = cast(Entry, self._fired)  # a _Guest has no groups
        head, before = self._agenda[0], order - entities[0]
        if head[0] == time_ns and head[1] <= before + entities[-1]:
            count = bisect_left(entities, head[1] - before)
            if count < len(args) and head[1] == before + entities[count] and number < head[2]:
                count += 1
            if count < len(args):
                rest = _new_call(Call)
                rest.fn, rest.arg = self._fire_all, (entities[count:], fn, args[count:])
                heappush(self._agenda, (time_ns, before + entities[count], number, rest))
                args = args[:count]
        fn(args)

    def _next(self, phase: Phase, entity: int, fn: Callable[[T], object]) -> int:
        """The priority of a call that is booked for now: in a phase not later than the one that
        runs, it has to wait for the next round."""
        if self.now_ns != self._fired[0]:
            return phase + entity
        order = self._fired[1]
        round_ = (order >> _ROUND_BIT) + (phase <= order & _PHASE_MASK)
        if round_ > MAX_ROUNDS:
            raise KernelError(f"more than {MAX_ROUNDS} rounds at {self.now_ns} ns: the loop goes "
                              f"through {name_of(fn)} in phase {Phase(phase).name}")
        return phase + entity + (round_ << _ROUND_BIT)


class _Guest(Kernel):
    """A kernel in a foreign environment. The environment's own events move the clock as well, and
    its ``step`` fires our calls."""

    def __init__(self, env: simpy.Environment) -> None:
        self._enter(env)

    def join(self, federate: Federate) -> None:
        raise KernelError(f"{class_of(federate)} cannot be asked before time passes: a foreign "
                          "SimPy environment moves the clock")

    @property
    def now_ns(self) -> int:
        return cast(int, self.env._now)  # ``inside`` has checked it

    @now_ns.setter
    def now_ns(self, time_ns: int) -> None:
        """Do nothing: the environment has the time already."""

    def after(self, delay_ns: int, phase: Phase, entity: int, fn: Callable[[T], object],
              arg: T | None = None) -> Call:
        call = super().after(delay_ns, phase, entity, fn, arg)
        order = phase + entity if delay_ns else self._next(phase, entity, fn)
        call.callbacks = (partial(self._fire, order),)
        return call

    def after_all(self, delay_ns: int, phase: Phase, entities: Sequence[int],
                  fn: Callable[[Sequence[T]], object], args: Sequence[T]) -> None:
        # The environment's own events may come between any two of them.
        for entity, arg in zip(entities, args, strict=True):
            self.after(delay_ns, phase, entity, fn, [arg])

    def soon(self, call: Call, phase: Phase, entity: int) -> None:
        self.again(self.now_ns, self._next(phase, entity, call.fn), call)

    def again(self, time_ns: int, order: int, call: Call) -> None:
        super().again(time_ns, order, call)
        call.callbacks = (partial(self._fire, order),)

    def _fire(self, order: int, call: Call) -> None:
        self._fired = self.now_ns, order
        self.events += 1
        if not isinstance(call, Tick):
            call.fn(call.arg)
            return
        k = call.k
        if call.fn is not nothing:
            call.k = k + 1
            self.again(call.time_ns(k + 1), call.order, call)
        call.fn(k)

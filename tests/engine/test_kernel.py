"""The clock and the agenda, shown by small whole logs."""

import math
import traceback
from contextlib import nullcontext
from fractions import Fraction

import numpy as np
import pytest
import simpy
from hypothesis import given
from hypothesis import strategies as st

from desim.engine.kernel import MAX_ROUNDS, Kernel, Phase, pair
from desim.errors import KernelError

DELIVER, CONTROL = Phase.DELIVER, Phase.CONTROL


@pytest.fixture
def kernel():
    return Kernel()


@pytest.fixture
def log():
    return []


# ------------------------------------------------------------------------------------------- order


def test_time_passes_from_event_to_event(kernel, log):
    kernel.after(30, CONTROL, 0, log.append, "c")
    kernel.at(10, CONTROL, 0, log.append, "a")
    kernel.after(20, CONTROL, 0, lambda arg: log.append((kernel.now_ns, arg)), "b")
    kernel.run(100)
    assert log == ["a", (20, "b"), "c"]
    assert kernel.now_ns == 100
    assert kernel.events == 3


def test_the_next_time_is_that_of_the_next_entry_and_inf_without_any(kernel, log):
    assert kernel.next_ns() == math.inf
    kernel.at(30, CONTROL, 0, log.append, "later")
    kernel.at(10, CONTROL, 0, log.append, "first")
    assert kernel.next_ns() == 10
    kernel.run(20)
    assert (kernel.next_ns(), kernel.now_ns) == (30, 20)
    kernel.run(30)
    assert kernel.next_ns() == kernel.env.peek() == math.inf


@pytest.mark.parametrize("end", ["stopped", "failed"])
def test_a_run_that_ends_early_leaves_nothing_behind(kernel, end):
    def early(_):
        if end == "failed":
            raise ValueError("on purpose")
        kernel.stop()

    kernel.at(10, CONTROL, 0, early)
    kernel.at(30, CONTROL, 0, list)
    with pytest.raises(ValueError) if end == "failed" else nullcontext():
        kernel.run(20)
    assert (kernel.next_ns(), len(kernel.env._queue)) == (30, 1)


def test_phases_are_declared_in_the_order_of_a_tick():
    assert [phase.name for phase in sorted(Phase)] == [
        "WORLD", "SENSE", "NETWORK", "DELIVER", "CONTROL", "OBSERVE"]


KEYS = [(time, phase, entity) for time in (5, 6) for phase in Phase
        for entity in (0, 3, pair(2**32 - 1, 2**32 - 1))]


@given(st.permutations(KEYS))
def test_the_key_decides_not_the_order_of_booking(shuffled):
    kernel, log = Kernel(), []
    for key in shuffled:
        kernel.at(*key, log.append, key)
    kernel.run(6)
    assert log == KEYS


def test_one_entity_with_itself_keeps_its_own_order(kernel, log):
    for word in ("first", "second", "third"):
        kernel.at(5, CONTROL, 7, log.append, word)
    kernel.run(5)
    assert log == ["first", "second", "third"]


def test_what_is_booked_for_now_is_over_behind_its_phase_of_its_round(kernel, log):
    """Booked in CONTROL for DELIVER: another round, which is over in its own CONTROL."""
    def note(_):
        log.append((kernel.round, kernel.last_over_ns(Phase.DELIVER),
                    kernel.last_over_ns(Phase.DELIVER, 1)))

    def control(_):
        log.append((kernel.round_of(Phase.DELIVER), kernel.round_of(Phase.OBSERVE)))
        note(None)
        kernel.after(0, Phase.OBSERVE, 0, note)
        kernel.after(0, Phase.NETWORK, 0, note)
        kernel.after(0, CONTROL, 0, note)

    kernel.at(5, Phase.SENSE, 0, note)
    kernel.at(5, CONTROL, 0, control)
    kernel.run(5)
    assert log == [(0, 4, 4), (1, 0), (0, 5, 4), (0, 5, 4), (1, 5, 4), (1, 5, 5)]
    assert kernel.last_over_ns(Phase.OBSERVE, 7) == 5


def test_a_phase_not_later_than_the_current_one_waits_for_the_next_round(kernel, log):
    def control(_):
        log.append("control 1")
        kernel.after(0, Phase.WORLD, 0, log.append, "world, round 2")
        kernel.after(0, CONTROL, 0, log.append, "control, round 2")
        kernel.after(0, Phase.OBSERVE, 0, log.append, "observe booked by 1")

    kernel.at(5, CONTROL, 1, control)
    kernel.at(5, CONTROL, 2, log.append, "control 2")
    kernel.at(5, Phase.OBSERVE, 1, log.append, "observe")
    kernel.run(5)
    assert log == ["control 1", "control 2", "observe booked by 1", "observe", "world, round 2",
                   "control, round 2"]


def test_rounds_begin_anew_with_each_instant(kernel, log):
    def again(left):
        log.append((kernel.now_ns, left))
        if left:
            kernel.after(0, CONTROL, 0, again, left - 1)
        elif kernel.now_ns < 2:
            kernel.after(1, CONTROL, 0, again, 2)

    kernel.at(1, CONTROL, 0, again, MAX_ROUNDS)
    kernel.run(5)
    assert len(log) == MAX_ROUNDS + 1 + 3
    assert log[-3:] == [(2, 2), (2, 1), (2, 0)]


def test_an_endless_instant_names_its_loop(kernel):
    def ping_pong(_):
        kernel.after(0, DELIVER, 0, ping_pong)

    kernel.at(5, DELIVER, 0, ping_pong)
    with pytest.raises(KernelError, match="more than 1000 rounds at 5 ns: the loop goes through "
                                          ".*ping_pong in phase DELIVER"):
        kernel.run(10)


# ------------------------------------------------------------------------------------- the door


@pytest.mark.parametrize("wrong", [0.5, 1.0, float("nan"), -1, np.int64(7), True, None, "5"])
def test_a_delay_or_time_that_is_no_natural_int_is_refused(kernel, wrong):
    with pytest.raises(KernelError, match="must be an int >= "):
        kernel.after(wrong, CONTROL, 0, print)
    with pytest.raises(KernelError, match="must be an int >= "):
        kernel.at(wrong, CONTROL, 0, print)
    with pytest.raises(KernelError, match="must be an int >= "):
        kernel.run(wrong)
    kernel.run(5)
    assert kernel.now_ns == 5 and type(kernel.now_ns) is int


def test_the_past_is_refused(kernel):
    kernel.run(10)
    with pytest.raises(KernelError, match=r"time_ns must be an int >= now \(10\), got 9 for print"):
        kernel.at(9, CONTROL, 0, print)
    with pytest.raises(KernelError, match="got 9"):
        kernel.run(9)


@pytest.mark.parametrize("wrong", [25.0, 0, -1, Fraction(-1, 2), np.int64(25), 10**9 + 1])
def test_a_frequency_that_is_no_positive_rational_is_refused(kernel, wrong):
    with pytest.raises(KernelError, match="frequency_hz must be an int or a Fraction above 0"):
        kernel.ticker(wrong, CONTROL, 0, print)


@pytest.mark.parametrize("start", [0.0, float("nan"), np.int64(0)])
def test_an_environment_whose_clock_is_no_int_is_refused(start):
    with pytest.raises(KernelError, match="must count int nanoseconds"):
        Kernel.inside(simpy.Environment(initial_time=start))


# ----------------------------------------------------------------------------------------- tickers


def test_sixty_hertz_never_drifts(kernel, log):
    kernel.ticker(60, Phase.WORLD, 0, lambda k: log.append((k, kernel.now_ns)))
    kernel.run(10**9)
    assert log[:4] == [(0, 0), (1, 16_666_666), (2, 33_333_333), (3, 50_000_000)]
    assert log[60] == (60, 10**9)


@given(st.fractions(min_value=Fraction(1, 100), max_value=10**6, max_denominator=10**4),
       st.integers(0, 10**9))
def test_every_tick_is_where_exact_arithmetic_has_it(frequency_hz, start_ns):
    kernel, log = Kernel(), []
    ticker = kernel.ticker(frequency_hz, CONTROL, 0, lambda k: log.append((k, kernel.now_ns)),
                           start_ns)
    kernel.run(start_ns + int(20 * 10**9 / frequency_hz))
    assert log[:20] == [(k, start_ns + int(k * 10**9 / frequency_hz)) for k in range(20)]
    assert ticker.time_ns(10**12) == start_ns + int(10**21 / frequency_hz)


def test_a_ticker_can_be_cancelled_from_its_own_callback(kernel, log):
    def tick(k):
        log.append(k)
        if k == 2:
            ticker.cancel()

    ticker = kernel.ticker(10, CONTROL, 0, tick)
    kernel.run(10**9)
    assert log == [0, 1, 2]


@given(st.fractions(min_value=Fraction(1, 100), max_value=10**6, max_denominator=10**4),
       st.integers(0, 10**9), st.floats(0, 10), st.floats(0, 10))
def test_a_ticker_that_paused_makes_up_for_one_tick(frequency_hz, start_ns, after, pause):
    """Between 9 and 20 periods later it is on its grid again."""
    kernel, log = Kernel(), []
    period_ns = 10**9 / frequency_hz
    ticker = kernel.ticker(frequency_hz, CONTROL, 0, lambda k: log.append((k, kernel.now_ns)),
                           start_ns)
    from_ns, until_ns = (start_ns + int(part * period_ns) for part in (after, after + pause))
    kernel.at(from_ns, Phase.SENSE, 0, lambda _: ticker.pause())
    kernel.at(until_ns, Phase.OBSERVE, 0, lambda _: ticker.resume())
    kernel.run(start_ns + int(40 * period_ns))
    due = [(k, ticker.time_ns(k)) for k in range(40)]
    passed = [tick for tick in due if from_ns <= tick[1] <= until_ns]
    made_up = [(passed[-1][0], until_ns)] if passed else []
    assert log[:30] == ([tick for tick in due if tick[1] < from_ns] + made_up
                        + [tick for tick in due if tick[1] > until_ns])[:30]


def test_a_cancelled_ticker_is_not_resumed(kernel, log):
    ticker = kernel.ticker(10, CONTROL, 0, log.append)
    ticker.pause()
    ticker.cancel()
    ticker.resume()
    kernel.run(10**9)
    assert log == []


# ------------------------------------------------------------------------------------ ending things


def test_a_cancelled_call_does_nothing(kernel, log):
    call = kernel.after(5, CONTROL, 0, log.append, "never")
    kernel.after(3, CONTROL, 0, lambda _: call.cancel())
    kernel.run(10)
    call.cancel()
    assert log == []


def test_run_includes_its_end_and_can_go_on(kernel, log):
    kernel.ticker(Fraction(10**9, 5), CONTROL, 0, lambda k: log.append(kernel.now_ns))
    kernel.run(10)
    assert log == [0, 5, 10]
    kernel.after(0, DELIVER, 0, log.append, "after the end, for now")
    kernel.run(10)
    assert log == [0, 5, 10, "after the end, for now"]
    kernel.run(19)
    assert log[4:] == [15]


def test_stop_completes_the_instant(kernel, log):
    def stop(_):
        kernel.stop()
        kernel.stop()
        kernel.after(0, DELIVER, 0, log.append, "next round of the same instant")

    kernel.at(5, CONTROL, 0, stop)
    kernel.at(5, Phase.OBSERVE, 0, log.append, "observe")
    kernel.at(6, CONTROL, 0, log.append, "later")
    kernel.run(100)
    assert log == ["observe", "next round of the same instant"]
    assert kernel.now_ns == 5
    kernel.run(100)
    assert log[2:] == ["later"]
    assert kernel.now_ns == 100


def test_stop_at_the_very_end_leaves_nothing_behind(kernel, log):
    kernel.at(5, CONTROL, 0, lambda _: kernel.stop())
    kernel.run(5)
    kernel.at(5, CONTROL, 0, log.append, "still here")
    kernel.run(6)
    assert log == ["still here"] and kernel.now_ns == 6


# --------------------------------------------------------------------------------------- processes


def test_a_life_as_a_generator(kernel, log):
    def robot(name, nap_ns):
        for _ in range(2):
            log.append((kernel.now_ns, name))
            yield nap_ns
        log.append((kernel.now_ns, name + " is done"))

    kernel.process(robot("a", 10), CONTROL, 1)
    kernel.process(robot("b", 5), CONTROL, 0)
    kernel.run(100)
    assert log == [(0, "b"), (0, "a"), (5, "b"), (10, "b is done"), (10, "a"), (20, "a is done")]


@pytest.mark.parametrize("wrong", [0.5, None, np.int64(5)])
def test_a_generator_that_yields_no_int_is_named(kernel, wrong):
    def sleeper():
        yield wrong

    kernel.process(sleeper(), CONTROL, 0)
    with pytest.raises(KernelError, match=f"got {wrong!r} for .*sleeper".replace("(", r"\(")
                       .replace(")", r"\)")):
        kernel.run(10)


# ------------------------------------------------------------------------------------------- errors


class Odd(Exception):
    """Cannot be made again from its args."""

    def __init__(self, *, reason):
        super().__init__("odd", 3)
        self.reason = reason


def failing_callback(_):
    raise Odd(reason="callback")


def failing_life():
    yield 1_500_000_000
    failing_callback(None)


@pytest.mark.parametrize("as_process", [False, True])
def test_an_error_leaves_as_it_is_with_the_simulated_time(kernel, as_process):
    if as_process:
        kernel.process(failing_life(), CONTROL, 0)
    else:
        kernel.after(1_500_000_000, CONTROL, 0, failing_callback)
    with pytest.raises(Odd) as caught:
        kernel.run(2 * 10**9)
    error = caught.value
    assert (error.args, error.reason, error.__cause__) == (("odd", 3), "callback", None)
    assert error.__notes__ == ["at simulated time 1.500000000 s"]
    functions = [frame.name for frame in traceback.extract_tb(error.__traceback__)]
    assert functions[-1] == "failing_callback"
    assert ("failing_life" in functions) == as_process


def test_after_an_error_the_rest_of_the_agenda_is_intact(kernel, log):
    kernel.after(5, CONTROL, 0, failing_callback)
    kernel.after(6, CONTROL, 0, log.append, "later")
    with pytest.raises(Odd):
        kernel.run(10)
    kernel.run(20)
    assert log == ["later"] and kernel.now_ns == 20


# ------------------------------------------------------------------------------------ plain SimPy


def test_inside_a_plain_simpy_program():
    env, log = simpy.Environment(), []
    kernel = Kernel.inside(env)

    def plain():
        for _ in range(3):
            yield env.timeout(10)
            log.append((env.now, "process"))
            kernel.after(5, Phase.NETWORK, 0, lambda _: log.append((env.now, "callback")))

    env.process(plain())
    env.run(until=40)
    assert log == [(10, "process"), (15, "callback"), (20, "process"), (25, "callback"),
                   (30, "process"), (35, "callback")]


def test_in_one_instant_with_a_plain_process_phases_still_hold():
    env, log = simpy.Environment(), []
    kernel = Kernel.inside(env)
    rang = env.event()

    def plain():
        yield rang
        log.append("process")
        kernel.after(0, DELIVER, 0, log.append, "deliver, round 2")

    env.process(plain())
    kernel.at(5, CONTROL, 0, lambda _: rang.succeed())
    kernel.at(5, CONTROL, 1, log.append, "control 1")
    env.run(until=10)
    assert log == ["process", "control 1", "deliver, round 2"]


def test_stop_ends_a_plain_simpy_run_too():
    env, log = simpy.Environment(), []
    kernel = Kernel.inside(env)
    kernel.at(5, CONTROL, 0, lambda _: kernel.stop())
    kernel.at(5, Phase.OBSERVE, 0, log.append, "observe")
    env.timeout(50)
    env.run()
    assert log == ["observe"] and env.now == 5
    env.run()
    assert env.now == 50


# --------------------------------------------------------------------------------- many at once

ENTITIES = st.lists(st.integers(0, 6), min_size=1, max_size=5, unique=True).map(sorted)
BOOKINGS = st.lists(st.tuples(st.integers(0, 2), st.sampled_from([DELIVER, CONTROL]), ENTITIES),
                    min_size=1, max_size=8)


def played(bookings, book, kernel):
    """The log of groups, each member of which books something of its own for the same instant."""
    log = []

    def fire(members):
        for name, entity in members:
            log.append((kernel.now_ns, name, entity))
            if name % 2:
                kernel.after(0, CONTROL, entity, log.append, (kernel.now_ns, name, "later"))

    for name, (delay_ns, phase, entities) in enumerate(bookings):
        book(kernel, delay_ns, phase, entities, fire, [(name, entity) for entity in entities])
    kernel.run(2)
    return log


def together(kernel, *booking):
    kernel.after_all(*booking)


def singly(kernel, delay_ns, phase, entities, fn, args):
    for entity, arg in zip(entities, args, strict=True):
        kernel.after(delay_ns, phase, entity, fn, [arg])


def at_the_first(kernel, delay_ns, phase, entities, fn, args):
    """The twin: all of a group come when its first one does."""
    kernel.after(delay_ns, phase, entities[0], fn, args)


@given(BOOKINGS)
def test_many_booked_at_once_come_in_the_order_of_many_bookings(bookings):
    assert played(bookings, together, Kernel()) == played(bookings, singly, Kernel())
    guest = Kernel.inside(simpy.Environment(initial_time=0))
    guest.run = lambda until_ns: guest.env.run(until_ns + 1)
    assert played(bookings, together, guest) == played(bookings, singly, Kernel())


def test_the_twin_that_keeps_many_together_breaks_the_order():
    bookings = [(1, CONTROL, [0, 2]), (1, CONTROL, [1])]
    wanted = played(bookings, singly, Kernel())
    assert played(bookings, together, Kernel()) == wanted
    assert played(bookings, at_the_first, Kernel()) != wanted


def test_many_that_nothing_comes_between_are_one_event(kernel, log):
    kernel.after_all(5, DELIVER, [1, 4, 6], log.append, ["a", "b", "c"])
    kernel.after(5, DELIVER, 7, log.append, "after")
    kernel.after_all(6, DELIVER, [1, 4, 6], log.append, ["d", "e", "f"])
    kernel.after(6, DELIVER, 4, log.append, "between")
    kernel.run(6)
    assert log == [["a", "b", "c"], "after", ["d", "e"], "between", ["f"]]
    with pytest.raises(KernelError, match="delay_ns"):
        kernel.after_all(-1, DELIVER, [1, 4], log.append, ["a", "b"])

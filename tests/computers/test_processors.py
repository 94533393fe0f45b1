"""Processors and their disciplines: whole small logs, exact response times, conserved work."""

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st
from jobs import Play, ends

from desim.computers.processors import Processors
from desim.computers.scheduling import (
    DISCIPLINES,
    FirstInFirstOut,
    FixedPriority,
    Grant,
    ProcessorSharing,
)
from desim.engine.kernel import Kernel
from desim.errors import KernelError

MS = 10**6


# -------------------------------------------------------------------------------- whole logs


def test_first_in_first_out_on_one_processor():
    play = Play("fifo")
    play.add(0, "a", 30)
    play.add(10, "b", 5, priority=9)
    play.add(11, "c", 5)
    assert play.run() == [(0, "a", "begins"), (30, "a", "ends"), (30, "b", "begins"),
                          (35, "b", "ends"), (35, "c", "begins"), (40, "c", "ends")]


def test_a_job_never_uses_more_than_one_processor():
    play = Play("processor_sharing", count=4)
    play.add(0, "alone", 100)
    assert ends(play.run()) == [(100, "alone")]
    assert play.processors.busy_ns() == 100


def test_a_higher_priority_preempts_at_once_and_equals_wait():
    play = Play("fixed_priority")
    play.add(0, "low", 30, priority=1)
    play.add(10, "high", 20, priority=2)
    play.add(15, "also high", 5, priority=2)
    assert play.run() == [(0, "low", "begins"), (10, "high", "begins"), (30, "high", "ends"),
                          (30, "also high", "begins"), (35, "also high", "ends"),
                          (55, "low", "ends")]


def test_a_job_that_is_done_at_the_instant_of_a_higher_ones_arrival_is_done():
    play = Play("fixed_priority")
    play.add(0, "low", 10, priority=1)
    play.add(10, "high", 7, priority=2)
    assert ends(play.run()) == [(10, "low"), (17, "high")]


def test_the_second_processor_takes_the_second_in_line():
    play = Play("fixed_priority", count=2)
    for name, priority in (("low", 1), ("middle", 2), ("high", 3)):
        play.add(0, name, 10, priority)
    assert play.run()[:3] == [(0, "low", "begins"), (0, "middle", "begins"), (0, "high", "begins")]
    assert ends(play.log) == [(10, "high"), (10, "middle"), (20, "low")]


def test_jobs_that_share_a_processor_run_at_half_its_rate():
    play = Play("processor_sharing")
    play.add(0, "long", 100)
    play.add(50, "short", 10)
    # From 50 on each runs at a half: the short one is done at 70, the long one has 40 left then.
    assert ends(play.run()) == [(70, "short"), (110, "long")]


def test_three_jobs_share_two_processors():
    play = Play("processor_sharing", count=2)
    for name in "abc":
        play.add(0, name, 20)
    assert ends(play.run()) == [(30, "a"), (30, "b"), (30, "c")]
    assert play.processors.busy_ns() == 60


def test_a_slow_processor_takes_longer_and_ends_at_a_whole_nanosecond():
    play = Play("fifo", speed=Fraction(3, 10))
    play.add(0, "a", 10)
    play.add(0, "b", 3)
    assert ends(play.run()) == [(34, "a"), (44, "b")]  # 33.3 ns, rounded up, and 10 ns


def test_a_job_that_costs_nothing_takes_no_time_but_waits_for_its_turn():
    play = Play("fifo")
    play.add(0, "a", 10)
    play.add(5, "nothing", 0)
    assert play.run()[1:] == [(10, "a", "ends"), (10, "nothing", "begins"),
                              (10, "nothing", "ends")]


def test_a_withdrawn_job_ends_without_a_word_and_makes_room():
    play = Play("fifo")
    gone = play.add(0, "gone", 100)
    play.add(0, "next", 10)
    play.kernel.at(20, 0, 0, lambda _: play.processors.withdraw(gone))
    assert play.run() == [(0, "gone", "begins"), (20, "next", "begins"), (30, "next", "ends")]
    assert play.processors.busy_ns() == 30


def test_busy_time_counts_a_job_that_still_runs():
    play = Play("processor_sharing", count=2)
    play.add(10, "a", 100)
    play.run(50)
    assert play.processors.busy_ns() == 40 and play.processors.wanted == 1


@pytest.mark.parametrize(("count", "speed"), [(0, Fraction(1)), (1.5, Fraction(1)), (1, 1.0),
                                              (1, Fraction(0))])
def test_processors_that_cannot_be_are_refused(count, speed):
    with pytest.raises(KernelError) as refused:
        Processors(Kernel(), 0, count, speed, FirstInFirstOut())
    assert str(refused.value) == ("processors have an int count >= 1 and a Fraction speed > 0, got "
                                  f"{count!r} and {speed!r}")


# ------------------------------------------------------------------------- response-time analysis


def response_ns(tasks, of):
    """The worst response time of task ``of`` (period, work), the first ones have the higher
    priority: the smallest solution of r = C + sum ceil(r / T_j) C_j (Joseph and Pandya 1986)."""
    response = tasks[of][1]
    while True:
        after = tasks[of][1] + sum(-(-response // period) * work for period, work in tasks[:of])
        if after == response:
            return response
        response = after


def simulated_responses_ns(tasks, discipline="fixed_priority"):
    """The response of each task's first job when all are released at once (the critical instant,
    Liu and Layland 1973), and the worst one of all jobs of a while."""
    play = Play(discipline)
    for rank, (period_ns, work_ns) in enumerate(tasks):
        for k in range(12):
            play.add(k * period_ns, (rank, k), work_ns, priority=-rank)
    released = {(rank, k): k * period_ns for rank, (period_ns, _) in enumerate(tasks)
                for k in range(12)}
    took = {name: time_ns - released[name] for time_ns, name in ends(play.run())}
    return ([took[rank, 0] for rank in range(len(tasks))],
            [max(took[rank, k] for k in range(12)) for rank in range(len(tasks))])


def test_a_textbooks_task_set():
    """Burns and Wellings, Real-Time Systems and Programming Languages, response-time analysis:
    tasks of periods 20, 40, 80 and times 5, 10, 40 have responses 5, 15, 80."""
    tasks = [(20 * MS, 5 * MS), (40 * MS, 10 * MS), (80 * MS, 40 * MS)]
    assert [response_ns(tasks, i) for i in range(3)] == [5 * MS, 15 * MS, 80 * MS]
    assert simulated_responses_ns(tasks) == ([5 * MS, 15 * MS, 80 * MS],) * 2


task_sets = st.lists(st.tuples(st.integers(20, 200), st.integers(1, 12)), min_size=1, max_size=4)


@given(task_sets)
def test_responses_of_periodic_tasks_are_those_of_the_analysis_to_the_nanosecond(tasks):
    if sum(Fraction(work, period) for period, work in tasks) > Fraction(9, 10):
        return
    expected = [response_ns(tasks, i) for i in range(len(tasks))]
    first, worst = simulated_responses_ns(tasks)
    for i, (period, _) in enumerate(tasks):
        if expected[i] <= period:  # else an earlier job of the same task may delay it
            assert first[i] == worst[i] == expected[i]


@pytest.mark.parametrize("discipline", ["fifo", "processor_sharing"])
def test_the_analysis_does_not_hold_without_priorities(discipline):
    tasks = [(20 * MS, 5 * MS), (40 * MS, 10 * MS), (80 * MS, 40 * MS)]
    assert simulated_responses_ns(tasks, discipline)[1][0] > response_ns(tasks, 0)


# --------------------------------------------------------------------------------- conservation

plays = st.lists(st.tuples(st.integers(0, 2000), st.integers(0, 300), st.integers(0, 2)),
                 min_size=1, max_size=25)
speeds = st.fractions(Fraction(1, 20), 10, max_denominator=30)


def played(jobs, discipline, count, speed):
    play = Play(discipline, count, speed)
    for number, (time_ns, work_ns, priority) in enumerate(jobs):
        play.add(time_ns, number, work_ns, priority)
    play.run()
    return play


def lower_bound_ns(jobs, count, speed):
    """All work, if all processors had been busy from the first arrival on, or the longest job."""
    return max(min(time for time, _, _ in jobs)
               + sum(work for _, work, _ in jobs) / (count * speed),
               max(time + work / speed for time, work, _ in jobs))


def check_conservation(play, jobs, count, speed):
    assert len(ends(play.log)) == len(jobs) and play.processors.wanted == 0
    work_ns = sum(work for _, work, _ in jobs)
    # A job's last nanosecond need not be full, nor that of what shares with it.
    assert 0 <= play.processors.busy_ns() - work_ns / speed <= len(jobs) * count
    assert play.log[-1][0] >= lower_bound_ns(jobs, count, speed)


@given(plays, st.sampled_from(sorted(DISCIPLINES)), st.integers(1, 3), speeds)
def test_work_is_neither_lost_nor_made(jobs, discipline, count, speed):
    check_conservation(played(jobs, discipline, count, speed), jobs, count, speed)


@given(plays, speeds)
def test_disciplines_of_one_processor_differ_in_order_alone(jobs, speed):
    """They are work-conserving: a processor is idle only when nobody is ready."""
    by_discipline = [played(jobs, discipline, 1, speed) for discipline in sorted(DISCIPLINES)]
    last_ns = [play.log[-1][0] for play in by_discipline]
    assert max(last_ns) - min(last_ns) <= len(jobs)


@given(plays, st.sets(st.integers(0, 24)), st.sampled_from(sorted(DISCIPLINES)), st.integers(1, 3),
       speeds, st.lists(st.integers(0, 3000), max_size=5))
def test_jobs_that_nobody_waits_for_change_no_other_job(
        jobs, silent, discipline, count, speed, samples_ns):
    """Those that are awaited end as ever, processors are as busy, at any time, and there are
    no more events."""
    logs, busy, events = [], [], []
    for unawaited in (set(), silent):
        play = Play(discipline, count, speed)
        for number, (time_ns, work_ns, priority) in enumerate(jobs):
            play.add(time_ns, number, work_ns, priority, awaited=number not in unawaited)
        seen = []
        for time_ns in samples_ns:
            play.kernel.at(time_ns, 5 << 64, 0,
                           lambda _, play=play, seen=seen: seen.append(play.processors.busy_ns()))
        play.run()
        logs.append([line for line in play.log if line[1] not in silent or line[2] == "begins"])
        busy.append([*seen, play.processors.busy_ns()])
        events.append(play.kernel.events)
    assert logs[0] == logs[1]
    assert busy[0] == busy[1]
    assert events[1] <= events[0]


def test_a_job_that_is_awaited_late_ends_at_its_time_or_is_over():
    play = Play("fifo", count=2)
    early, late = play.add(0, "early", 10, awaited=False), play.add(0, "late", 50, awaited=False)
    for job in (early, late):
        play.kernel.at(30, 0, 0, play.processors.attend, job)
    assert ends(play.run()) == [(50, "late")]
    assert early.over and late.over


class Generous(ProcessorSharing):
    """A twin that gives away more than there is: each of several jobs has a processor."""

    def grant(self, ready, processors):
        return Grant(ready)


class Idle(FixedPriority):
    """A twin that leaves a processor idle."""

    def grant(self, ready, processors):
        return Grant(min(ready, 1), 1, 2)


@pytest.mark.parametrize("twin", [Generous, Idle])
def test_work_is_not_conserved_by_a_wrong_discipline(twin):
    jobs = [(0, 100, 0), (0, 100, 0), (0, 100, 0)]
    with pytest.raises(AssertionError):
        check_conservation(played(jobs, twin, 2, Fraction(1)), jobs, 2, Fraction(1))

"""Virtual machines that share the processors of a node: whole logs, exact ends, conserved work."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from jobs import Play, ends

from desim.computers.cluster_node import ClusterNode
from desim.computers.processors import Processors
from desim.engine.kernel import Kernel
from desim.errors import KernelError

MEAN_NS = 10**6
WITHIN = 0.02


class Machines:
    """Virtual machines of so many processors each, on a node of ``physical`` ones."""

    def __init__(self, physical, virtual, discipline="processor_sharing", node=ClusterNode):
        self.kernel = Kernel()
        self.plays = [Play(discipline, count, kernel=self.kernel, entity=number)
                      for number, count in enumerate(virtual)]
        self.node = node(self.kernel, physical, [play.processors for play in self.plays])
        self.jobs = 0

    def add(self, time_ns, machine, work_ns, priority=0, awaited=True):
        self.plays[machine].add(time_ns, self.jobs, work_ns, priority, awaited)
        self.jobs += 1

    def run(self, until_ns=10**18):
        self.kernel.run(until_ns)
        return dict(sorted((name, time_ns) for play in self.plays
                           for time_ns, name in ends(play.log)))


def played(jobs, *node, **how):
    machines = Machines(*node, **how)
    for time_ns, machine, work_ns in jobs:
        machines.add(time_ns, machine, work_ns)
    return machines, machines.run()


# -------------------------------------------------------------------------------- whole logs


def test_two_machines_share_a_processor():
    machines, ended = played([(0, 0, 100), (50, 1, 10)], 1, (1, 1))
    # From 50 on each has a half: the short job is done at 70, the long one has 40 left then.
    assert ended == {0: 110, 1: 70}
    assert [play.processors.busy_ns() for play in machines.plays] == [110, 20]
    assert (machines.node.busy_ns(), machines.node.waited_ns()) == (110, 20)


def test_a_machines_jobs_share_what_its_processors_have():
    # Three virtual processors have jobs, on two physical ones: two thirds each. The first machine's
    # jobs share one of them: a third each.
    _, ended = played([(0, 0, 20), (0, 0, 20), (0, 1, 20), (0, 2, 20)], 2, (1, 1, 1))
    assert ended == {2: 30, 3: 30, 0: 50, 1: 50}  # from 30 on a half each


def test_a_machine_alone_never_has_more_than_its_virtual_processors():
    _, ended = played([(0, 0, 100), (0, 0, 100)], 8, (1, 8))
    assert ended == {0: 200, 1: 200}


def test_more_virtual_processors_are_a_larger_share():
    _, ended = played([(0, 0, 30), (0, 1, 30), (0, 1, 30)], 1, (1, 2))
    assert ended == {0: 90, 1: 90, 2: 90}


def test_a_machine_in_order_of_arrival_on_a_shared_node():
    _, ended = played([(0, 0, 10), (0, 0, 10), (0, 1, 30)], 1, (1, 1), discipline="fifo")
    assert ended == {0: 20, 1: 40, 2: 50}


def test_a_withdrawn_job_makes_room_for_other_machines():
    machines = Machines(1, (1, 1))
    gone = machines.plays[0].add(0, "gone", 100)
    machines.add(0, 1, 50)
    machines.kernel.at(20, 0, 0, lambda _: machines.plays[0].processors.withdraw(gone))
    assert machines.run() == {0: 60}


def test_loads_are_measured_meanwhile():
    machines = Machines(2, (2, 2))
    for machine in (0, 0, 1):
        machines.add(10, machine, 100)
    machines.run(40)
    assert [play.processors.busy_ns() for play in machines.plays] == [60, 30]
    assert (machines.node.busy_ns(), machines.node.waited_ns()) == (60, 30)


def overcommitted_later():
    """A machine's only job is over when two jobs of another want the node's only processor."""
    machines, ended = played([(0, 0, 10), (20, 1, 100), (21, 1, 100)], 1, (1, 2), discipline="fifo")
    assert ended == {0: 10, 1: 219, 2: 220}
    return [play.processors.busy_ns() for play in machines.plays], machines.node.busy_ns()


def test_a_machine_without_jobs_is_not_busy_while_others_wait():
    assert overcommitted_later() == ([10, 398], 210)


def test_the_twin_that_forgets_the_jobs_that_ended_is_caught(monkeypatch):
    def set_physical_share(processors, share):
        processors.advance()
        processors._physical = share
        processors._set_share()
        processors._book()

    monkeypatch.setattr(Processors, "set_physical_share", set_physical_share)
    assert overcommitted_later() == ([208, 398], 408)


@pytest.mark.parametrize("count", [0, 1.5])
def test_a_node_that_cannot_be_is_refused(count):
    with pytest.raises(KernelError) as refused:
        ClusterNode(Kernel(), count, [])
    assert str(refused.value) == f"a node has an int count of processors >= 1, got {count!r}"


# ------------------------------------------------------------------- against an exact reference


def exact_ends(jobs, physical, virtual, discipline):
    """The ends of ``jobs`` (time, machine, work), in rational numbers. A machine with ``n`` jobs
    wants min(n, its processors); of all that is wanted a share is there, and the machine divides
    its own by the discipline."""
    waiting = sorted(range(len(jobs)), key=lambda job: jobs[job][0])
    left, ended, now = {}, {}, Fraction(0)
    while waiting or left:
        on = [[job for job in left if jobs[job][1] == machine] for machine in range(len(virtual))]
        wanted = [min(len(own), count) for own, count in zip(on, virtual, strict=True)]
        share = min(Fraction(1), Fraction(physical, max(sum(wanted), 1)))
        rates = {job: share * (Fraction(wanted[machine], len(own)) if discipline != "fifo"
                               else place < wanted[machine])
                 for machine, own in enumerate(on) for place, job in enumerate(own)}
        steps = [left[job] / rate for job, rate in rates.items() if rate]
        step = min([*steps, *(jobs[job][0] - now for job in waiting[:1])])
        now += step
        for job, rate in rates.items():
            left[job] -= step * rate
            if not left[job]:
                del left[job]
                ended[job] = now
        while waiting and jobs[waiting[0]][0] <= now:
            left[waiting[0]] = Fraction(jobs[waiting[0]][2])
            waiting.pop(0)
    return ended


JOBS = st.lists(st.tuples(st.integers(0, 20).map(lambda time: 10_000 * time), st.integers(0, 3),
                          st.integers(1, 30).map(lambda work: 10_000 * work)),
                min_size=1, max_size=20)
VIRTUAL = st.tuples(*[st.integers(1, 4)] * 4)
SHARING = st.sampled_from(["processor_sharing", "fifo"])


def differ_ns(jobs, physical, virtual, discipline, node=ClusterNode):
    """The largest difference to the exact ends."""
    _, ended = played(jobs, physical, virtual, discipline=discipline, node=node)
    exact = exact_ends(jobs, physical, virtual, discipline)
    assert ended.keys() == exact.keys()
    return max(abs(ended[job] - exact[job]) for job in exact)


@given(JOBS, st.integers(1, 6), VIRTUAL, SHARING)
def test_jobs_end_when_the_exact_solution_says(jobs, physical, virtual, discipline):
    """Each end is rounded up to a whole nanosecond, and delays the others by as much at most."""
    assert differ_ns(jobs, physical, virtual, discipline) <= len(jobs)


@given(JOBS, st.integers(1, 6))
def test_where_no_job_waits_for_a_virtual_processor_there_is_one_queue(jobs, physical):
    """Whichever machine a job is on. (Its theory: test_queueing_theory.py)"""
    _, ended = played(jobs, physical, (20,) * 4)
    _, pooled = played([(time_ns, 0, work_ns) for time_ns, _, work_ns in jobs], 20, (physical,))
    assert ended.keys() == pooled.keys()
    assert all(abs(ended[job] - pooled[job]) <= len(jobs) for job in ended)


@given(JOBS, st.integers(4, 16), SHARING)
def test_where_nobody_can_wait_machines_are_as_if_alone(jobs, physical, discipline):
    virtual = (1, 1, 1, physical - 3)
    machines, ended = played(jobs, physical, virtual, discipline=discipline)
    alone = {}
    for number, count in enumerate(virtual):
        play = Play(discipline, count)
        for name, (time_ns, machine, work_ns) in enumerate(jobs):
            if machine == number:
                play.add(time_ns, name, work_ns)
        alone |= {name: time_ns for time_ns, name in ends(play.run())}
    assert ended == dict(sorted(alone.items()))
    assert machines.node.waited_ns() == 0


# --------------------------------------------------------------------------------- conservation


def check_conservation(jobs, physical, virtual, discipline, node=ClusterNode):
    machines, ended = played(jobs, physical, virtual, discipline=discipline, node=node)
    work_ns, busy_ns = sum(work for _, _, work in jobs), machines.node.busy_ns()
    assert len(ended) == len(jobs)
    assert 0 <= busy_ns - work_ns <= len(jobs) * physical  # a last nanosecond need not be full
    # Whoever has a job has a processor or waits for one, and processors do not do it twice.
    assert busy_ns + machines.node.waited_ns() == sum(
        play.processors.busy_ns() for play in machines.plays)
    assert max(ended.values()) >= min(time for time, _, _ in jobs) + work_ns / physical


@given(JOBS, st.integers(1, 6), VIRTUAL, SHARING)
def test_work_is_neither_lost_nor_made(jobs, physical, virtual, discipline):
    check_conservation(jobs, physical, virtual, discipline)


@given(JOBS, st.sets(st.integers(0, 19)), st.integers(1, 6), VIRTUAL, SHARING)
def test_jobs_that_nobody_waits_for_change_no_other_job(jobs, silent, physical, virtual,
                                                        discipline):
    seen = []
    for unawaited in (set(), silent):
        machines = Machines(physical, virtual, discipline)
        for number, (time_ns, machine, work_ns) in enumerate(jobs):
            machines.add(time_ns, machine, work_ns, awaited=number not in unawaited)
        ended = machines.run()
        seen.append(({job: time_ns for job, time_ns in ended.items() if job not in silent},
                     machines.node.busy_ns(), machines.node.waited_ns()))
    assert seen[0] == seen[1]


class Generous(ClusterNode):
    """A twin: virtual processors never wait for each other."""

    def __init__(self, kernel, count, machines):
        super().__init__(kernel, count, machines)
        for machine in machines:
            machine.cluster_node = None


class Divided(ClusterNode):
    """A twin: each virtual processor has its share of the node, also while others have no job."""

    def __init__(self, kernel, count, machines):
        super().__init__(kernel, count, machines)
        virtual = sum(machine.count for machine in machines)
        for machine in machines:
            machine.cluster_node = None
            machine.set_physical_share((count, max(virtual, count)))


class ByMachine(ClusterNode):
    """A twin: machines have equal shares, however many of their processors have jobs."""

    def share_out(self):
        super().share_out()
        having = [machine for machine in self.machines if machine.wanted]
        for machine in having:
            if self._now_wanted() > self.count:
                machine.set_physical_share((self.count, len(having) * machine.wanted))


OVERFULL = [(0, 0, 900_000), (0, 0, 900_000), (0, 1, 300_000), (100_000, 2, 300_000)]


@pytest.mark.parametrize("twin", [Generous, Divided, ByMachine])
def test_a_wrong_node_differs_from_the_exact_solution(twin):
    how = (OVERFULL, 2, (2, 1, 1, 1), "processor_sharing")
    assert differ_ns(*how) <= 1 < 10_000 < differ_ns(*how, node=twin)


@pytest.mark.parametrize("twin", [Generous, Divided])
def test_work_is_not_conserved_on_a_wrong_node(twin):
    with pytest.raises(AssertionError):
        check_conservation(OVERFULL, 2, (2, 1, 1, 1), "processor_sharing", node=twin)


# ------------------------------------------------------------------------------ queueing theory


def erlang_c_sojourn_ns(load, count):
    """Of M/M/c, and so of M/M/c with processor sharing (Kleinrock 1975, section 3.5)."""
    offered = load * count
    last = offered**count / math.factorial(count) / (1 - load)
    waits = last / (sum(offered**k / math.factorial(k) for k in range(count)) + last)
    return MEAN_NS + waits * MEAN_NS / (count * (1 - load))


def mean_sojourn_ns(physical, virtual, load, jobs, node=ClusterNode):
    """Poisson arrivals at each machine, exponential work; the means of both are exact."""
    random = np.random.Generator(np.random.Philox(1))
    arrivals_ns = np.sort(random.random(jobs)) * jobs * MEAN_NS / (load * physical)
    work_ns = random.exponential(1.0, jobs)
    work_ns *= MEAN_NS / work_ns.mean()
    machines = Machines(physical, virtual, node=node)
    for time_ns, machine, work in zip(arrivals_ns.astype(np.int64).tolist(),
                                      random.integers(len(virtual), size=jobs).tolist(),
                                      np.rint(work_ns).astype(np.int64).tolist(), strict=True):
        machines.add(time_ns, machine, work)
    machines.run()
    return float(np.mean([sojourn for play in machines.plays for sojourn in play.sojourn_ns]))


def test_machines_with_processors_for_all_jobs_are_one_queue():
    """The node is M/M/c with processor sharing if no job waits for a virtual processor."""
    assert mean_sojourn_ns(1, (1000,) * 3, 0.5, 8_000) == pytest.approx(
        erlang_c_sojourn_ns(0.5, 1), rel=WITHIN)


def closed_throughput(machines, physical, pause):
    """Jobs in a mean job's time, of ``machines`` that each have one job after ``pause`` (in means)
    and so on: the machine-repairman model (Kleinrock 1975, section 3.8), insensitive to the
    distributions with processor sharing."""
    weights, rates = [1.0], [0.0]
    for busy in range(1, machines + 1):
        rates.append(min(busy, physical))
        weights.append(weights[-1] * (machines - busy + 1) / pause / rates[-1])
    return sum(weight * rate for weight, rate in zip(weights, rates, strict=True)) / sum(weights)


def simulated_throughput(count, physical, pause, jobs, node=ClusterNode):
    """The same, of machines with one virtual processor each."""
    random = np.random.Generator(np.random.Philox(3))
    machines = Machines(physical, (1,) * count, node=node)

    def again(play, job):
        work_ns, pause_ns = (max(int(mean * MEAN_NS), 1) for mean in random.exponential(
            (1.0, pause)))
        job.work_ns = work_ns
        machines.kernel.after(pause_ns, 2 << 64, 0, job.arrive)

    for play in machines.plays:
        job = play.add(0, 0, 1)
        job.end = lambda play=play, job=job: (type(job).end(job), again(play, job))
    while sum(len(play.sojourn_ns) for play in machines.plays) < jobs:
        machines.kernel.run(machines.kernel.now_ns + 100 * MEAN_NS)
    return jobs * MEAN_NS / machines.kernel.now_ns


def test_eight_machines_in_turns_on_a_node_are_the_machine_repairman():
    assert simulated_throughput(8, 2, 3.0, 8_000) == pytest.approx(
        closed_throughput(8, 2, 3.0), rel=WITHIN)


@pytest.mark.parametrize("twin", [Generous, Divided])
def test_a_wrong_node_is_none(twin):
    assert simulated_throughput(8, 2, 3.0, 2_000, node=twin) != pytest.approx(
        closed_throughput(8, 2, 3.0), rel=5 * WITHIN)
    assert mean_sojourn_ns(3, (1000,) * 3, 0.7, 2_000, node=twin) != pytest.approx(
        erlang_c_sojourn_ns(0.7, 3), rel=5 * WITHIN)

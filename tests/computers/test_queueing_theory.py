"""Mean waits of processors against queueing theory, within 2 %."""

import math
from fractions import Fraction
from heapq import heappop, heappush

import numpy as np
import pytest
from jobs import Play

from desim.computers.scheduling import FixedPriority, Grant

MEAN_NS = 10**6  # of a job's work
WITHIN = 0.02

# The work of jobs, in means: by the second moment, 1, 2 and 5.
DISTRIBUTIONS = {
    "deterministic": lambda random, jobs: np.ones(jobs),
    "exponential": lambda random, jobs: random.exponential(1.0, jobs),
    # With probability 0.9 half of the mean or so, else five times of it: squared variation 4.
    "hyperexponential": lambda random, jobs: random.exponential(1.0, jobs) * np.where(
        random.random(jobs) < 0.8872983346207417, 1 / (2 * 0.8872983346207417),
        1 / (2 * 0.1127016653792583)),
}


def load_of(load, jobs, distribution, count=1, speed=1.0, seed=1):
    """Arrivals (ns) of a Poisson process, given their number, and the work of each (ns), whose
    mean is exact: chance then moves mean waits less."""
    random = np.random.Generator(np.random.Philox(seed))
    arrivals = np.sort(random.random(jobs)) * jobs * MEAN_NS / (load * count * speed)
    work = DISTRIBUTIONS[distribution](random, jobs)
    return (arrivals.astype(np.int64).tolist(),
            np.rint(work * (MEAN_NS / work.mean())).astype(np.int64).tolist())


def sojourns_ns(discipline, arrivals_ns, work_ns, count=1, speed=Fraction(1)):
    """The times that jobs stay with the processors, in the order of their ends."""
    play = Play(discipline, count, speed)
    for number, (time_ns, work) in enumerate(zip(arrivals_ns, work_ns, strict=True)):
        play.add(time_ns, number, work)
    play.run()
    return play.sojourn_ns


def mean_sojourn_ns(discipline, load, jobs, distribution="deterministic", count=1,
                    speed=Fraction(1)):
    arrivals_ns, work_ns = load_of(load, jobs, distribution, count, float(speed))
    return float(np.mean(sojourns_ns(discipline, arrivals_ns, work_ns, count, speed)))


def waits_ns(arrivals_ns, work_ns, count):
    """The waits in order of arrival, by the recursion of Kiefer and Wolfowitz (1955); for one
    server it is Lindley's."""
    free_ns, waits = [0] * count, []
    for time_ns, work in zip(arrivals_ns, work_ns, strict=True):
        begins_ns = max(heappop(free_ns), time_ns)
        heappush(free_ns, begins_ns + work)
        waits.append(begins_ns - time_ns)
    return waits


def md1_wait_ns(load):
    """Pollaczek and Khinchine."""
    return load * MEAN_NS / (2 * (1 - load))


def mmc_wait_ns(load, count):
    """Erlang's C formula (Kleinrock 1975, section 3.5)."""
    offered = load * count
    last = offered**count / math.factorial(count) / (1 - load)
    waits = last / (sum(offered**k / math.factorial(k) for k in range(count)) + last)
    return waits * MEAN_NS / (count * (1 - load))


@pytest.mark.parametrize(("load", "jobs"), [(0.3, 20_000), (0.6, 30_000)])
def test_m_d_1(load, jobs):
    wait_ns = mean_sojourn_ns("fifo", load, jobs) - MEAN_NS
    assert wait_ns == pytest.approx(md1_wait_ns(load), rel=WITHIN)


@pytest.mark.parametrize(("count", "load"), [(1, 0.5), (2, 0.6), (4, 0.7)])
def test_m_m_c(count, load):
    """Jobs wait to the nanosecond as in the recursion, whose mean over many jobs is Erlang's."""
    arrivals_ns, work_ns = load_of(load, 3_000, "exponential", count)
    expected = [wait + work for wait, work in zip(waits_ns(arrivals_ns, work_ns, count), work_ns,
                                                  strict=True)]
    assert sorted(sojourns_ns("fifo", arrivals_ns, work_ns, count)) == sorted(expected)
    many = waits_ns(*load_of(load, 1_000_000, "exponential", count, seed=2), count)
    assert np.mean(many) == pytest.approx(mmc_wait_ns(load, count), rel=WITHIN)


@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
def test_processor_sharing_is_insensitive_to_the_distribution_of_work(distribution):
    """M/G/1-PS: E[S] / (1 - load), whatever the distribution (Kleinrock 1976, section 4.4)."""
    sojourn_ns = mean_sojourn_ns("processor_sharing", 0.5, 20_000, distribution)
    assert sojourn_ns == pytest.approx(MEAN_NS / 0.5, rel=WITHIN)


def test_several_shared_processors():
    """M/M/c-PS: as many jobs are there as in M/M/c, so that they stay as long on average."""
    sojourn_ns = mean_sojourn_ns("processor_sharing", 0.7, 20_000, "exponential", 4)
    assert sojourn_ns == pytest.approx(MEAN_NS + mmc_wait_ns(0.7, 4), rel=WITHIN)


def test_speed_is_a_scale_of_time():
    slow = mean_sojourn_ns("processor_sharing", 0.5, 2_000, "exponential", speed=Fraction(1, 5))
    assert slow == pytest.approx(5 * mean_sojourn_ns("processor_sharing", 0.5, 2_000,
                                                     "exponential"), rel=1e-6)


class LastFirst(FixedPriority):
    """A twin: last in, first out, preemptive. Its mean is that of processor sharing."""

    def enqueue(self, ready, job):
        ready.insert(0, job)


class Slack(FixedPriority):
    """A twin: a tenth of each processor is lost."""

    def grant(self, ready, processors):
        return Grant(min(ready, processors), 9, 10)


@pytest.mark.parametrize("twin", [LastFirst, Slack])
def test_another_discipline_or_slower_processors_are_not_m_d_1(twin):
    wait_ns = mean_sojourn_ns(twin, 0.6, 5_000) - MEAN_NS
    assert wait_ns > (1 + WITHIN) * md1_wait_ns(0.6)

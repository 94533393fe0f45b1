"""A federate is in lock-step with the kernel: the two together do what one kernel does."""

from __future__ import annotations

import re
from heapq import heappop, heappush

import pytest
import simpy
from hypothesis import given
from hypothesis import strategies as st

from desim.engine.kernel import Kernel, Phase
from desim.errors import InputError, KernelError


class Clockwork:
    """A simulator of its own: each input at t has an output at t + its delay."""

    def __init__(self, kernel, log):
        self.kernel, self.log, self.agenda, self.now_ns = kernel, log, [], 0

    def give(self, work):
        number, delays = work
        self.log.append((self.kernel.now_ns, number))
        if delays:
            heappush(self.agenda, (self.kernel.now_ns + delays[0], number, delays[1:]))

    def advance(self, to_ns):
        assert self.now_ns <= self.kernel.now_ns <= to_ns
        self.now_ns = min(to_ns, self.agenda[0][0] if self.agenda else to_ns)
        while self.agenda and self.agenda[0][0] == self.now_ns:
            _, number, rest = heappop(self.agenda)
            self.kernel.at(self.now_ns, Phase.NETWORK, number, self.give, (number, rest))
        return self.now_ns


class Rash(Clockwork):
    """It does not stop at its first output."""

    def advance(self, to_ns):
        super().advance(to_ns)
        self.now_ns = to_ns
        return to_ns


WORKS = st.lists(st.tuples(st.integers(0, 50), st.lists(st.integers(1, 20), max_size=5)),
                 min_size=1, max_size=8)


def with_federate(works, made=Clockwork):
    kernel, log = Kernel(), []
    federate = made(kernel, log)
    kernel.join(federate)
    for number, (start_ns, delays) in enumerate(works):
        kernel.at(start_ns, Phase.NETWORK, number, federate.give, (number, delays))
    kernel.run(200)
    assert kernel.now_ns == federate.now_ns == 200
    return log


def alone(works):
    kernel, log = Kernel(), []

    def give(work):
        number, delays = work
        log.append((kernel.now_ns, number))
        if delays:
            kernel.after(delays[0], Phase.NETWORK, number, give, (number, delays[1:]))

    for number, (start_ns, delays) in enumerate(works):
        kernel.at(start_ns, Phase.NETWORK, number, give, (number, delays))
    kernel.run(200)
    return log


@given(WORKS)
def test_kernel_and_federate_together_do_what_one_kernel_does(works):
    assert with_federate(works) == alone(works)


def test_one_that_passes_its_first_output_does_not():
    works = [(0, [5, 5]), (3, [10])]
    with pytest.raises((AssertionError, KernelError)):
        assert with_federate(works, Rash) == alone(works)


def test_stop_ends_the_run():
    kernel = Kernel()
    kernel.join(Clockwork(kernel, []))
    kernel.at(7, Phase.WORLD, 0, lambda _: kernel.stop())
    kernel.run(100)
    assert kernel.now_ns == 7
    kernel.run(100)
    assert kernel.now_ns == 100


@pytest.mark.parametrize("answer", [4, 11, 7.0, None])
def test_an_answer_that_is_no_time_on_the_way_is_refused(answer):
    class Wrong:
        def advance(self, to_ns):
            return answer

    kernel = Kernel()
    kernel.run(5)
    kernel.join(Wrong())
    with pytest.raises(KernelError, match=re.escape(
            f").advance(10) at 5 ns must return an int between these, got {answer!r}")):
        kernel.run(10)


def test_a_kernel_has_one_federate():
    kernel = Kernel()
    kernel.join(Clockwork(kernel, []))
    with pytest.raises(InputError, match="Clockwork.* and .*Rash.* would both be in lock-step with "
                                         "the run; only one can"):
        kernel.join(Rash(kernel, []))


def test_a_foreign_environment_has_none():
    kernel = Kernel.inside(simpy.Environment(initial_time=0))
    with pytest.raises(KernelError, match="a foreign SimPy environment moves the clock"):
        kernel.join(Clockwork(kernel, []))

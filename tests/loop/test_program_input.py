"""The input of real programs is a federate of the kernel, with a clock of its own."""

from __future__ import annotations

import os

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from desim.engine.kernel import Kernel, Phase
from desim.errors import KernelError
from desim.loop.program_input import ProgramInput

NOTHING = 1 << 20


class Programs:
    """A clock at whose instants ``writes`` (time_ns, number of a pipe, byte) something comes. It
    wakes ``late_ns`` after that, and each reading of it takes ``poll_ns``."""

    def __init__(self, pipes, writes, late_ns=0, poll_ns=1):
        self.time_ns, self._late_ns, self._poll_ns = 0, late_ns, poll_ns
        self._pipes = [os.pipe() for _ in range(pipes)]
        self._writes = sorted(writes, reverse=True)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        for end in (end for pipe in self._pipes for end in pipe):
            os.close(end)

    def read(self, pipe):
        return list(os.read(self.descriptor(pipe), NOTHING))

    def descriptor(self, pipe):
        return self._pipes[pipe][0]

    def now_ns(self):
        self._pass_to(self.time_ns + self._poll_ns)
        return self.time_ns

    def wait(self, epoll, until_ns):
        first_ns = self._writes[-1][0] if self._writes else until_ns
        self._pass_to(max(self.time_ns, min(first_ns, until_ns)) + self._late_ns)

    def _pass_to(self, time_ns):
        self.time_ns = time_ns
        while self._writes and self._writes[-1][0] <= time_ns:
            _, pipe, byte = self._writes.pop()
            os.write(self._pipes[pipe][1], bytes([byte]))


class Deaf(ProgramInput):
    """It does not look at its clock's limit."""

    def advance(self, to_ns):
        return super().advance(to_ns + 100) + 1


def played(writes, events=(), made=ProgramInput, **clock):
    """All that the kernel saw until 1000 ns: (time_ns, pipe, bytes), and its own ``events``."""
    seen = []
    with Programs(3, writes, **clock) as programs:
        kernel = Kernel()
        inputs = made(kernel, programs)
        kernel.join(inputs)

        def take(pipe, now_ns):
            read = programs.read(pipe)
            kernel.at(now_ns, Phase.NETWORK, pipe,
                      lambda _: seen.append((kernel.now_ns, pipe, read)))

        for pipe in range(3):
            inputs.watch(programs.descriptor(pipe), lambda now_ns, pipe=pipe: take(pipe, now_ns))
        for time_ns in events:
            kernel.at(time_ns, Phase.WORLD, 0, lambda _: seen.append((kernel.now_ns, "event", [])))
        kernel.run(1000)
        assert kernel.now_ns == 1000
    return seen


WRITES = st.lists(st.tuples(st.integers(5, 900), st.integers(0, 2), st.integers(0, 255)),
                  max_size=12, unique_by=lambda write: write[0])


@given(WRITES, st.lists(st.integers(1, 1000), max_size=6), st.integers(0, 20), st.integers(1, 5))
@settings(max_examples=100)
def test_all_input_is_read_in_its_order_and_never_before_it_came(writes, events, late_ns, poll_ns):
    seen = played(writes, events, late_ns=late_ns, poll_ns=poll_ns)
    assert [time_ns for time_ns, *_ in seen] == sorted(time_ns for time_ns, *_ in seen)
    for pipe in range(3):
        due = [(time_ns, byte) for time_ns, of, byte in sorted(writes) if of == pipe]
        got = [(time_ns, byte) for time_ns, of, read in seen if of == pipe for byte in read]
        assert [byte for _, byte in got] == [byte for _, byte in due]
        for (got_ns, _), (due_ns, _) in zip(got, due, strict=True):
            assert got_ns >= due_ns
    assert [time_ns for time_ns, what, _ in seen if what == "event"] == sorted(events)


def test_the_kernel_goes_on_at_the_first_input():
    assert played([(300, 1, 7), (100, 0, 8)], [50, 200, 400]) == [
        (50, "event", []), (101, 0, [8]), (200, "event", []), (301, 1, [7]), (400, "event", [])]


def test_what_comes_late_is_booked_after_the_events_that_were_before_it():
    first, second, (time_ns, pipe, read) = played([(100, 0, 1)], [100, 110], late_ns=30)
    assert (first, second) == ((100, "event", []), (110, "event", []))
    assert (pipe, read) == (0, [1]) and 130 <= time_ns < 140


def test_two_inputs_of_one_instant_are_both_read():
    assert played([(100, 2, 1), (100, 0, 2)]) == [(101, 0, [2]), (101, 2, [1])]


def test_one_that_would_pass_the_next_event_is_refused():
    with pytest.raises(KernelError, match="must return an int between these"):
        played([], [500], made=Deaf)


def test_it_never_passes_the_time_that_it_is_given():
    with Programs(1, [(70, 0, 1)], late_ns=1000) as programs:
        inputs = ProgramInput(Kernel(), programs)
        inputs.watch(programs.descriptor(0), lambda now_ns: programs.read(0))
        assert inputs.advance(50) == 50
        assert inputs.advance(50) == 50  # it is there already


def test_a_descriptor_that_is_forgotten_is_read_no_more():
    with Programs(2, [(100, 0, 1), (200, 1, 2)]) as programs:
        taken = []
        inputs = ProgramInput(Kernel(), programs)
        for pipe in range(2):
            inputs.watch(programs.descriptor(pipe),
                         lambda now_ns, pipe=pipe: taken.append((pipe, programs.read(pipe))))
        inputs.forget(programs.descriptor(0))
        inputs.forget(programs.descriptor(0))  # harmless
        assert inputs.advance(300) == 201
        assert taken == [(1, [2])]

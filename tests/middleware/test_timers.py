"""Timers that are looked at together go off as if each had an event of its own."""

from hypothesis import given
from hypothesis import strategies as st

from desim.engine.kernel import Kernel, Phase
from desim.middleware.timers import NEVER, Timer, Timers

MOST_NS = 1000


class Plain:
    """A timer as one would write it at first: an event that is cancelled and booked anew."""

    def __init__(self, kernel, entity, fired):
        self._kernel, self._entity, self._fired = kernel, entity, fired
        self._call = None

    def expect(self, deadline_ns):
        self.stop()
        self._call = self._kernel.at(deadline_ns, Phase.NETWORK, self._entity, self._fire)

    def stop(self):
        if self._call is not None:
            self._call.cancel()
            self._call = None

    met = stop

    def _fire(self, _):
        self._call = None
        self._fired()


class Shared(Timer):
    def met(self):
        self.deadline_ns = NEVER


times = st.integers(1, MOST_NS)
deeds = st.lists(st.tuples(times, st.integers(0, 3), st.one_of(
    st.sampled_from(["stop", "met"]), st.integers(1, MOST_NS))), max_size=30)


def firings(deeds, again_ns, make):
    """(time, timer) of each; a timer that has gone off expects something again ``again_ns`` later,
    three times in all."""
    kernel, log = Kernel(), []
    timers = []

    def fired(k):
        log.append((kernel.now_ns, k))
        if len([entry for entry in log if entry[1] == k]) < 4:
            timers[k].expect(kernel.now_ns + again_ns)

    for k in range(4):
        timers.append(make(kernel, k, lambda k=k: fired(k)))

    def do(deed):
        _, k, what = deed
        if isinstance(what, int):
            timers[k].expect(kernel.now_ns + what)
        else:
            getattr(timers[k], what)()

    for deed in deeds:
        kernel.at(deed[0], Phase.CONTROL, 0, do, deed)
    kernel.run(100 * MOST_NS)
    return log, kernel


@given(deeds, times, st.sampled_from([0, 1, 7, 50, 400, 3000]))
def test_they_go_off_when_they_should_and_in_order(deeds, again_ns, ahead_ns):
    expected, _ = firings(deeds, again_ns, Plain)
    together = []

    def make(kernel, entity, fired):
        if not together:
            together.append(Timers(kernel, ahead_ns))
        return Shared(together[0], entity, fired)

    assert firings(deeds, again_ns, make)[0] == expected


def test_a_check_moves_no_timer_that_has_its_event_already():
    """a is due at the instant of the look at 168, before the answer that comes in that instant."""
    kernel, log = Kernel(), []
    timers = Timers(kernel, 50)
    a, b = (Timer(timers, k, lambda k=k: log.append((kernel.now_ns, k))) for k in range(2))
    b.expect(193)
    a.expect(400)
    kernel.at(140, Phase.WORLD, 0, lambda _: a.expect(168))
    kernel.at(168, Phase.DELIVER, 9, lambda _: setattr(a, "deadline_ns", NEVER))
    kernel.run(1000)
    assert log == [(168, 0), (193, 1)]


def test_timers_of_one_entity_that_are_due_together_share_an_event():
    """They go off one behind the other, but for one that is stopped and one that is due sooner."""
    kernel, log = Kernel(), []
    timers = Timers(kernel, 50)
    several = [Timer(timers, 1, lambda k=k: log.append((kernel.now_ns, k))) for k in range(5)]
    for timer in several:
        timer.expect(200)
    kernel.at(190, Phase.CONTROL, 0, lambda _: several[1].stop())
    kernel.at(191, Phase.CONTROL, 0, lambda _: several[3].expect(195))
    kernel.run(1000)
    assert log == [(195, 3), (200, 0), (200, 2), (200, 4)]
    assert kernel.events == 5  # a look, the two above, at 195 and at 200


def test_a_timer_that_is_always_met_costs_few_events():
    """A thousand times moved on by 200 from 10 to 10: one look in about 175, and not one event of
    its own, though it is met each time."""
    kernel = Kernel()
    timer = Timer(Timers(kernel, 50), 1, lambda: None)

    def move(k):
        timer.deadline_ns = NEVER
        timer.expect(kernel.now_ns + 200)

    ticks = 1000
    for k in range(ticks):
        kernel.at(10 * k, Phase.CONTROL, 0, move, k)
    kernel.run(10 * ticks - 10)
    assert ticks < kernel.events <= ticks + 10 * ticks // 175 + 1


def test_when_nothing_is_expected_nobody_looks():
    kernel = Kernel()
    timer = Timer(Timers(kernel, 50), 1, lambda: None)
    timer.expect(200)
    timer.deadline_ns = NEVER
    kernel.run(10_000)
    assert kernel.events == 1

"""A call at the earliest of several times is made then, and once."""

from hypothesis import given
from hypothesis import strategies as st

from desim.engine.kernel import Kernel, Phase
from desim.middleware.earliest import Earliest
from desim.units import NEVER_NS

MOST_NS = 100

# When something is asked for, and how long after that it is due; None: nothing any more.
WISHES = st.lists(st.tuples(st.integers(0, MOST_NS), st.none() | st.integers(1, MOST_NS)))


def expected(wishes):
    """The times of the calls: a list of times that are open, without any clock."""
    calls, open_ns = [], []
    for at_ns, delay_ns in sorted(wishes, key=lambda wish: wish[0]):
        if open_ns and min(open_ns) <= at_ns:  # the turn of the call is before that of who asks
            calls.append(min(open_ns))
            open_ns.clear()
        open_ns = [] if delay_ns is None else [*open_ns, at_ns + delay_ns]
    return calls + sorted(open_ns)[:1]


@given(WISHES)
def test_it_is_made_once_and_at_the_first_of_the_times(wishes):
    kernel, calls = Kernel(), []

    def call(_):
        earliest.due_ns = NEVER_NS
        calls.append(kernel.now_ns)

    def ask(delay_ns):
        if delay_ns is None:
            earliest.stop()
        else:
            earliest.by(kernel.now_ns + delay_ns)

    earliest = Earliest(kernel, 1, call)
    for at_ns, delay_ns in wishes:
        kernel.at(at_ns, Phase.CONTROL, 0, ask, delay_ns)
    kernel.run(3 * MOST_NS)
    assert calls == expected(wishes)

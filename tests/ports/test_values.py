"""The small values that plug-ins and the simulator hand each other."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim.errors import InputError, ModelError
from desim.ports import Frame, GridSpec
from desim.ports.arguments import MOST_TIMERS, check_timers
from desim.ports.frames import Frames
from desim.ports.scope import TimeWindow, matching

S = 10**9


def test_frames_to_several_receivers_are_numbered_in_their_order():
    frames = Frames(7, 2, (5, 0, 9), 100, 1)
    assert frames.singly() == [Frame(7, 2, (5,), 100, 1, False), Frame(8, 2, (0,), 100, 1, False),
                               Frame(9, 2, (9,), 100, 1, False)]


def test_ten_thousand_timers_may_wait():
    check_timers(MOST_TIMERS - 1)
    with pytest.raises(ModelError, match="^10000 timers of this strategy wait on this host"):
        check_timers(MOST_TIMERS)


def test_a_pattern_without_a_host_names_the_nearest():
    assert matching("robot_*", ("robot_0", "base", "robot_1"), "x") == [0, 2]
    with pytest.raises(InputError, match=r"^rules.0.hosts: 'bse' names no host \(did you mean "
                                         r"'base'\?\); hosts are robot_0, base$"):
        matching("bse", ("robot_0", "base"), "rules.0.hosts")


def test_the_bounds_of_a_raster_of_cells_of_half_a_metre():
    assert GridSpec(0.5, 30, 11, -4.0, 2.0).bounds() == (-4.0, 2.0, 11.0, 7.5)


@given(start_s=st.integers(0, 20), length_s=st.integers(1, 5), pause_s=st.integers(1, 5),
       now_s=st.integers(0, 60), repeats=st.booleans())
def test_a_window_changes_when_it_says_so(start_s, length_s, pause_s, now_s, repeats):
    every = {"every": f"{length_s + pause_s} s"} if repeats else {}
    window = TimeWindow(**{"from": f"{start_s} s"}, until=f"{start_s + length_s} s", **every)
    phase_s = (now_s - start_s) % (length_s + pause_s) if repeats else now_s - start_s
    assert window.holds(now_s * S) == (now_s >= start_s and phase_s < length_s)
    change_ns = window.changes_ns(now_s * S)
    held = [window.holds(at_s * S) for at_s in range(now_s, now_s + 90)]
    first = next((i for i, now in enumerate(held) if now != held[0]), None)
    assert change_ns == (None if first is None else (now_s + first) * S)

"""Poses in the plane: one pose is placed as each of many is."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim.robot.transforms import compose, motion_between

pose = st.tuples(st.floats(-100, 100), st.floats(-100, 100), st.floats(-7, 7)).map(np.array)


@given(pose, pose)
def test_one_pose_is_placed_as_each_of_many(first, second):
    for place in compose, motion_between:
        many = place(np.array((first, first)), second)
        assert many.shape == (2, 3)
        assert place(first, second) == pytest.approx(many[0], abs=1e-12)
        assert place(first, second) == pytest.approx(many[1], abs=1e-12)


@given(pose, pose)
def test_a_motion_leads_from_one_pose_to_the_other(first, second):
    reached = compose(first, motion_between(first, second))
    assert reached[:2] == pytest.approx(second[:2], abs=1e-9)
    assert np.cos(reached[2] - second[2]) == pytest.approx(1.0)

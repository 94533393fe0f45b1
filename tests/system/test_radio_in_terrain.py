"""A radio between drawn walls: what they cost is not in the exponent of the path loss, too."""

import numpy as np
import pytest
from runs import MAZE_8, built

from desim.testing import Bench
from netmodels.radio.radio import Radio

FREE = "{crossing: {concrete: 0 dB}}"  # the maze's walls


def exponent(radio):
    """From the powers at 4 and at 40 m."""
    near_dbm, far_dbm = radio.signal(np.zeros(2), np.array([[4.0, 0.0], [40.0, 0.0]])).power_dbm
    return pytest.approx((near_dbm - far_dbm) / 10, abs=1e-9)


def in_the_maze(fidelity="mac", **params):
    given = ", ".join(f"{key}: {value}" for key, value in ({"walls": FREE} | params).items())
    simulation = built(MAZE_8, "deployment=field", "fleet.size=2", (
        f"network.media={{lan: null, air: {{model: radio, fidelity: {fidelity}, {given}}}}}"))
    return exponent(simulation.graph.media[0].model)


@pytest.mark.parametrize("fidelity", ["disk", "walls", "mac"])
def test_where_walls_are_drawn_it_is_that_of_a_clear_view(fidelity):
    """Unless walls cost nothing, or it is given."""
    assert in_the_maze(fidelity) == 1.8
    assert in_the_maze(fidelity, walls="null") == 3
    assert in_the_maze(fidelity, path_loss="{exponent: 2.7}") == 2.7
    assert in_the_maze(fidelity, preset="ns3_3_44") == 3
    assert in_the_maze(fidelity, path_loss="{model: free_space, frequency: 2412 MHz}") == 2


@pytest.mark.parametrize("fidelity", ["disk", "walls", "mac"])
def test_in_the_open_it_is_that_of_ns_3(fidelity):
    radio = Radio.build(Radio.Params(fidelity=fidelity))
    Bench(radio, 1)
    assert exponent(radio) == 3

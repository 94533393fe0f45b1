"""Antennas of hosts: heights against walls, gain and power."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_radio_budget import as_pairs, budget
from test_radio_pathloss import room

from desim.ports import Antennas
from desim.scenario.load import from_mapping
from desim.simulation.simulation import Simulation
from netmodels.radio.walls import CROSSING_DB, Walls

BRICK_DB = CROSSING_DB["brick"]
ALONG = np.array([[0.0, 0.0, 4.0, 0.0]])  # the wall of ``room`` stands at x = 1: t = 1/4


def at_heights(*height_m):
    hosts = len(height_m)
    return Antennas.plain(hosts)._replace(height_m=np.array(height_m))


MOST_DB = np.array([1000.0])


def lost_db(one_m, other_m, top_m, most_db=MOST_DB):
    between = replace(room("brick"), height_m=np.array([top_m]))
    return float(Walls().loss_db(between, ALONG, most_db, np.array([[one_m, other_m]]))[0])


@pytest.mark.parametrize("one_m, other_m, top_m, costs", [
    (0.5, 0.5, 0.6, True), (0.5, 0.5, 0.5, False), (0.5, 0.5, 0.4, False),
    # the line is at 1/4 of the way where it crosses the wall: 0.5 + 2 / 4 = 1.0 m high
    (0.5, 2.5, 1.01, True), (0.5, 2.5, 1.0, False),
    (2.5, 0.5, 2.01, True), (2.5, 0.5, 2.0, False),
])
def test_a_wall_costs_below_its_top_and_nothing_above(one_m, other_m, top_m, costs):
    assert lost_db(one_m, other_m, top_m) == (BRICK_DB if costs else 0.0)
    assert lost_db(one_m, other_m, top_m, None) == (BRICK_DB if costs else 0.0)


heights = st.floats(0.0, 3.0)


@given(heights, heights, heights)
def test_the_loss_is_that_of_the_line_in_space(one_m, other_m, top_m):
    high_m = one_m + 0.25 * (other_m - one_m)
    if abs(high_m - top_m) > 1e-9:
        assert lost_db(one_m, other_m, top_m) == (BRICK_DB if top_m > high_m else 0.0)


def test_the_way_inside_of_a_block_ends_where_the_line_leaves_through_its_top():
    walls = Walls(crossing={"brick": "0 dB"}, inside={"brick": "1 dB"})
    block = replace(room("brick", "brick", "brick"), height_m=np.full(3, 2.0))
    line = np.array([[0.0, 0.0, 2.5, 0.0]])  # through the faces at x = 1 and x = 2

    def inside_m(*ends_m):
        return float(walls.loss_db(block, line, None, np.array([ends_m]))[0])

    assert inside_m(1.0, 1.0) == pytest.approx(1.0)
    assert inside_m(2.0, 2.0) == 0.0
    assert inside_m(0.5, 3.0) == pytest.approx(0.5)  # 2 m high at x = 1.5


def test_distances_are_those_in_space():
    at = np.array([(0.0, 0.0), (30.0, 0.0)])
    flat, _ = as_pairs(budget(2, antennas=at_heights(1.0, 1.0)).links(at, None))
    steep, _ = as_pairs(budget(2, antennas=at_heights(0.0, 40.0)).links(at, None))
    assert 10 * np.log10(flat[0, 1] / steep[0, 1]) == pytest.approx(30 * np.log10(50 / 30))


def test_gain_counts_both_ways_and_power_one():
    at = np.array([(0.0, 0.0), (30.0, 0.0)])
    plain, _ = as_pairs(budget(2).links(at, None))

    def better_db(**own):
        heard, _ = as_pairs(budget(2, antennas=Antennas.plain(2)._replace(**own)).links(at, None))
        return [10 * np.log10(heard[pair] / plain[pair]) for pair in ((0, 1), (1, 0))]

    assert better_db(gain_db=np.array([3.0, 0.0])) == pytest.approx([3.0, 3.0])
    assert better_db(power_dbm=np.array([20.0206, np.nan])) == pytest.approx([4.0, 0.0])
    assert better_db(power_dbm=np.full(2, 16.0206)) == pytest.approx([0.0, 0.0])  # the twin


def test_who_sends_stronger_is_heard_from_farther_away_than_it_hears():
    own = Antennas.plain(2)._replace(power_dbm=np.array([30.0, np.nan]))
    model = budget(2, antennas=own)
    heard_m = 10 ** ((16.0206 - 40.1 + 101.0) / 30)  # about, with the loss of the first metre
    at = np.array([(0.0, 0.0), (1.5 * heard_m, 0.0)])
    assert set(as_pairs(model.links(at, None))[0]) == {(0, 1)}
    assert not as_pairs(budget(2).links(at, None))[0]  # the twin


def signal_dbm(*changes, model=None):
    """Between a robot and a base behind a wall 1 m high, 4 m apart."""
    base, robot = {"at": ["4 m", "0 m"]}, {}
    for change in changes:
        (base if "base" in change else robot)["antenna"] = next(iter(change.values()))
    simulation = Simulation(from_mapping({
        "name": "wall", "deployment": "field",
        "environment": {"terrain": {"size": ["20 m", "20 m"], "walls": [
            {"from": ["2 m", "-9 m"], "to": ["2 m", "9 m"], "height": "1 m",
             "material": "concrete"}]}},
        "fleet": {"start": {"poses": [{"x": "0 m", "y": "0 m"}]}},
        "robot": robot, "hosts": {"base": base},
        "network": {"media": {"air": model or {"model": "radio"}}}}).scenario)
    names = [host.name for host in simulation.plan]
    medium = simulation.graph.media[0]
    ends = names.index("robot_0"), names.index("base")
    ends_m = medium.positions(0).take(ends, axis=0)
    return float(medium.model.link_signal(*ends, ends_m, medium.obstacles).power_dbm[0])


@pytest.mark.parametrize("fidelity", ["mac", "walls"])
def test_a_mast_looks_over_the_wall(fidelity):
    model = {"model": "radio", "fidelity": fidelity}
    behind = signal_dbm(model=model)
    mast = signal_dbm({"base": {"height": "1.6 m"}}, model=model)  # 1.05 m high at the wall
    assert mast - behind == pytest.approx(CROSSING_DB["concrete"], abs=0.6)  # 0.5 dB farther away
    short = signal_dbm({"base": {"height": "1.4 m"}}, model=model)  # the twin: 0.95 m
    assert short - behind == pytest.approx(0.0, abs=0.6)

"""The paper's cluster: equation 7, placement, and copies of images against their closed forms."""

from __future__ import annotations

import math

import pytest
from designs import deployed
from hypothesis import given
from hypothesis import strategies as st

from desim import plugins
from desim.campaign.deploy.image_copy import round_ends_ns
from desim.campaign.deploy.testbed import (
    SERVER,
    all_at_once,
    demand,
    hosts_of,
    machine_by_machine,
    node_by_node,
    passed_on,
    placed,
    smallest_testbed,
)
from desim.campaign.design.design import load_design
from desim.campaign.design.plan import Plan
from desim.middleware.headers import stream_frame

IMAGE_BYTES = 100_000_000
RATE_BPS = 1_000_000_000
# A part's first packet passes a switch before the part does; a round ends with one.
TOLERANCE = 1e-4

teams = st.integers(1, 60), st.integers(1, 10)


def robots(team: int) -> list[str]:
    return [f"robot_{i}" for i in range(team)]


def test_nodes_of_the_paper():
    # Table 2 has 8 robots with 8, 4, 2 and 1 of them on a node; section 5 has 30 with 4.
    assert [len(placed(robots(8), per_node).nodes) for per_node in (8, 4, 2, 1)] == [1, 2, 4, 8]
    assert len(placed(robots(30), 4).nodes) == 8


@given(*teams)
def test_everybody_has_a_place_and_no_node_is_too_full(team, per_node):
    bed = placed(robots(team), per_node)
    assert [name for node in bed.nodes.values() for name in node] == robots(team)
    assert len(bed.nodes) == math.ceil(team / per_node) and bed.virtual_machines == team
    assert all(0 < len(node) <= per_node for node in bed.nodes.values())


def test_the_last_node_has_what_is_left():
    assert placed(robots(6), 4).nodes == {
        "node_0": ("robot_0", "robot_1", "robot_2", "robot_3"), "node_1": ("robot_4", "robot_5")}


@given(*teams)
def test_who_gives_has_the_image_and_everybody_gets_it_once(team, per_node):
    bed = placed(robots(team), per_node)
    for way in (node_by_node, all_at_once, passed_on):
        have = {SERVER}
        for copies in way(bed):
            takers = [taker for _, taker in copies]
            assert {source for source, _ in copies} <= have and not have.intersection(takers)
            assert len(set(takers)) == len(takers)
            have.update(takers)
        assert have == {SERVER, *bed.nodes}
    assert len(passed_on(bed)) == math.ceil(math.log2(len(bed.nodes) + 1))
    assert sum(map(len, machine_by_machine(bed))) == team


def test_passed_on():
    assert passed_on(placed(robots(5), 1)) == [
        [("server", "node_0")],
        [("server", "node_1"), ("node_0", "node_2")],
        [("server", "node_3"), ("node_0", "node_4")]]
    assert hosts_of([[("server", "b")], [("b", "a")]]) == ("server", "b", "a")


def seconds(model: str, rounds, rate_bps: int = RATE_BPS) -> float:
    params = plugins.parameters("network", model)(rate=f"{rate_bps} b/s")
    return round_ends_ns(plugins.load("network", model)(params), rounds, IMAGE_BYTES)[-1] / 1e9


def one_copy_s(model: str) -> float:
    """size / rate, with all that stands around each packet."""
    size_bytes, segments = stream_frame(IMAGE_BYTES)
    gaps_bytes = segments * 20 if model == "switch" else 0  # IEEE 802.3: preamble and gap
    return (size_bytes + gaps_bytes) * 8 / RATE_BPS


WAYS = [(machine_by_machine, 7), (node_by_node, 7), (all_at_once, 7), (passed_on, 3)]


@pytest.mark.parametrize("model", ["switch", "link"])
@pytest.mark.parametrize(("way", "copies"), WAYS)
def test_times_are_those_of_the_closed_forms(model, way, copies):
    """n size / rate from one server, ceil(log2(n + 1)) size / rate where it is passed on."""
    rounds = way(placed(robots(7), 1))
    expected_s = pytest.approx(copies * one_copy_s(model), rel=TOLERANCE)
    assert seconds(model, rounds) == expected_s
    for off in (0.95, 1.05):  # the twin: a network of another rate is told apart
        assert seconds(model, rounds, round(RATE_BPS * off)) != expected_s


def test_an_image_that_is_no_multiple_of_a_part():
    model = plugins.load("network", "link")(plugins.parameters("network", "link")(rate="8 Mb/s"))
    size_bytes = sum(stream_frame(size)[0] for size in (4_000_000, 4_000_000, 1_000))
    assert round_ends_ns(model, [[("a", "b")]], 8_001_000) == [size_bytes * 1000]


@pytest.fixture(scope="module")
def design(tmp_path_factory):
    return deployed(tmp_path_factory.mktemp("design"))


def test_the_largest_team_counts(design):
    plan = Plan(load_design(design))
    assert smallest_testbed(plan).nodes.keys() == {"node_0", "node_1"}
    assert smallest_testbed(plan, 2).virtual_machines == 6
    assert len(smallest_testbed(plan, 2).nodes) == 3
    assert demand(plan) == (6, 15, 600.0, 1500.0)


def test_robots_are_on_the_nodes_whose_ports_they_share_when_it_is_run(design):
    plan = Plan(load_design(design))
    largest = plan.vectors[1]
    assert largest.levels["robots"].label == "6"
    lan = plan.scenario(largest, 0).scenario.network.media["lan"]
    assert {node: tuple(robots) for node, robots in lan.params.ports.items()} == (
        smallest_testbed(plan).nodes)

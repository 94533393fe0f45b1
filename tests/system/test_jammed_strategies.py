"""Strategies that no message reaches finish through their failsafe, as robots without a network."""

import tomllib

import pytest
from runs import HELLO, built, finished

LOST = ("deployment=field",
        "network.media.air={model: ideal, rules: [{rule: loss, probability: 1}]}")
QUIET = ("deployment=field", "network.media.air={model: ideal}", "coordination.exchange=null")
OF_MESSAGES = {"sent", "frame", "lost", "dropped", "callback", "sample_traffic"}


@pytest.fixture(scope="module")
def strategies(repository):
    """Name to dotted path, also of those that are not installed yet."""
    project = tomllib.loads((repository / "pyproject.toml").read_text())["project"]
    return project["entry-points"]["desim.strategies"]


def jammed(path, *more):
    base = (f"hosts.base.strategy={{strategy: '{path}'}}",) if "centralized" in path else ()
    return finished(built(HELLO, *LOST, f"coordination.strategy={path}", "stop.elapsed=400 s",
                          *(("hosts.base={}", *base) if base else ()), *more))


EXPLORING = [
    "centralized", "connectivity", "explore_multirobot", "greedy_assignment", "hungarian",
    "market", "minpos", "nearest_frontier", "next_best_view", "random_frontier", "rendezvous",
    "role_based", "voronoi"]
LED = ["follow"]  # its robots move as a file says: test_follow.py
# Without a network nobody has an order: test_deliveries.py.
CARRYING = ["auction", "dispatcher", "guided_dispatcher"]
GRANTED = ["pibt", "prioritized"]  # without one all stand: test_traffic_control.py
ON_MISSIONS = [  # test_whole_missions.py, test_mission_strategies.py
    "evade", "leader_follower", "pursue", "search_and_report", "spanning_tree_coverage"]
PATROLLING = ["conscientious_reactive", "cyclic_patrol", "expected_reactive"]


@pytest.mark.parametrize("name", EXPLORING)
def test_under_a_total_jam_every_strategy_finishes(strategies, name):
    assert jammed(strategies[name]).stop_reason == "explored"


@pytest.mark.parametrize("terrain", ["known", "unknown"])
@pytest.mark.parametrize("name", PATROLLING)
def test_under_a_total_jam_every_patrol_makes_its_rounds(strategies, name, terrain):
    task = f"task={{model: patrolling, drawn: 6, rounds: 2, map: {terrain}}}"
    assert jammed(strategies[name], task).stop_reason == "patrolled"


def test_every_strategy_is_jammed_here(strategies):
    assert sorted(strategies) == sorted(EXPLORING + PATROLLING + CARRYING + GRANTED + LED
                                        + ON_MISSIONS)


def deeds(*case):
    """Digests of what robots, world and monitor did, but for the counts of messages."""
    simulation = built(HELLO, *case)
    finished_at = simulation.run().simulated_ns
    return finished_at, {
        (simulation.names[kind], simulation.names[entity]): digest
        for (kind, entity), digest in simulation.trace.digests().items()
        if simulation.names[kind] not in OF_MESSAGES}


def test_jammed_nearest_frontier_equals_the_fleet_without_a_network():
    lost, quiet = deeds(*LOST), deeds(*QUIET)
    assert {"pose", "goal", "goal_reached", "sample"} <= {kind for kind, _ in lost[1]}
    assert lost == quiet
    assert lost != deeds(QUIET[0], QUIET[1])  # the exchange of maps would matter

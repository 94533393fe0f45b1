"""Strategies that speak, in whole small runs: what they send, and what becomes of the fleet."""

from runs import HELLO, Tally, built, call_often, finished

from desim.robot.coordination.strategies.connectivity import connected

PACKAGE = "desim.robot.coordination.strategies"
STRATEGIES = f"coordination.strategy={PACKAGE}."


def played(*case, until=None):
    """The reason for the end, and the messages that arrived, by topic without the host."""
    tally = Tally()
    simulation = built(HELLO, *case, on_fate=tally.fate)
    outcome = finished(simulation) if until is None else simulation.run(until)
    return outcome, {topic.split("/", 2)[2] for topic in tally.delivered if "strategy" in topic}


MARKET = STRATEGIES + "market:Market"


def test_a_market_trades_and_explores():
    outcome, topics = played(MARKET)
    assert outcome.stop_reason == "explored"
    assert {"strategy/offer", "strategy/bid", "strategy/award", "strategy/release"} == topics


def test_a_market_goes_on_when_a_robot_is_lost():
    outcome, _ = played(MARKET, "coordination.lost_after=6 s",
                        "faults=[{at: 8 s, host: robot_2}]")
    assert outcome.stop_reason == "explored"


CENTRAL = (STRATEGIES + "centralized:Centralized", "hosts.base={}",
           f"hosts.base.strategy={{strategy: '{PACKAGE}.centralized:Centralized'}}")


def test_a_base_sends_a_fleet():
    outcome, topics = played(*CENTRAL)
    assert outcome.stop_reason == "explored"
    assert topics == {"strategy/report", "strategy/tasks"}


def test_a_fleet_finishes_without_its_base():
    outcome, _ = played(*CENTRAL, "faults=[{at: 8 s, host: base}]")
    assert outcome.stop_reason == "explored"


SHORT = ("deployment=field", "network.media.air={model: disk, range: 6 m}")


def test_a_team_meets_over_a_short_radio():
    outcome, topics = played(STRATEGIES + "rendezvous:Rendezvous", *SHORT,
                             "coordination.interval=15 s")
    assert outcome.stop_reason == "explored"
    assert topics == {"strategy/meeting"}


def test_a_relay_meets_its_explorer_and_brings_its_map_to_the_base():
    name = "role_based:RoleBased"
    base = (STRATEGIES + name, "hosts.base={at: [-10 m, 10 m]}",
            f"hosts.base.strategy={{strategy: '{PACKAGE}.{name}'}}")
    outcome, topics = played(*base, *SHORT, "coordination.interval=8 s")
    assert outcome.stop_reason == "explored"
    assert topics == {"strategy/meeting", "strategy/here"}


def seconds_apart(*case):
    """The time for which the fleet was not connected over a radio of 8 m."""
    simulation = built(HELLO, "deployment=field",
                       "network.media.air={model: disk, range: 8 m}", *case)
    apart = []

    def check():
        places = simulation.world.snapshot().poses[:, :2].tolist()
        apart.append(not connected(places, 8.0))
    call_often(simulation, check)
    assert finished(simulation).stop_reason == "explored"
    return sum(apart) / 10


def test_a_team_that_minds_its_network_stays_together():
    minds = (STRATEGIES + "connectivity:Connectivity", "coordination.range=6 m")
    assert seconds_apart(*minds) == 0
    assert seconds_apart(STRATEGIES + "minpos:MinPos") > 5


def test_a_team_that_could_only_go_on_apart_holds():
    outcome, _ = played(STRATEGIES + "connectivity:Connectivity", *SHORT,
                        "coordination.range=2 m", "stop.elapsed=200 s")
    assert outcome.stop_reason == "elapsed"

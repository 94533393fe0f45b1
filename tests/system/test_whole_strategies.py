"""Strategies that speak, in whole small runs: what they send, and what becomes of the fleet."""

from runs import HELLO, Tally, built, finished

STRATEGIES = "coordination.strategy=desim.robot.strategies."


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
           "hosts.base.strategy={strategy: 'desim.robot.strategies.centralized:Centralized'}")


def test_a_base_sends_a_fleet():
    outcome, topics = played(*CENTRAL)
    assert outcome.stop_reason == "explored"
    assert topics == {"strategy/report", "strategy/tasks"}


def test_a_fleet_finishes_without_its_base():
    outcome, _ = played(*CENTRAL, "faults=[{at: 8 s, host: base}]")
    assert outcome.stop_reason == "explored"

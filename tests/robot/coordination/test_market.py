"""Robots trade frontiers by messages: offers, bids, awards, releases."""

from benches import Team

from desim import ports
from desim.robot.coordination.strategies.market import Market
from desim.testing import check_strategy
from desim.units import NS_PER_S


def market(places, *points, **params):
    team = Team(lambda: Market(Market.Params(price_m_per_m2=0.0, **params)), places, points)
    team.meet()
    return team


def test_a_market_keeps_its_contract():
    check_strategy(Market)
    check_strategy(Market, lots=1, failsafe_after="0 s")


def test_a_whole_auction():
    team = market({"a": (0, 0), "b": (20, 0)}, (4, 0), (18, 0))
    assert team.choose("a") == (4.0, 0.0)
    team.wait()
    assert team.sent == [
        ("a", "offer", [[4.0, 0.0, 4.0, 0.0], [18.0, 0.0, 18.0, 0.0]]),
        ("b", "bid", {"offer": ["a", 10 * NS_PER_S], "bids": [[18.0, 0.0, 2.0]],
                      "gains": []}),
        ("a", "award", [["a", 4.0, 0.0], ["b", 18.0, 0.0]])]
    assert team.goals() == {"a": (4.0, 0.0), "b": (18.0, 0.0)}


def test_a_bid_that_comes_too_late_changes_nothing():
    team = market({"a": (0, 0), "b": (20, 0)}, (4, 0), (18, 0))
    team.deaf = {"b"}
    team.choose("a")
    team.wait()
    goals, said = team.goals(), len(team.sent)
    team.benches["a"].deliver(ports.StrategyMessage(
        "b", "bid", {"offer": ["a", 10 * NS_PER_S], "bids": [[18.0, 0.0, 2.0]], "gains": []},
        10 * NS_PER_S))
    team.talk()
    assert (team.goals(), len(team.sent)) == (goals, said)


def test_a_robot_gives_its_goal_to_who_is_nearer_and_takes_the_next():
    team = market({"a": (0, 0), "b": (12, 0)}, (10, 0), (-14, 0))
    team.choose("a")
    team.wait()
    assert team.goals() == {"a": (-14.0, 0.0), "b": (10.0, 0.0)}


def test_a_robot_whose_goal_was_sold_to_another_one_takes_the_next():
    for sold, goal in ((-14.0, 10.0), (10.0, -14.0)):
        team = market({"a": (0, 0), "b": (12, 0)}, (10, 0), (-14, 0))
        team.benches["a"].go((10.0, 0.0))
        team.benches["a"].deliver(ports.StrategyMessage("b", "award", [["b", sold, 0.0]], 0))
        assert team.goals()["a"] == (goal, 0.0)


def test_a_busy_robot_bids_the_way_by_its_goal_unless_the_lot_lies_before():
    team = market({"a": (0, 0), "b": (40, 0)}, (25, 0))
    team.benches["b"].go((50.0, 0.0))  # 10 m, and 25 m back
    team.choose("a")
    team.wait()
    assert team.goals() == {"a": (25.0, 0.0), "b": (50.0, 0.0)}
    before = market({"a": (0, 0), "b": (40, 0)}, (25, 0))
    before.benches["b"].go((20.0, 0.0))  # the lot is on its way: 15 m, it goes there first
    before.choose("a")
    before.wait()
    assert before.goals()["b"] == (25.0, 0.0)


def test_nobody_is_credited_for_what_a_teammate_knows():
    """a sees 100 m2 beyond the farther frontier, of which b, who is not near, knows all."""
    team = Team(lambda: Market(Market.Params()), {"a": (0, 0), "b": (60, 0)}, [(5, 0), (9, 0)])
    team.meet()
    for name, at_9_m2 in (("a", 100.0), ("b", 0.0)):
        team.benches[name].gain_m2 = (
            lambda place, gain_m2=at_9_m2: gain_m2 if place[0] == 9.0 else 10.0)
    assert team.choose("a") == (9.0, 0.0)
    team.wait()
    assert team.goals()["a"] == (5.0, 0.0)


def test_a_bidder_bids_for_its_three_best_lots():
    team = market({"a": (0, 0), "b": (20, 0)}, *((x, 0) for x in (12, 14, 16, 18)), lots=4)
    team.choose("a")
    team.wait()
    (bid,) = [content for name, topic, content in team.sent if (name, topic) == ("b", "bid")]
    assert [place[0] for place in bid["bids"]] == [18.0, 16.0, 14.0]


def test_what_a_robot_out_of_reach_holds_is_free():
    team = market({"a": (0, 0), "b": (12, 0), "c": (40, 0)}, (10, 0), (-14, 0))
    team.benches["a"].heard.pop("c")  # b has heard of it
    team.benches["a"].deliver(ports.StrategyMessage("b", "award", [["c", 10.0, 0.0]], 0))
    assert team.choose("a") == (10.0, 0.0)


def test_nobody_takes_what_is_held_until_it_is_released():
    team = market({"a": (0, 0), "b": (0, 1)}, (10, 0), (-30, 0))
    team.choose("a")
    team.wait()
    assert team.choose("b") == (-30.0, 0.0)
    for end in (ports.GoalEnd.FAILED, ports.GoalEnd.REPLACED):
        team = market({"a": (0, 0), "b": (0, 1)}, (10, 0), (-30, 0))
        team.choose("a")
        team.wait()
        team.drive("a", end)
        assert team.choose("b") == (10.0, 0.0)


def test_the_tasks_of_a_lost_robot_and_of_one_that_stalls_come_free():
    lost = market({"a": (0, 0), "b": (0, 1)}, (10, 0), (-30, 0))
    lost.choose("a")
    lost.wait()
    lost.strategies["b"].on_teammate(lost.benches["b"], "a", False)
    assert lost.choose("b") == (10.0, 0.0)
    stalled = market({"a": (0, 0), "b": (0, 1)}, (10, 0), (-30, 0), hold="5 s")
    stalled.choose("a")
    stalled.wait(6)
    assert stalled.choose("b") == (10.0, 0.0)


def test_before_the_failsafes_time_a_robot_that_hears_nobody_takes_what_is_most_profitable():
    """Not the nearest frontier, which it takes from then on."""
    team = Team(lambda: Market(Market.Params(failsafe_after="3 s")), {"a": (0, 0)},
                [(5, 0), (9, 0)])
    team.benches["a"].gain_m2 = lambda place: 100.0 if place[0] == 9.0 else 0.0
    assert team.choose("a") == (9.0, 0.0)
    team.wait(2)
    assert team.choose("a") == (9.0, 0.0)
    team.wait()
    assert team.choose("a") == (5.0, 0.0)


def test_without_a_word_for_the_failsafes_time_it_goes_on_alone_and_says_nothing():
    team = market({"a": (0, 0), "b": (1, 0)}, (10, 0), (-30, 0), hold="60 s")
    team.choose("b")
    team.wait()
    team.deaf.add("a")
    team.benches["a"].now_ns += 28 * NS_PER_S
    assert team.choose("a") == (-30.0, 0.0)  # b holds the other
    team.wait(2)
    said = len(team.sent)
    assert team.choose("a") == (10.0, 0.0)
    assert len(team.sent) == said

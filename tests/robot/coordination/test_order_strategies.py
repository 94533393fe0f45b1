"""Auctions and dispatchers on a plane without a simulator, and with the network cut."""

import numpy as np
import pytest
from benches import Team
from hypothesis import given, settings
from hypothesis import strategies as st

from desim import ports
from desim.ports.delivery import (
    Charge,
    Delivery,
    Serve,
    Served,
    ServiceEnd,
    Station,
    TransportOrder,
)
from desim.robot.coordination.orders.desk import OrderDesk, OrderDeskParams, Report
from desim.robot.coordination.strategies.auction import Auction
from desim.robot.coordination.strategies.dispatcher import Dispatcher
from desim.robot.coordination.strategies.guided_dispatcher import GuidedDispatcher
from desim.testing import check_strategy
from desim.units import NS_PER_S as S

STATIONS = Delivery(tuple(Station(name, kind, ports.Place(*at)) for name, kind, at in (
    ("left", "pick", (-20.0, 0.0)), ("right", "pick", (20.0, 0.0)),
    ("dock", "drop", (0.0, 20.0)), ("plug", "charge", (0.0, -5.0)))), 2.0)


class Porters(Team):
    """Robots and a host that give each other orders, and stations that serve at once. A robot that
    drives is there in the next second. ``done``: who did which order; ``wasted``: who came late.
    """

    def __init__(self, make, places):
        super().__init__(make, {**places, "base": None})
        self.open, self.loads, self.done, self.wasted = {}, {}, [], []
        for bench in self.benches.values():
            bench.task = STATIONS

    def order(self, number, pick="left"):
        self.open[number] = pick
        self.strategies["base"].on_task(self.benches["base"], TransportOrder(number, pick, "dock"))

    def live(self, seconds):
        for _ in range(seconds):
            self.wait()
            for name, bench in self.benches.items():
                if bench.goal is not None:
                    bench.pose, bench.goal = ports.Pose2D(*bench.goal, 0.0), None
                acts, bench.acts = bench.acts, []
                for act in acts:
                    if isinstance(act, Serve):
                        self.serve(name, bench, act)
            self.talk()

    def serve(self, name, bench, act):
        number, outcome = act.order, ServiceEnd.DONE
        if act.station == "dock":
            number = self.loads.pop(name)
            self.done.append((name, number))
        elif act.station != "plug" and self.open.pop(number, None) is None:
            outcome = ServiceEnd.GONE
            self.wasted.append((name, number))
        elif act.station != "plug":
            self.loads[name] = number
        self.strategies[name].on_task(bench, Served(act.station, number, outcome))


KINDS = {"auction": lambda: Auction(Auction.Params()),
         "hungarian": lambda: Dispatcher(Dispatcher.Params()),
         "insertion": lambda: Dispatcher(Dispatcher.Params(assignment="insertion"))}
each = pytest.mark.parametrize("kind", KINDS)


@pytest.mark.parametrize("cls, params", [(Auction, {}), (Dispatcher, {}),
                                         (Dispatcher, {"assignment": "insertion"}),
                                         (GuidedDispatcher, {"cell": "10 m"}),
                                         (GuidedDispatcher, {"planner": "prioritized"}),
                                         (Auction, {"failsafe_after": "0 s"})])
def test_they_keep_their_contract(cls, params):
    check_strategy(cls, **params)


@each
def test_each_order_goes_to_the_robot_that_is_near(kind):
    team = Porters(KINDS[kind], {"a": (-15, 0), "b": (15, 0)})
    team.wait(2)
    team.order(0, "right")
    team.order(1, "left")
    team.live(12)
    assert sorted(team.done) == [("a", 1), ("b", 0)] and not team.wasted


def test_the_least_total_way_is_not_the_shortest_first():
    """a is 5 m from left; b, on the other side, is 4 m from it, and 44 m from right."""
    team = Porters(KINDS["hungarian"], {"a": (-15, 0), "b": (-24, 0)})
    team.wait(2)
    team.order(0, "left")
    team.order(1, "right")
    team.live(12)
    assert sorted(team.done) == [("a", 1), ("b", 0)]


def test_insertion_puts_an_order_where_the_way_grows_least():
    desk = Dispatcher(Dispatcher.Params(assignment="insertion"))
    team = Porters(lambda: desk, {})
    bench = team.benches["base"]
    places = [one.place for one in STATIONS.stations]
    ways_m = np.array([bench.path_lengths_m(places, place) for place in places])
    desk._ways_m, index = ways_m, {one.name: k for k, one in enumerate(STATIONS.stations)}
    desk._desk.add(TransportOrder(0, "right", "dock"))
    desk._desk.assign("a", 0)
    first_m = bench.path_lengths_m(places, ports.Place(-20.0, 0.0))
    before = desk._added_m("a", 0, TransportOrder(1, "left", "dock"), index, first_m)
    behind = desk._added_m("a", 1, TransportOrder(1, "left", "dock"), index, first_m)
    # dock to either pick and back: 28.28 m each. First: 0 to left, to the dock, on to right, in
    # place of 40 m from here to right.
    assert before == pytest.approx(2 * 28.284 - 40.0, abs=0.01)
    assert behind == pytest.approx(2 * 28.284, abs=0.01)


@each
def test_a_robot_that_hears_nothing_carries_out_what_it_has(kind):
    team = Porters(KINDS[kind], {"a": (-15, 0)})
    team.wait(2)
    team.order(0)
    team.wait(2)
    team.deaf.add("a")
    team.live(12)
    assert team.done == [("a", 0)]


@each
def test_orders_of_a_silent_robot_are_neither_lost_nor_done_twice(kind):
    """a, which is near, is cut off once it has the order: b gets it after the failsafe, and finds
    the load gone; when a is heard again, the order is over for all."""
    team = Porters(KINDS[kind], {"a": (-15, 0), "b": (30, 0)})
    team.wait(2)
    team.order(0)
    team.wait(3)
    assert team.goals()["a"] == (-20.0, 0.0)
    team.deaf.add("a")
    team.live(20)
    assert team.done == [("a", 0)] and team.wasted == [("b", 0)]
    team.deaf.clear()
    team.order(1)
    team.live(12)
    assert [number for _, number in team.done] == [0, 1] and len(team.wasted) == 1
    assert not team.strategies["base"]._desk.open


@each
def test_a_robot_that_is_lost_before_the_pick_is_replaced(kind):
    team = Porters(KINDS[kind], {"a": (-15, 0), "b": (30, 0)})
    team.wait(2)
    team.order(0)
    team.wait(2)
    team.deaf.add("a")
    team.benches["a"].timers.clear()  # it stands
    team.benches["a"].goal = None
    team.live(25)
    assert team.done == [("b", 0)]


@each
def test_a_robot_charges_before_its_next_order(kind):
    team = Porters(KINDS[kind], {"a": (-15, 0)})
    team.strategies["a"].on_task(team.benches["a"], Charge(0.1))
    team.wait(2)
    team.order(0)
    team.live(8)
    assert team.benches["a"].goals[0] == ports.Place(0.0, -5.0) and not team.done
    team.strategies["a"].on_task(team.benches["a"], Charge(1.0))
    team.live(10)
    assert team.done == [("a", 0)]


@each
@settings(max_examples=25, deadline=None)
@given(data=st.data())
def test_with_any_cuts_every_order_is_done_once(kind, data):
    """Robots fall silent and are heard again at any time; at the end all hear each other."""
    team = Porters(KINDS[kind], {"a": (-15, 0), "b": (15, 0), "c": (0, 10)})
    number = 0
    for _ in range(6):
        team.deaf = data.draw(st.sets(st.sampled_from("abc")))
        for pick in data.draw(st.lists(st.sampled_from(["left", "right"]), max_size=2)):
            team.order(number, pick)
            number += 1
        team.live(data.draw(st.integers(1, 25)))
    team.deaf = set()
    team.live(20 + 12 * number)
    assert sorted(done for _, done in team.done) == list(range(number))


def test_a_desk_never_gives_an_order_to_two_that_it_hears():
    desk = OrderDesk(OrderDeskParams())
    for number in range(3):
        desk.add(TransportOrder(number, "left", "dock"))
    report = Report({"at": [0.0, 0.0], "loaded": None, "ended": [], "charging": False})
    desk.heard("a", report, 0)
    desk.assign("a", 0)
    desk.assign("a", 2, 0)
    assert desk.assigned == {"a": [2, 0]} and [one.number for one in desk.waiting()] == [1]
    desk.expire(14 * S)
    assert desk.assigned == {"a": [2, 0]}
    desk.expire(15 * S)
    assert [one.number for one in desk.waiting()] == [0, 1, 2] and desk.free(2) == []

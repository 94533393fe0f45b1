"""Deliveries on a made-up fleet: services, ways and delays by hand, and what is refused."""

import numpy as np
import pytest

from desim.errors import InputError, ModelError
from desim.monitor.delivery.orders import from_file, poisson
from desim.monitor.tasks.delivery import Deliveries
from desim.ports import Place
from desim.ports.delivery import AskOrders, Charge, Serve, Served, ServiceEnd, TransportOrder
from desim.testing import TaskBench

S = 1_000_000_000
SHELF, DOCK = {"kind": "pick", "at": ["4 m", "4 m"], "service": "8 s"}, \
    {"kind": "drop", "at": ["20 m", "4 m"], "service": "5 s"}
PLUG = {"kind": "charge", "at": ["4 m", "20 m"], "service": "100 s"}


def deliveries(stations=None, **params):
    stations = stations or {"shelf": SHELF, "dock": DOCK, "plug": PLUG}
    if not {"every", "orders", "file"} & params.keys():
        params["orders"] = (("1 s", "shelf", "dock"), ("2 s", "shelf", "dock"))
    return TaskBench(Deliveries(Deliveries.Params(stations=stations, **params)))


def said(bench, robot):
    return [content for name, content in bench.notified if name == robot]


def test_a_delivery_by_hand():
    """robot_1 stands at the shelf, takes the first load from 3 s to 11 s, is at the dock, 16 m
    away, at 20 s, and leaves it from 21 s to 26 s; the second order stays."""
    bench = deliveries(due="20 s")
    bench.run(3 * S)
    bench.act("robot_1", Serve("shelf", 0))
    bench.run(20 * S)
    bench.move(0, 20.0, 4.0)
    bench.run(21 * S)
    bench.act("robot_1", Serve("dock"))
    bench.run(30 * S)
    bench.move(0, 4.0, 4.0)
    assert said(bench, "robot_1") == [
        TransportOrder(0, "shelf", "dock"), TransportOrder(1, "shelf", "dock"),
        Served("shelf", 0, ServiceEnd.DONE), Served("dock", 0, ServiceEnd.DONE)]
    assert bench.rows == [(S, "order", None, 0, 0), (2 * S, "order", None, 1, 0),
                          (11 * S, "order_picked", "robot_1", 0, 0),
                          (26 * S, "order_done", "robot_1", 0, 25 * S)]
    metrics = bench.task.metrics()
    assert (metrics["orders"], metrics["orders_done"], metrics["orders_waiting"]) == (2, 1, 1)
    assert metrics["orders_per_hour"] == 120.0  # one in 30 s
    assert (metrics["time_in_system_s"], metrics["lateness_s"]) == (25.0, 5.0)
    assert (metrics["orders_late"], metrics["loaded_m"], metrics["empty_m"]) == (1, 16.0, 16.0)
    # Busy from 3 s to 26 s, one of two robots with software.
    assert metrics["utilization"] == pytest.approx(23 / 30 / 2)
    assert metrics["station_utilization"] == {
        "shelf": pytest.approx(8 / 30), "dock": pytest.approx(5 / 30), "plug": 0.0}
    assert bench.task.measure() == {"orders_done": 1, "orders_open": 1}


def test_a_station_serves_one_robot_after_the_other():
    bench = deliveries()
    bench.move(2, 4.0, 5.0)
    bench.run(3 * S)
    bench.act("robot_10", Serve("shelf", 1))
    bench.act("robot_10", Serve("shelf", 1))  # it asks again, and waits once
    bench.act("robot_1", Serve("shelf", 0))
    bench.run(30 * S)
    assert [(row[0] // S, row[2]) for row in bench.rows if row[1] == "order_picked"] == [
        (11, "robot_10"), (19, "robot_1")]
    assert bench.task.metrics()["station_wait_s"]["shelf"] == 4.0  # 0 s and 8 s


def test_a_load_is_there_once():
    bench = deliveries()
    bench.move(2, 4.0, 5.0)
    bench.run(3 * S)
    for robot in ("robot_1", "robot_10"):
        bench.act(robot, Serve("shelf", 0))
    bench.run(30 * S)
    assert said(bench, "robot_10")[-1] == Served("shelf", 0, ServiceEnd.GONE)
    assert bench.task.metrics()["wasted_picks"] == 1


@pytest.mark.parametrize("serve, outcome", [
    (Serve("shelf", 7), ServiceEnd.GONE), (Serve("shelf"), ServiceEnd.GONE),
    (Serve("dock"), ServiceEnd.AWAY)])
def test_what_is_not_served(serve, outcome):
    bench = deliveries()
    bench.run(3 * S)
    bench.act("robot_1", serve)
    assert said(bench, "robot_1")[-1] == Served(serve.station, serve.order, outcome)
    assert bench.task.metrics()["utilization"] == 0.0


def test_a_robot_has_room_for_one_load_and_none_to_leave_without_one():
    bench = deliveries()
    bench.run(3 * S)
    bench.act("robot_1", Serve("shelf", 0))
    bench.run(12 * S)
    bench.act("robot_1", Serve("shelf", 1))
    bench.move(2, 20.0, 4.0)
    bench.act("robot_10", Serve("dock"))
    assert said(bench, "robot_1")[-1] == Served("shelf", 0, ServiceEnd.LOADED)
    assert said(bench, "robot_10")[-1] == Served("dock", None, ServiceEnd.EMPTY)


def test_who_leaves_while_it_is_served_gets_nothing():
    bench = deliveries()
    bench.run(3 * S)
    bench.act("robot_1", Serve("shelf", 0))
    bench.run(5 * S)
    bench.move(0, 10.0, 4.0)
    bench.run(12 * S)
    assert said(bench, "robot_1")[-1] == Served("shelf", 0, ServiceEnd.AWAY)
    assert bench.task.metrics()["orders_waiting"] == 2


def test_a_desk_asks_for_orders_that_wait():
    bench = deliveries()
    bench.run(5 * S)
    bench.act("robot_1", Serve("shelf", 0))
    bench.run(20 * S)
    bench.act("robot_10", AskOrders())
    assert said(bench, "robot_10")[2:] == [TransportOrder(1, "shelf", "dock")]


def test_the_run_ends_when_all_listed_orders_are_done():
    bench = deliveries(orders=(("1 s", "shelf", "dock"),))
    bench.run(3 * S)
    bench.act("robot_1", Serve("shelf", 0))
    bench.run(12 * S)
    bench.move(0, 20.0, 4.0)
    bench.act("robot_1", Serve("dock"))
    bench.run(16 * S)
    assert bench.reason is None
    bench.run(18 * S)
    assert bench.reason == "delivered"


def test_a_battery_empties_and_is_charged():
    """1 kJ: 600 J are used, the rest is charged in 60 of 100 s."""
    bench = deliveries()
    bench.move(0, 4.0, 20.0)
    bench.used_j = np.array([600.0, np.nan, 999.0])
    bench.run(2 * S)
    assert said(bench, "robot_1")[-1] == TransportOrder(1, "shelf", "dock")
    assert Charge(pytest.approx(0.4)) in said(bench, "robot_1")
    bench.act("robot_1", Serve("plug"))
    bench.run(61 * S)
    assert ("charged" in {row[1] for row in bench.rows}) is False
    bench.used_j = np.array([610.0, np.nan, 1000.0])
    bench.run(64 * S)
    assert said(bench, "robot_1")[-2:] == [Charge(1.0), Served("plug", None, ServiceEnd.DONE)]
    assert set(bench.held) == {"robot_10"} and bench.task.metrics()["batteries_empty"] == 1


def test_poisson_arrivals_have_their_mean_and_spread():
    """Intervals are exponential: mean and standard deviation are equal."""
    arrivals = poisson(("a", "b"), ("c",), 10 * S, np.random.default_rng(0))
    found = [next(arrivals) for _ in range(20_000)]
    intervals_s = np.diff([time_ns for time_ns, *_ in found]) / S
    assert intervals_s.mean() == pytest.approx(10.0, rel=0.02)  # 3 standard errors
    assert intervals_s.std() == pytest.approx(10.0, rel=0.03)
    assert np.mean([pick == "a" for _, pick, _ in found]) == pytest.approx(0.5, abs=0.011)


def test_orders_of_a_file(tmp_path):
    path = tmp_path / "orders.csv"
    path.write_text("time,pick,drop\n12.5,a,c\n1 min,b,c\n3,b,c\n")
    assert from_file(str(path), ["a", "b"], ["c"]) == [
        (3 * S, "b", "c"), (12_500_000_000, "a", "c"), (60 * S, "b", "c")]


@pytest.mark.parametrize("rows, text", [
    ("1,a,d", ":2: no station 'd' of the kind drop; allowed: c"),
    ("1,c,c", ":2: no station 'c' of the kind pick; allowed: a, b"),
    ("-1,a,c", ":2: time is '-1'; allowed: a time such as 12.5 or 3 min"),
    ("soon,a,c", ":2: time is 'soon'; allowed: a time such as 12.5 or 3 min"),
])
def test_wrong_files(tmp_path, rows, text):
    path = tmp_path / "orders.csv"
    path.write_text(f"time,pick,drop\n{rows}\n")
    with pytest.raises(InputError) as caught:
        from_file(str(path), ["a", "b"], ["c"])
    assert str(caught.value) == f"{path}{text}"


@pytest.mark.parametrize("changes, text", [
    ({"stations": {"shelf": {**SHELF, "at": ["0.1 m", "4 m"]}, "dock": DOCK}},
     ".stations.shelf.at: 0.1 m, 4 m is inside a wall"),
    ({"stations": {"shelf": SHELF, "dock": {**DOCK, "at": ["99 m", "4 m"]}}},
     ".stations.dock.at: 99 m, 4 m is outside the terrain"),
    ({"stations": {"shelf": SHELF, "rack": SHELF}},
     ".stations: there is no drop; allowed: at least one pick and one drop"),
    ({"orders": (("1 s", "shelf", "duck"),)},
     ".orders.0: no station 'duck' of the kind drop (did you mean 'dock'?); allowed: dock"),
    ({"every": "3 s", "orders": (("1 s", "shelf", "dock"),)},
     ".every: orders arrive by one of every, orders and file; give one of them"),
])
def test_deliveries_that_cannot_be(changes, text):
    with pytest.raises(InputError) as caught:
        deliveries(**changes)
    assert str(caught.value) == text


@pytest.mark.parametrize("content", [Serve("duck"), "dance"])
def test_actions_that_are_none(content):
    with pytest.raises(ModelError, match="^robot_1 cannot do .*; allowed: Serve at a station"):
        deliveries().act("robot_1", content)


def test_the_briefing_has_the_stations():
    briefing = deliveries(reach="3 m").task.briefing()
    assert briefing.reach_m == 3.0
    assert briefing.at("dock")[1:] == ("drop", Place(20.0, 4.0))

"""Whole runs of deliveries: every order is done once, also where the network is cut."""

from collections import Counter

import numpy as np
import pytest
from runs import SCENARIOS, audited, built, finished

from desim.api import run
from desim.errors import InputError
from desim.monitor.summary import summarize
from desim.ports.delivery import Carries
from desim.robot.coordination.orders.porter import Porter
from desim.robot.coordination.traffic.wishes import WishTraffic

DELIVERY = SCENARIOS / "delivery_small.yaml"
ORDERS = ("task.every=null", "task.orders=[[1 s, shelf_1, dock_1], [2 s, shelf_2, dock_2], "
          "[3 s, shelf_2, dock_1], [4 s, shelf_1, dock_2], [60 s, shelf_1, dock_1]]")
KINDS = {"hungarian": ("coordination={strategy: dispatcher}",),
         "insertion": ("coordination={strategy: dispatcher, assignment: insertion}",
                       "hosts.base.strategy={strategy: dispatcher, assignment: insertion}"),
         "auction": ("coordination={strategy: auction}", "hosts.base.strategy=auction")}
GUIDED = ("coordination.strategy=guided_dispatcher", "hosts.base.strategy=guided_dispatcher")
each = pytest.mark.parametrize("kind", KINDS)
CUT = "network.media.air.rules=[{rule: loss, probability: 1, from: 15 s, until: 80 s}]"


class Rows:
    """The rows of a run."""

    def __init__(self):
        self.rows = []

    def counts(self, simulation, kind):
        rows = np.concatenate(self.rows)
        own = rows[rows["kind"] == simulation.names.id(kind)]
        return Counter(own["a"].tolist())


def played(*changes):
    rows = Rows()
    simulation = built(DELIVERY, *ORDERS, *changes, trace_sink=rows.rows.append)
    outcome = finished(simulation)
    return outcome, summarize(simulation.monitor, outcome.simulated_ns), rows, simulation


@each
def test_all_orders_are_done(kind):
    outcome, summary, rows, simulation = played(*KINDS[kind])
    assert outcome.stop_reason == "delivered"
    assert summary["orders_done"] == 5 and summary["wasted_picks"] == 0
    assert rows.counts(simulation, "order_done") == dict.fromkeys(range(5), 1)
    driven_m = sum(simulation.monitor.truth.travelled_m())
    assert summary["loaded_m"] + summary["empty_m"] == pytest.approx(driven_m)


@each
def test_with_the_network_cut_orders_are_neither_lost_nor_done_twice(kind):
    """From 15 s on, all have orders and nobody is heard for 65 s: these are done; the last order
    is done after that."""
    outcome, summary, rows, simulation = played(*KINDS[kind], CUT)
    assert outcome.stop_reason == "delivered" and outcome.simulated_ns > 80e9
    assert rows.counts(simulation, "order_done") == dict.fromkeys(range(5), 1)
    assert rows.counts(simulation, "order_gone").total() == summary["wasted_picks"]


@each
def test_without_a_network_nobody_has_an_order(kind):
    outcome, summary, *_ = played(*KINDS[kind], "stop.elapsed=60 s", CUT.replace("15 s", "0 s"))
    assert outcome.stop_reason == "elapsed"
    assert (summary["orders"], summary["orders_waiting"]) == (5, 5)


def test_a_desk_that_starts_again_asks_for_what_waits():
    outcome, summary, *_ = played("faults=[{at: 0.5 s, host: base, down_for: 10 s}]")
    assert outcome.stop_reason == "delivered" and summary["orders_done"] == 5


@each
@pytest.mark.parametrize("at_s", [10, 20, 40])
def test_a_desk_that_starts_again_in_mid_run_goes_on(kind, at_s):
    outcome, summary, rows, simulation = played(
        *KINDS[kind], f"faults=[{{at: {at_s} s, host: base, down_for: 20 s}}]")
    assert outcome.stop_reason == "delivered"
    assert rows.counts(simulation, "order_done") == dict.fromkeys(range(5), 1)


@each
@pytest.mark.parametrize("robot", ["robot_1", "robot_3"])
def test_a_robot_that_starts_again_knows_what_it_carries(kind, robot):
    """At 20 s these are being loaded or have a load, which they bring to its dock."""
    outcome, summary, rows, simulation = played(
        *KINDS[kind], f"faults=[{{at: 20 s, host: {robot}, down_for: 20 s}}]")
    assert outcome.stop_reason == "delivered" and outcome.simulated_ns < 120e9
    assert rows.counts(simulation, "order_done") == dict.fromkeys(range(5), 1)


def test_a_robot_that_does_not_ask_keeps_its_load(monkeypatch):
    """The twin."""
    notified = Porter.notified
    monkeypatch.setattr(Porter, "notified", lambda self, robot, content: isinstance(
        content, Carries) or notified(self, robot, content))
    outcome, summary, *_ = played(*KINDS["auction"],
                                  "faults=[{at: 20 s, host: robot_1, down_for: 20 s}]")
    assert outcome.stop_reason == "elapsed" and summary["orders_done"] == 3


def test_batteries_are_charged_in_time():
    """A robot draws about 40 W: 6 Wh last for nine minutes, the last quarter for two, in which all
    four are charged one after another: 22 s for a battery of a quarter, 30 s for an empty one."""
    simulation = built(
        DELIVERY, "task.stations.plug={kind: charge, at: [-11 m, -3 m], service: 30 s}",
        "robot.power={battery: 6 Wh}", "stop.elapsed=600 s")
    outcome = simulation.run()
    audited(simulation)
    summary = summarize(simulation.monitor, outcome.simulated_ns)
    assert 4 * 22.5 <= summary["station_utilization"]["plug"] * 600 <= 4 * 30.0
    assert summary["batteries_empty"] == 0 and summary["orders_done"] >= 10


def test_who_cannot_charge_stands():
    outcome, summary, *_ = played("robot.power={battery: 0.5 Wh}", "stop.elapsed=100 s")
    assert summary["batteries_empty"] == 4
    assert outcome.stop_reason == "elapsed"


def test_a_station_in_a_wall_is_named_with_its_line(tmp_path):
    path = tmp_path / "walled.yaml"
    path.write_text(f"extends: {DELIVERY}\nname: walled\ntask:\n  stations:\n"
                    "    dock_1: {at: [15 m, 6 m]}\n")
    with pytest.raises(InputError) as caught:
        run(path, out=tmp_path)
    assert str(caught.value) == (f"{path}:5:18: task.stations.dock_1.at: 15 m, 6 m is inside a "
                                 "wall")


@pytest.mark.parametrize("planner", ["pibt", "prioritized"])
def test_robots_that_drive_over_granted_cells_do_all_orders(planner):
    own = f"{{strategy: guided_dispatcher, planner: {planner}}}"
    outcome, summary, rows, simulation = played(f"coordination={own}", f"hosts.base.strategy={own}")
    assert outcome.stop_reason == "delivered" and summary["collisions"] == 0
    assert rows.counts(simulation, "order_done") == dict.fromkeys(range(5), 1)


@pytest.mark.parametrize("trouble", [
    CUT, "faults=[{at: 15 s, host: base, down_for: 20 s}]",
    "faults=[{at: 15 s, host: robot_0, down_for: 20 s}]"])
def test_guided_robots_stand_while_nobody_is_heard_and_go_on(trouble):
    outcome, summary, rows, simulation = played(*GUIDED, trouble)
    assert outcome.stop_reason == "delivered" and summary["collisions"] == 0
    assert rows.counts(simulation, "order_done") == dict.fromkeys(range(5), 1)


def test_robots_that_do_not_say_what_they_want_stand(monkeypatch):
    """The twin."""
    monkeypatch.setattr(WishTraffic, "says", lambda self, robot, anew: {"wish": None})
    outcome, summary, *_ = played(*GUIDED, "stop.elapsed=150 s")
    assert outcome.stop_reason == "elapsed" and summary["orders_done"] == 0

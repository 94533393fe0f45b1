"""Whole patrols: what is measured is what happened, and what a run leaves can be read."""

import json

import pytest
from runs import SCENARIOS, audited, built

import desim
from desim.advice.warnings import warnings
from desim.monitor.summary import summarize
from desim.report.key_figures import key_figures
from desim.report.replay.facts import facts
from desim.robot.coordination.strategies import cyclic_patrol
from desim.scenario.load import from_mapping
from desim.simulation.simulation import Simulation

PATROL = SCENARIOS / "patrol.yaml"
S = 1_000_000_000


def played(strategy, *case):
    """The simulation, its summary, and its visits: time ns, robot, place, idleness ns."""
    rows = []
    simulation = built(PATROL, f"coordination.strategy={strategy}", *case, trace_sink=rows.append)
    simulation.run()
    summary = summarize(simulation.monitor, simulation.kernel.now_ns)
    simulation.trace.flush()
    visit = simulation.names.id("visit")
    visits = [(row["t_ns"].item(), simulation.names[row["entity"].item()], row["a"].item(),
               row["b"].item()) for batch in rows for row in batch[batch["kind"] == visit]]
    audited(simulation)
    return simulation, summary, visits


@pytest.fixture(scope="module")
def cyclic():
    return played("cyclic_patrol")


def test_the_summary_is_a_fold_over_the_visits(cyclic):
    _, summary, visits = cyclic
    assert summary["simulated_s"] == 300
    assert summary["visits"] == len(visits) > 50
    assert summary["visits_by_place"] == [sum(place == i for _, _, place, _ in visits)
                                          for i in range(10)]
    assert sum(summary["visits_by_robot"]) == len(visits)
    assert summary["idleness_worst_s"] >= max(idle for *_, idle in visits) / S
    assert "exploration_time_s" not in summary


def test_a_tour_leaves_places_alone_for_less_time_than_looking_around_does(cyclic):
    """Chevaleyre 2004: one cycle is near the best there is. So the worst idleness of three robots
    on it is less than that of three that look around, who meet and part as it happens."""
    around = played("conscientious_reactive")[1]
    assert cyclic[1]["idleness_worst_s"] < around["idleness_worst_s"]
    assert cyclic[1]["idleness_mean_s"] < around["idleness_mean_s"]


def test_intentions_matter(cyclic):
    """Robots that hear of each other's intentions leave places alone for less time."""
    heard = played("expected_reactive")[1]
    jammed = "network.media.lan={model: ideal, rules: [{rule: loss, probability: 1}]}"
    deaf = played("expected_reactive", "deployment=field", jammed)[1]
    assert heard["messages_by_topic"]["/*/strategy/intention"]["delivered"] > 0
    assert heard["idleness_mean_s"] < deaf["idleness_mean_s"]


def test_a_patrol_goes_on_through_a_cut():
    """Without others' intentions, places are visited as before, and none is left alone."""
    simulation, summary, visits = played(
        "expected_reactive", "deployment=field", "network.media.lan={model: ideal, rules: [{rule: "
        "loss, probability: 1, from: 100 s, until: 200 s}]}")
    in_cut = {place for t_ns, _, place, _ in visits if 100 * S < t_ns < 200 * S}
    assert in_cut == set(range(10)) and summary["idleness_worst_s"] < 120.0


def test_robots_that_do_not_know_the_terrain_find_their_places():
    known, unknown = (played("expected_reactive", f"task.map={word}", "stop.elapsed=120 s")[1]
                      for word in ("known", "unknown"))
    assert known["explored"] == 1.0
    assert min(unknown["visits_by_place"]) >= 1


def test_the_places_do_not_depend_on_the_fleet(cyclic):
    simulation = cyclic[0]
    places = simulation.monitor.task.briefing().places
    again = played("conscientious_reactive", "stop.elapsed=1 s", "fleet.size=2")[0]
    assert again.monitor.task.briefing().places == places  # drawn by name, from the seed


def test_a_stopped_robot_starts_again_with_its_map_and_its_task():
    simulation, _, visits = played("cyclic_patrol", "stop.elapsed=120 s",
                                   "faults=[{at: 40 s, host: robot_1, down_for: 10 s}]")
    assert any(robot == "robot_1" and t_ns > 55 * S for t_ns, robot, *_ in visits)


def test_a_condition_on_idleness_ends_a_run():
    simulation = built(PATROL, "stop.when=idleness_s > 20", "coordination.exchange=null",
                       "robot.passive=[robot_1, robot_2]", "measure.every=1 s")
    assert simulation.run().stop_reason == "condition: idleness_s > 20"
    assert summarize(simulation.monitor, simulation.kernel.now_ns)["idleness_worst_s"] > 20


def test_a_folder_of_a_patrol_can_be_read_and_shown(tmp_path):
    run = desim.run(PATROL, out=tmp_path, overrides=["stop.elapsed=20 s", "measure.every=2 s"])
    assert json.loads((run.path / "summary.json").read_text())["task"] == "patrolling"
    assert {"idleness_s", "idleness_worst_s", "visits"} <= set(run.samples)
    figures = {name.strip(): value for name, value, _ in key_figures(run.metrics, run.manifest)}
    assert figures["task"] == "patrolling"
    assert figures["visits"] == str(run.metrics["visits"])
    assert figures["idleness mean"] == f"{run.metrics['idleness_mean_s']:.4g} s"
    heads = dict(facts(run.scenario, run.metrics, 3))
    assert heads["idleness worst"].endswith(" s")
    again = desim.run(run.path / "scenario.resolved.yaml", out=tmp_path / "again")
    assert again.manifest["digest"] == run.manifest["digest"]


HALL = {"name": "hall", "task": {"model": "patrolling", "places": [
            ["-9 m", "-9 m"], ["9 m", "-9 m"], ["9 m", "9 m"], ["-9 m", "9 m"]]},
        "environment": {"terrain": {"size": ["24 m", "24 m"]}},
        "coordination": "cyclic_patrol", "stop": {"elapsed": "240 s"}}
TOUR_M = 4 * 18.0


def in_the_hall(robots, strategy="cyclic_patrol"):
    """The metrics of robots that start near the corners in turn."""
    poses = [{"x": f"{x} m", "y": f"{y} m"} for x, y in ((-7, -7), (7, 7), (7, -7), (-7, 7))]
    simulation = Simulation(from_mapping({
        **HALL, "coordination": strategy,
        "fleet": {"start": {"poses": poses[:robots]}}}).scenario)
    simulation.run()
    return (simulation.monitor.task.metrics(),
            simulation.world.travelled_m().sum() / (240.0 * robots))


@pytest.mark.parametrize("robots", [1, 2, 4])
def test_on_a_tour_the_interval_is_its_length_over_the_speed_and_the_robots(robots):
    """Chevaleyre 2004: n robots at equal distances on a tour of length L come by every L / (n v).
    A visit lasts for a tenth of that, in which a place is not alone: 1 m, a turn, 1 m."""
    metrics, speed_mps = in_the_hall(robots)
    expected_s = TOUR_M / (robots * speed_mps)
    assert metrics["visits"] == pytest.approx(4 * 240.0 / expected_s, abs=robots)
    assert 0.8 * expected_s < metrics["interval_mean_s"] < expected_s
    # Idleness grows from 0 to the interval, again and again.
    assert metrics["idleness_mean_s"] == pytest.approx(expected_s / 2, rel=0.2)


def test_robots_that_are_not_spread_gain_less(monkeypatch):
    """The twin: both robots begin the tour at its first place."""
    spread = in_the_hall(2)[0]
    monkeypatch.setattr(cyclic_patrol, "natural_key", lambda name: 0)
    together = in_the_hall(2)[0]
    assert together["idleness_mean_s"] > 1.2 * spread["idleness_mean_s"]


CLOSED = {"name": "closed", "coordination": "cyclic_patrol", "stop": {"elapsed": "60 s"},
          "task": {"model": "patrolling", "places": [
              ["-9 m", "5 m"], ["8 m", "4 m"], ["9 m", "-5 m"], ["-9 m", "-5 m"]]},
          "environment": {"terrain": {"size": ["24 m", "16 m"], "drawing": {
              "cell": "8 m", "lines": ["+--+--+--+",
                                       "|     |  |",
                                       "+  +  +--+",
                                       "|  |     |",
                                       "+--+--+--+"]}}},
          "fleet": {"size": 2, "start": {"from": ["-10 m", "6 m"], "step": ["2 m", "0 m"]}}}


@pytest.mark.parametrize("terrain", ["known", "unknown"])
def test_a_place_behind_walls_is_left_out_and_named(terrain):
    task = {**CLOSED["task"], "map": terrain}
    simulation = Simulation(from_mapping({**CLOSED, "task": task}).scenario)
    simulation.run()
    visits = simulation.monitor.task.metrics()["visits_by_place"]
    assert visits[1] == 0
    assert min(visits[0], *visits[2:]) >= 1
    assert warnings(simulation.monitor) == ["task.places.1: nobody has been at 8 m, 4 m: no path "
                                            "leads there from where the robots are"]


def test_a_place_that_nobody_had_time_to_visit_is_not_named():
    simulation = Simulation(from_mapping({
        **CLOSED, "stop": {"elapsed": "1 s"}, "task": {
            **CLOSED["task"], "places": [["-9 m", "-5 m"], ["9 m", "-5 m"]]}}).scenario)
    simulation.run()
    assert not any("no path" in text for text in warnings(simulation.monitor))

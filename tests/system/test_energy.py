"""The energy of whole fleets: all of it is found again in what else is measured."""

import pytest
from runs import HELLO, built

from desim.monitor.summary import robots_table, samples_table, summarize

SHORT = "stop.elapsed=10 s"
POWER = ("robot.power={base: {idle: 7 W, motion: 6 J/m}, sensors: 20 W, "
         "computer: {idle: 8 W, processor: 3 W}, "
         "radio: {idle: 1 W, receive: 2 W, send: 4 W, rate: 10 Mb/s}}")


def measured(*overrides):
    simulation = built(HELLO, SHORT, *overrides)
    outcome = simulation.run()
    return outcome, simulation.monitor, summarize(simulation.monitor, outcome.simulated_ns)


def test_to_measure_energy_changes_nothing_else():
    plain, _, without = measured()
    metered, monitor, found = measured(POWER)
    assert metered == plain
    assert (without["energy_j"], without["robots"]["robot_0"]["battery_life_s"]) == (None, None)
    assert "energy_j" not in without["robots"]
    assert found["energy_j"] > 0 and found["exploration_cost"] == found["exploration_cost_m"]
    assert robots_table(monitor)["energy_j"][-3:].sum() == pytest.approx(found["energy_j"])


def test_the_energy_of_each_robot_adds_up():
    """In a testbed no model counts airtime: bytes over the LAN do."""
    _, monitor, found = measured(
        POWER, "computers=measured", "measure.cost=energy_j",
        "faults=[{at: 3 s, host: robot_1, down_for: 4 s}]")
    for name, ran_s in ("robot_0", 10), ("robot_1", 6), ("robot_2", 10):
        robot = found["robots"][name]
        assert robot["drive_j"] == pytest.approx(7 * ran_s + 6 * robot["distance_m"])
        assert robot["sensors_j"] == pytest.approx(20 * ran_s)
        assert robot["compute_j"] == pytest.approx(8 * ran_s + 3 * robot["cpu_s"])
        assert robot["radio_j"] == pytest.approx(1 * ran_s + 8e-4 * 10 * (
            1 * robot["rx_kBps"] + 3 * robot["tx_kBps"]))
    assert found["exploration_cost"] == found["energy_j"] == samples_table(monitor)["energy_j"][-1]
    assert found["exploration_efficiency"] == found["explored_area_m2"] / found["energy_j"]


def test_a_type_of_its_own_and_a_robot_without_software():
    _, _, found = measured(
        "fleet={size: null, robots: [{type: pioneer3dx, count: 2}, {type: heavy, count: 1}], "
        "types: {heavy: {robot: {power: {base: {motion: 20 J/m}}}}}}", "robot.passive=[robot_0]",
        "robot.power={sensors: 5 W}")
    first, second, third = (found["robots"][f"robot_{i}"] for i in range(3))
    assert first["energy_j"] is None
    assert (second["sensors_j"], third["sensors_j"]) == (50.0, 50.0)
    assert third["drive_j"] == pytest.approx(74 + 20 * third["distance_m"])

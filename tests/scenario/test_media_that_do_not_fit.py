"""``desim.load`` refuses what a run would, in the same words and with the place."""

import pytest

import desim
from desim.errors import InputError
from desim.simulation.simulation import Simulation

SCENARIO = """\
name: a
deployment: field
environment: {terrain: {size: [40 m, 40 m]}}
fleet: {size: 2, start: {from: [0 m, 0 m], step: [1 m, 0 m]}}
hosts: {base: {at: [0 m, -3 m]}}
network:
  media:
    air: {model: radio, standard: 11n, access_points: [{at: [0 m, 0 m], channel: 1}]}
"""


@pytest.fixture
def file(tmp_path):
    (tmp_path / "a.yaml").write_text(SCENARIO)
    return tmp_path / "a.yaml"


@pytest.mark.parametrize(("key", "value", "at", "says"), [
    ("access_points", "[{at: [0 m, 0 m], channel: 15}, {at: [9 m, 0 m], channel: 36}]",
     "access_points.0.channel", "there is no channel 15 of 20 MHz in 5 GHz; allowed: 36, 40, 44, "
     "48, 52, 56, 60, 64, 100, 104, 108, 112, 116, 120, 124, 128, 132, 136, 140, 144, 149, 153, "
     "157, 161, 165"),
    ("access_points", "[{at: [0 m, 0 m], channel: 1}, {at: [9 m, 0 m], channel: 3}]",
     "access_points.1.channel", "3 overlaps channel 1 of access point 0, which this model knows "
     "nothing of; allowed: the same, or 5 and more apart"),
    ("width", "80 MHz", "width", "11n has no channels of 80 MHz; allowed: 20 MHz, 40 MHz"),
    ("guard_interval", "1600 ns", "guard_interval",
     "11n has none of 1600 ns; allowed: 800 ns, 400 ns"),
    ("mcs", "9", "mcs", "11n has no 9 with this width and these streams; allowed: 0, 1, 2, 3, 4, "
                        "5, 6, 7"),
    ("constants", "{aggregate_packets: 200}", "constants.aggregate_packets",
     "11n has at most 64"),
    ("channels", "{robot_0: 6}", "channels", "stations take the channels of their access points; "
     "allowed: access_points without it"),
    ("infrastructure", "{wired: [bose]}", "infrastructure.wired.0", "'bose' names no host (did "
     "you mean 'base'?); hosts are base, robot_0, robot_1"),
    ("infrastructure", "{wired: [ap_0]}", "infrastructure.wired.0", "access points (ap_0) are "
     "wired anyway; allowed: hosts, which are base, robot_0, robot_1"),
    ("infrastructure", "{wires: {ports: {rack: [robot_7]}}}", "infrastructure.wires.ports.rack",
     "no host 'robot_7' (did you mean 'robot_1'?); hosts are base, robot_0, robot_1, ap_0"),
])
def test_what_a_run_refuses_is_refused_when_it_is_loaded(file, key, value, at, says):
    change = f"network.media.air.{key}={value}"
    with pytest.raises(InputError) as said:
        desim.load(file, [change])
    assert str(said.value) == f"--set {change}: network.media.air.{at}: {says}"


def test_a_run_of_a_scenario_that_was_changed_since_says_the_same(file):
    """The twin: nobody asked when it was loaded."""
    scenario = desim.load(file).scenario
    air = scenario.network.media["air"]
    air._params = air.params.model_copy(update={"width_hz": 80e6})
    with pytest.raises(InputError) as said:
        Simulation(scenario).graph.start()
    assert str(said.value) == ("network.media.air.width: 11n has no channels of 80 MHz; allowed: "
                               "20 MHz, 40 MHz")


def test_hosts_of_one_cable_behind_access_points(file):
    desim.load(file, ["network.media.air.infrastructure={wired: [base], wires: {ports: {rack: "
                      "[base, ap_0]}}}"])


def test_what_the_rung_ideal_does_not_read_is_not_checked(file):
    desim.load(file, ["network.media.air.fidelity=ideal", "network.media.air.mcs=9"])


@pytest.mark.parametrize("change", ["network.media.air.standard=11z", "network.media.air.streams=9",
                                    "network.media.air.path_loss={model: fixed}"])
def test_a_wrong_parameter_beside_a_fault_of_an_access_point_is_said_once(file, change):
    """The access points stand in these parameters, of which the wrong ones are left out."""
    file.write_text(SCENARIO + "faults: [{at: 1 s, host: ap_0, down_for: 1 s}]\n")
    with pytest.raises(InputError) as said:
        desim.load(file, [change])
    assert str(said.value).startswith(f"--set {change}: network.media.air.")
    assert len(said.value.args) == 1


@pytest.mark.parametrize(("air", "key", "says"), [
    ("{model: cellular, card: pi_4}", "card", "unknown key of cellular (a key of radio); allowed: "
     "model, rules, hosts, inside, metric, up, down, core, radio, queue, wired, gaps"),
    ("{model: lora, gateway: base, wired: [base]}", "wired", "unknown key of lora (a key of "
     "cellular); allowed: model, rules, hosts, inside, metric, gateway, spreading_factor, "
     "bandwidth, coding_rate, channels, duty_cycle, power, path_loss, capture, queue, lifetime"),
    ("{model: ieee802154, access_points: []}", "access_points", "unknown key of ieee802154 (a key "
     "of radio); allowed: model, rules, hosts, inside, metric, range, interference, min_be, "
     "max_be, backoffs, retries, queue")])
def test_a_key_of_another_radio_names_its_model(file, air, key, says):
    file.write_text(SCENARIO.replace(SCENARIO.split("air: ")[1], f"{air}\n"))
    with pytest.raises(InputError) as said:
        desim.load(file)
    place, _, text = str(said.value).partition(f": network.media.air.{key}: ")
    assert text == says and place.startswith(f"{file}:8:")

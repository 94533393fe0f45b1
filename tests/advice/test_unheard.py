"""The warnings of networks that carry nothing, each with a twin in which they do."""

import pytest
from runs import HELLO, built

from desim.advice.warnings import warnings

NOBODY_MOVES = "no robot has moved: does the strategy choose goals, and do commands arrive?"


def said(*overrides):
    simulation = built(HELLO, "stop.elapsed=2 s", "deployment=field", *overrides)
    simulation.run()
    return warnings(simulation.monitor)


# ------------------------------------------------------------------------------------ flows

FLOW = ("network.others={{nas: {nas}, laptop: {{at: [-8 m, 10 m]}}}}",
        "network.background=[{{medium: air, between: [{ends}], rate: 1 Mb/s, pattern: periodic}}]")


@pytest.mark.parametrize("ends", ["nas, laptop", "laptop, nas"])
def test_a_flow_of_which_nothing_arrives_is_said(ends):
    """Of 1518 B at 1 Mb/s 164.7 packets are due in 2 s."""
    line = (f"network.background.0: none of 164 packets from {ends.replace(',', ' to')} has "
            "arrived: 164 out_of_range")

    def of(nas):
        return said("network.media={air: {model: radio, fidelity: walls}}",
                    *(text.format(nas=nas, ends=ends) for text in FLOW))
    assert of("{}") == [f"{line}; nas has no place (network.others.nas.at), and nobody hears such "
                        "a host over a radio"]
    assert of("{at: [900 m, 0 m]}") == [line]
    assert of("{at: [-7 m, 10 m]}") == []


def test_without_a_radio_a_flow_needs_no_place():
    for model in "disk", "switch":
        assert said(f"network.media={{air: {{model: {model}}}}}",
                    *(text.format(nas="{}", ends="nas, laptop") for text in FLOW)) == []


def test_both_flows_of_the_page_arrive(repository, tmp_path):
    page = (repository / "docs" / "network-models.md").read_text()
    block = page.partition("## Background traffic\n\n```yaml\n")[2].partition("```")[0]
    (tmp_path / "page.yaml").write_text(f"extends: {HELLO}\n{block}")
    simulation = built(tmp_path / "page.yaml", "stop={elapsed: 15 s, explored: 100 %, by: all}")
    simulation.run()
    for flow in simulation.graph.background:
        assert flow.delivered > 1000
        assert not flow.dropped
    assert warnings(simulation.monitor) == []


# ------------------------------------------------------------------------------------ hosts

SLAM_AT_BASE = "robot.localization={model: gmapping, host: base}"


@pytest.mark.parametrize("air", ["model: radio", "model: radio, fidelity: walls",
                                 "model: multihop"])
def test_a_base_without_a_place_is_said_even_if_nothing_arrives_anywhere(air):
    radio = f"network.media.air={{{air}}}"
    assert said(radio, "hosts={base: {}}", SLAM_AT_BASE) == [
        "host base has no place (hosts.base.at), and no message from or to it has arrived: nobody "
        "hears such a host over a radio", NOBODY_MOVES]
    placed = said(radio, "hosts={base: {at: [-8 m, 10 m]}}", SLAM_AT_BASE)
    assert not [text for text in placed if "host base" in text]  # multihop finds its routes later


def test_of_a_wire_that_is_too_slow_no_radio_is_said():
    lan = "network.media.lan.model=switch"
    camera = "robot.publishes=[{{topic: camera, size: {size}, rate: 4 Hz, to: base}}]"
    assert said(lan, "hosts={base: {}}", camera.format(size="1 GB")) == [
        "host base: no message from or to it has arrived; of its topics were dropped: 18 "
        "outbox_full: is lan too slow for them, or the host out of reach there?"]
    assert said(lan, "hosts={base: {}}", camera.format(size="1 kB")) == []


def test_hosts_without_a_medium_in_common_are_said():
    camera = "robot.publishes=[{topic: camera, size: 1 kB, rate: 10 Hz, to: office}]"
    def of(base):
        return said(camera, f"hosts={{base: {{at: [0 m, 0 m], forwards: [{base}]}}, office: {{}}}}",
                    "network.media={air: {model: disk, hosts: [base, robot_0, robot_1, robot_2]}, "
                    "lan: {model: switch, hosts: [base, office]}}")
    assert of("") == [
        "host office: no message from or to it has arrived: it has no medium in common with "
        "robot_0 and 2 more, and no host forwards between them (network.media.<name>.hosts, "
        "topics, hosts.<name>.forwards)"]
    assert of("air, lan") == []


# ------------------------------------------------------------------------------------ buses

@pytest.mark.parametrize(("bus", "line"), [
    ("model: link, rate: 1 b/s",
     "its frames arrive after the end: is it too slow for the traffic?"),
    ("model: epidemic", "its frames have no fate at the end: is it too slow for the traffic, and "
     "does its model, epidemic, carry frames from a host to itself, as link and bus do?"),
    ("model: link, rules: [{rule: loss, probability: 1}]", "15 random_loss, by its rules"),
    ("model: radio", "15 retry_limit: does its model, radio, carry frames from a host to itself, "
     "as link and bus do?")])
def test_a_bus_that_carries_nothing_is_said_once_for_all_robots(bus, line):
    topic = "topics={scan: {medium: usb}}"
    assert said(f"network.media.usb={{{bus}, inside: true}}", topic) == [
        f"medium usb: nothing has arrived inside of a host: {line}", NOBODY_MOVES]
    assert said("network.media.usb={model: link, inside: true}", topic) == []


def test_a_fleet_that_sees_all_from_where_it_starts_is_no_fleet_that_cannot_move():
    assert said("stop.explored=1 %") == [
        "the run ended (explored) before a robot moved: robots see enough from where they start; a "
        "larger terrain or a shorter robot.laser.max_range is a task"]
    assert said("stop={explored: 100 %, elapsed: 10 ms}") == [NOBODY_MOVES]

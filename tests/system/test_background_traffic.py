"""A fleet beside background traffic: its cost for the fleet, and its separate account."""

import pytest
from runs import HELLO, Tally, audited, built, finished

from desim.advice.warnings import warnings
from desim.monitor.summary import summarize
from desim.monitor.traffic import packets_lost

OTHERS = "network.others={nas: {}, pc: {}}"
LAN = "network.media.lan={model: switch, rate: 100 Mb/s}"


def flows(*texts):
    return (OTHERS, f"network.background=[{', '.join(f'{{{text}}}' for text in texts)}]")


def fleet_of(*case, seconds=10):
    """A simulation that has run, and its summary."""
    simulation = built(HELLO, f"stop.elapsed={seconds} s", *case)
    simulation.run()
    return simulation, summarize(simulation.monitor, simulation.kernel.now_ns)


def test_on_ports_of_their_own_others_cost_the_fleet_nothing():
    """From one host of others to another, through the same switch: no row of the fleet changes."""
    def fleets_rows(*case):
        simulation, summary = fleet_of(LAN, *case)
        entities = simulation.trace.digest_by_entity()
        return ({name: digest for name, digest in entities.items() if name != "medium/lan"},
                {key: summary[key] for key in ("bytes_on_air", "packets_lost", "messages_delivered",
                                               "mean_rx_kBps", "mean_tx_kBps")})

    assert fleets_rows() == fleets_rows(*flows("medium: lan, between: [nas, pc], rate: 80 Mb/s"))


def test_the_summary_has_it_apart():
    simulation, summary = fleet_of(LAN, *flows(
        "medium: lan, between: [nas, workstation], rate: 40 Mb/s",
        "medium: lan, between: [pc, nas], rate: 10 Mb/s, pattern: periodic, size: 1000 B"))
    to_workstation, backup = summary["background"]
    assert (to_workstation["medium"], to_workstation["between"]) == ("lan", ["nas", "workstation"])
    assert to_workstation["sent"] == pytest.approx(40e6 * 10 / 8 / 1518, rel=0.02)
    assert abs(backup["sent"] - 12_500) <= 2
    for flow in summary["background"]:
        assert flow["sent"] == flow["delivered"] + sum(flow["dropped"].values()) + flow["in_flight"]
    lan = simulation.graph.media[0]
    assert lan.background_bytes == to_workstation["sent"] * 1518 + backup["sent"] * 1000
    assert summary["bytes_on_air"] == sum(lan.tx_bytes) - lan.background_bytes


def test_at_the_workstations_port_it_makes_the_fleet_wait():
    """90 of 100 Mb/s into the port behind which robots' maps and commands queue up."""
    def waits(*case):
        _, summary = fleet_of(LAN, *case)
        return summary["latency_by_topic"]["/*/cmd_vel"]["p95_s"]

    assert waits(*flows("medium: lan, between: [nas, workstation], rate: 90 Mb/s")) > 4 * waits()


def test_more_than_a_port_takes_is_lost_and_conserved():
    tally = Tally()
    simulation = built(HELLO, "stop.elapsed=6 s", LAN, *flows(
        *(f"medium: lan, between: [{other}, workstation], rate: 90 Mb/s, until: 5 s"
          for other in ("nas", "pc"))), trace_sink=tally.sink, on_fate=tally.fate)
    simulation.run()
    lan, flows_ = simulation.graph.media[0], simulation.graph.background
    lost = sum(sum(flow.dropped.values()) for flow in flows_)
    assert [flow.in_flight for flow in flows_] == [0, 0]
    assert lost / sum(flow.sent for flow in flows_) == pytest.approx(80 / 180, rel=0.1)
    fleets = sum(packets_lost(simulation.graph).values())
    assert fleets == sum(lan.packets_dropped.values()) - lost > 0
    audited(simulation)
    assert lan.packets_intended == lan.packets_delivered + sum(lan.packets_dropped.values())


@pytest.mark.parametrize("at, disturbs", [("[0 m, 0 m]", True), ("[9000 m, 0 m]", False)])
def test_on_the_air_neighbours_disturb_and_strangers_far_away_do_not(at, disturbs):
    """Two computers that fill the channel (54 Mb/s offered) near the fleet, or 9 km away."""
    def waits(*case):
        _, summary = fleet_of(
            "deployment=field", "network.media={lan: null, air: {model: radio}}",
            "robot.publishes=[{topic: camera, size: 20 kB, rate: 10 Hz, to: others}]", *case,
            seconds=2)
        return summary["latency_by_topic"]["/*/camera"]["p50_s"], summary["bytes_on_air"]

    far = f"network.others={{nas: {{at: {at}}}, pc: {{at: {at}}}}}"
    quiet = waits(far)
    loud = waits(far, "network.background=[{medium: air, between: [nas, pc], rate: 54 Mb/s}]")
    assert (loud == quiet) is not disturbs
    assert not disturbs or loud[0] > 1.5 * quiet[0]


def test_a_flow_is_its_own():
    """Others beside it, and the seed of nobody else, change nothing of its packets."""
    def sent(*texts):
        simulation, _ = fleet_of(LAN, *flows(*texts), seconds=5)
        return {flow.between: flow.sent for flow in simulation.graph.background}

    one = "medium: lan, between: [nas, pc], rate: 20 Mb/s"
    other = "medium: lan, between: [pc, workstation], rate: 5 Mb/s"
    both = sent(one, other)
    assert both == sent(other, one)
    assert both["nas", "pc"] == sent(one)["nas", "pc"]


def test_two_equal_flows_are_not_one_twice():
    one = "medium: lan, between: [nas, pc], rate: 20 Mb/s"
    simulation, _ = fleet_of(LAN, *flows(one, one), seconds=5)
    first, second = simulation.graph.background
    assert first.sent != second.sent


def test_the_ledger_and_several_networks_do_not_mind():
    simulation = built(HELLO, "stop.elapsed=3 s", "deployment=field", "network.failover={}",
                       "network.media={lan: null, air: {model: disk, range: 200 m}, "
                       "cable: {model: switch, rules: [{rule: outage, hosts: [robot_0], "
                       "from: 1 s}]}}", *flows("medium: air, between: [nas, pc], rate: 5 Mb/s, "
                                               "from: 1 s, until: 3 s"))
    finished(simulation)
    (flow,) = simulation.graph.background
    assert flow.delivered == flow.sent == pytest.approx(5e6 * 2 / 8 / 1518, rel=0.1)


@pytest.mark.parametrize(("slow", "quick", "said"), [
    ("switch, rate: 100 Mb/s", "switch, rate: 10 Gb/s", "are not settled: is it too slow for the "
     "traffic, or does its model forget frames?"),
    ("link", "link, rate: 10 Gb/s", "at the end: they arrive later: is it too slow "
     "for the traffic?")])
def test_a_warning_of_frames_under_way_says_where_they_are(slow, quick, said):
    """In the queue of a sending host, or on a link that knows when each will arrive."""
    def warned(model):
        simulation, _ = fleet_of(f"network.media.lan={{model: {model}}}", *flows(
            "medium: lan, between: [nas, pc], rate: 2 Gb/s, size: 1000 B"), seconds=2)
        return [text for text in warnings(simulation.monitor) if "at the end" in text]

    (text,) = warned(slow)
    assert text.startswith("medium lan: ") and text.endswith(said)
    assert warned(quick) == []


def test_frames_that_arrive_after_the_end_are_no_fault_of_their_model():
    simulation, _ = fleet_of("network.media.lan={model: link, latency: 1 h}", seconds=2)
    assert warnings(simulation.monitor) == [
        "host workstation: no message from or to it has arrived; of its topics were dropped: 204 "
        "outbox_full: is lan too slow for them, or the host out of reach there?",
        "no robot has moved: does the strategy choose goals, and do commands arrive?"]

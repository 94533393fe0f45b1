"""The resource that saturates first, in whole runs of which it is known."""

import pytest
from runs import HELLO, built

from desim.monitor.summary import samples_table, summarize
from desim.report.key_figures import _memory, _processors, _saturated

SHORT = "stop.elapsed=12 s"
NARROW = "network.media={lan: {model: switch, rate: 300 kb/s}}"
BUSY = "computers={model: table, callbacks: {localization: {any: {fixed: 200 ms}}}}"
KEEPS = ("computers={model: table, memory: {system: 70 MB, processes: {map_sharing: {per: {cells: "
         "1 kB}}}}}")


def summary(*overrides):
    simulation = built(HELLO, SHORT, *overrides)
    simulation.run()
    return summarize(simulation.monitor, simulation.kernel.now_ns)


def test_nothing_saturates_where_all_is_ample():
    found = summary()
    assert found["saturated_first"] is None
    assert 0 < found["saturation"]["lan"]["peak"] < 0.01
    assert list(found["saturation"]) == ["lan", "queue"]
    assert _saturated(found) == []


@pytest.mark.parametrize(("first", "part", "overrides"), [
    ("lan", "workstation sending and 3 more", (NARROW,)),
    ("processor", "robot_0 and 2 more", (BUSY, "robot.computer.processors=1")),
    ("memory", "robot_0 and 2 more", (KEEPS, "robot.computer.memory=100 MB"))])
def test_what_is_too_small_saturates(first, part, overrides):
    found = summary(*overrides)
    assert found["saturated_first"] == first
    own = found["saturation"][first]
    assert own["peak"] >= 0.9 and own["from_s"] in (5, 10)
    assert _saturated(found) == [
        ("saturates first", first, f"from {own['from_s']:.0f} s on: {part}")]
    ample = [override.replace("300 kb/s", "1 Gb/s").replace("200 ms", "1 ms").replace(
        "100 MB", "1 GB") for override in overrides]
    assert summary(*ample)["saturated_first"] is None  # the twin


def test_memory_that_is_full_between_two_looks_saturated():
    """Software that does not fit dies at its first callbacks; at the end of a window it is down."""
    found = summary(KEEPS, "robot.computer={memory: 71 MB, respawn_delay: 1 min}")
    assert found["memory_kills"] == 3
    assert found["saturated_first"] == "memory"
    assert found["saturation"]["memory"] == {
        "peak": 1.0, "from_s": 5.0, "part": "robot_0 and 2 more"}


def test_a_program_whose_thread_is_always_busy_saturates_beside_an_idle_processor():
    """SLAM that takes 3 s for each scan keeps one of four processors busy, and messages wait."""
    slow = "computers={model: table, callbacks: {localization: {any: {fixed: 3 s}}}}"
    four = "robot.computer.processors=4"
    found, twin = summary(slow, four), summary(slow.replace("3 s", "3 ms"), four)
    assert found["saturation"]["processor"]["peak"] < 0.4
    assert (found["saturated_first"], found["saturation"]["thread"]) == (
        "thread", {"peak": 1.0, "from_s": 5.0, "part": "robot_0/localization"})
    assert found["messages_replaced"] > twin["messages_replaced"]
    assert twin["saturated_first"] is None
    assert twin["saturation"]["thread"]["peak"] == pytest.approx(0.03, abs=0.02)


@pytest.mark.parametrize(("physical", "first"), [(1, "cluster_node"), (8, None)])
def test_a_cluster_s_node_saturates_before_the_machines_on_it(physical, first):
    """Three machines, each of whose two processors are busy for less than half of the time."""
    found = summary("computers={model: table, callbacks: {localization: {any: {fixed: 35 ms}}}}",
                    f"testbed.processors_per_node={physical}")
    assert found["saturated_first"] == first
    assert (found["saturation"]["cluster_node"]["peak"] > 0.9) == (physical == 1)


@pytest.mark.parametrize(("rate", "first"), [("180 kb/s", "usb"), ("12 Mb/s", None)])
def test_a_bus_inside_robots_saturated(rate, first):
    """A scan of 871 B, 25 times a second, is 174 kb/s."""
    found = summary(f"network.media.usb={{model: link, rate: {rate}, inside: true}}",
                    "deployment=field", "topics={scan: {medium: usb}}")
    assert found["saturated_first"] == first
    assert 0.174e6 / {"180 kb/s": 0.18e6, "12 Mb/s": 12e6}[rate] == pytest.approx(
        found["saturation"]["usb"]["peak"], rel=0.05)


def test_a_few_lost_messages_are_no_queue_that_saturated():
    """Outboxes fill while robot_1 is cut off for a second."""
    found = summary("network.media.lan={model: switch, rate: 1 Gb/s, rules: [{rule: outage, "
                    "links: [[robot_1, '*']], from: 6 s, until: 7 s}]}")
    assert 0 < found["saturation"]["queue"]["peak"] < 0.1 and found["saturation"]["queue"]["lost"]
    assert found["saturated_first"] is None


def test_full_queues_are_counted():
    found = summary(NARROW)
    lost = found["messages_dropped"].get("outbox_full", 0) + found["messages_dropped"].get(
        "queue_full", 0)
    assert found["saturation"]["queue"]["lost"] >= lost > 0
    assert found["saturation"]["queue"]["from_s"] == 5


def test_memory_is_in_the_terminal_s_table_where_it_is_measured():
    found = summary(KEEPS, "robot.computer={memory: 85 MB, respawn_delay: 2 s}")
    assert found["memory_kills"] > 0
    assert [row[:2] for row in _memory(found)] == [
        ("memory", f"{found['mean_ram_mb']:.0f} MB"), ("", f"{found['memory_kills']} killed")]
    assert _memory(summary()) == []


def test_the_terminal_s_table_names_hosts_beside_robots():
    """A base whose SLAM does not fit dies again and again."""
    found = summary("robot.localization={model: gmapping, least_particles: 30, host: base}",
                    "computers=measured",
                    "hosts={base: {computer: {memory: 60 MB, respawn_delay: 2 s}}}")
    rows = _processors(found)
    assert ("", f"{found['hosts']['base']['killed']['robot_0/slam']} killed",
            "processes of base, for want of memory") in rows
    assert ("", "0.0 % busy", "of workstation's") in rows


def test_rates_of_interfaces_are_those_of_the_run():
    simulation = built(HELLO, SHORT)
    simulation.run()
    found = summarize(simulation.monitor, simulation.kernel.now_ns)
    samples = samples_table(simulation.monitor)
    assert samples["time_s"] == [0, 5, 10, 12]
    for key in ("rx_kBps", "tx_kBps"):
        rates = samples[key]
        assert rates[0] is None
        assert found[f"mean_{key}"] == pytest.approx(
            (5 * rates[1] + 5 * rates[2] + 2 * rates[3]) / 12)

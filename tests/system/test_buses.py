"""Robots with a bus inside, between sensors, motors and processor."""

import pytest
from runs import HELLO, Tally, audited, built, finished

from desim.advice.warnings import warnings
from desim.errors import InputError
from desim.export.pcap.capture import write_pcap
from desim.monitor.summary import summarize

SENSORS = "topics={scan: {medium: line}, true_pose: {medium: line}, cmd_vel: {medium: line}}"


def line(rate):
    return f"network.media.line={{model: link, rate: {rate}, latency: 0 ns, inside: true}}"


FIELD = ("deployment=field", "stop.elapsed=10 s")


def summary_of(*case):
    simulation = built(HELLO, *FIELD, *case)
    simulation.run()
    summary = summarize(simulation.monitor, simulation.kernel.now_ns)
    audited(simulation)
    return summary


def test_a_bus_that_nobody_chooses_changes_nothing():
    digests = {built(HELLO, *FIELD, *case).run().digest for case in ((), (line("1 Mb/s"),))}
    assert len(digests) == 1


def test_scans_over_usb():
    """801 B of a scan and 70 B of headers take 0.58 ms at 12 Mb/s, the highest of each instant."""
    summary = summary_of(line("12 Mb/s"), SENSORS)
    scans = summary["latency_by_topic"]["/*/scan"]
    assert scans["count"] == 3 * 250
    assert 0.58e-3 <= scans["p50_s"] <= 0.58e-3 * 1.13  # the edge of a bin
    # 25 scans, 10 poses (812 B) and at most 10 commands (122 B) a second.
    busy = summary["utilisation"]["line"]["mean"]
    assert 8 * (25 * 871 + 10 * 812) / 12e6 <= busy <= 8 * (25 * 871 + 10 * 934) / 12e6


def test_scans_over_a_slow_line_are_old_and_few():
    """115.2 kb/s carry 16 scans a second, if nothing else: most wait and are replaced."""
    summary = summary_of(line("115200 b/s"), SENSORS)
    scans = summary["messages_by_topic"]["/*/scan"]
    assert scans["dropped"] > scans["delivered"]
    assert summary["latency_by_topic"]["/*/scan"]["p50_s"] > 0.06  # its time on the line
    assert summary["utilisation"]["line"]["mean"] > 0.99


@pytest.mark.parametrize(("model", "said"), [("radio", 1), ("link", 0)])
def test_a_medium_that_carries_nothing_from_a_host_to_itself_is_named(model, said):
    simulation = built(HELLO, *FIELD, f"network.media.line={{model: {model}, inside: true}}",
                       SENSORS, "stop.elapsed=3 s")
    simulation.run()
    texts = [text for text in warnings(simulation.monitor)
             if text.startswith("medium line: nothing")]
    assert len(texts) == said


@pytest.mark.parametrize("middleware", ["direct", "ros1", "multimaster", "dds", "zenoh"])
def test_under_every_middleware_messages_inside_take_the_line(middleware):
    summary = summary_of(line("12 Mb/s"), SENSORS, f"middleware={middleware}")
    assert summary["latency_by_topic"]["/*/scan"]["count"] > 3 * 200
    assert summary["explored"] > 0.5


def test_fates_and_frames_on_a_slow_line_are_all_accounted_for():
    tally = Tally()
    simulation = built(HELLO, *FIELD, line("200 kb/s"), SENSORS, trace_sink=tally.sink,
                       on_fate=tally.fate)
    finished(simulation)
    simulation.trace.flush()
    tally.fold(simulation.names)
    media = (*simulation.graph.media, *simulation.graph.inside)
    assert tally.rows["frame"] == sum(medium.frames for medium in media)
    assert [medium.name for medium in simulation.graph.inside] == [
        "line@robot_0", "line@robot_1", "line@robot_2"]


def test_buses_of_some_robots():
    simulation = built(HELLO, *FIELD, SENSORS, "network.media.line={model: link, inside: true, "
                                               "hosts: [robot_1]}")
    assert [medium.name for medium in simulation.graph.inside] == ["line@robot_1"]
    assert [medium.name for medium in simulation.graph.media] == ["air"]  # the field's own


def test_nobody_captures_a_line_inside(tmp_path):
    class Run:
        path, manifest = tmp_path, {"status": "finished"}
        scenario = built(HELLO, *FIELD, line("1 Mb/s")).scenario

    with pytest.raises(InputError, match="--medium: line is inside hosts; allowed: a medium"):
        write_pcap(Run(), "line", tmp_path / "x.pcap", lambda *_: None)

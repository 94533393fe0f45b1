"""The testbed's real traffic, part by part: sizes and rates by hand."""

import pytest
from runs import HELLO, MAZE_8, built, finished

from desim.middleware.contents import laser_scan_bytes, occupancy_grid_bytes
from desim.monitor.traffic import kind
from desim.scenario.load import load

SECONDS, ROBOTS = 5, 3


def topics(*case):
    """The counts of each topic of a run of 5 s, by name."""
    simulation = built(HELLO, f"stop.elapsed={SECONDS} s", *case)
    simulation.run()
    simulation.graph.catch_up()
    return {name: topic.counts for name, topic in simulation.graph.topics.items()}


def test_each_process_on_a_robots_machine_gets_its_scans():
    """25 Hz to 3 robots, from 0 s on; what is sent at 5 s is under way."""
    counts = topics("testbed.processes={scan: 3, odom: 2}")
    for suffix in ("", "/copy_2", "/copy_3"):
        scans = [counts[f"/robot_{k}/scan{suffix}"] for k in range(ROBOTS)]
        assert [one.delivered for one in scans] == [25 * SECONDS] * ROBOTS
        assert [one.bytes for one in scans] == [25 * SECONDS * laser_scan_bytes(180)] * ROBOTS
    assert [name for name in counts if "copy_4" in name or "cmd_vel/copy" in name] == []
    assert counts["/robot_0/odom/copy_2"].delivered == 10 * SECONDS
    assert kind("/robot_0/scan/copy_2") == "simulation"


@pytest.mark.parametrize("tf, processes, each", [
    ("own", 1, 118), ("own", 4, 4 * 118),
    ("all", 4, 4 * (118 * ROBOTS + (107 + 123 + 124) * (ROBOTS - 1)))])
def test_each_process_gets_transforms(tf, processes, each):
    """Bytes a tick of 10 Hz that a robot's machine receives of tf."""
    counts = topics(f"robot.tf={tf}", f"testbed.processes.tf={processes}")
    of_tf = sum(one.bytes for name, one in counts.items() if name.split("/copy_")[0].endswith("tf"))
    assert of_tf == 10 * SECONDS * ROBOTS * each


def test_in_the_field_processes_of_a_computer_share_it():
    counts = topics("deployment=field", "testbed.processes={scan: 3, odom: 2, tf: 4}",
                    "robot.tf=own")
    assert [name for name in counts if "copy" in name] == []


def test_copies_of_a_type_with_two_lasers():
    counts = topics("testbed.processes.scan=2", "robot.laser=null", "robot.lasers={front: {}, "
                    "rear: {rate: 10 Hz, yaw: 180 deg}}", "robot.passive=[robot_2]")
    assert counts["/robot_0/scan/copy_2"].delivered == 25 * SECONDS
    assert counts["/robot_1/rear/scan/copy_2"].delivered == 10 * SECONDS
    assert "/robot_2/scan/copy_2" not in counts


@pytest.mark.parametrize("published, cells", [("null", 120 * 120), ("[160 m, 160 m]", 800 * 800),
                                              ("[1 m, 1 m]", 120 * 120)])
def test_maps_have_the_published_size(published, cells):
    """hello is 24 m wide: 120 cells of 0.2 m, and a cell of margin on both sides."""
    counts = topics(f"robot.mapping.published_size={published}")
    explored, shared = counts["/robot_0/explored_map"], counts["/map_exchange/robot_0"]
    size_bytes = explored.bytes / explored.delivered
    assert size_bytes == shared.bytes / shared.delivered
    if published == "[160 m, 160 m]":
        assert size_bytes == occupancy_grid_bytes(cells) == 640_109
    else:
        assert size_bytes == pytest.approx(occupancy_grid_bytes(cells), rel=0.05)


def test_padding_costs_nothing_where_maps_are_compressed():
    def mean_bytes(published):
        counts = topics("coordination.exchange.encoding=zlib",
                        f"robot.mapping.published_size={published}")["/map_exchange/robot_0"]
        return counts.bytes / counts.delivered

    # deflate's best is 1030 to 1
    assert (800 * 800 - 120 * 120) / 1030 <= mean_bytes("[160 m, 160 m]") - mean_bytes("null") < 1e3


def test_robots_poll_the_master():
    """Ten times a second each of 3 robots asks, 306 B, and gets 385 B and 160 B for each of 20
    topics of each robot, with headers of TCP: 7 segments. (From the first call on: 100 ms or so,
    and the answers take no time.)"""
    simulation = built(HELLO, f"stop.elapsed={SECONDS} s", "middleware={model: ros1, polling: "
                       "100 ms, polled_topics: 20}")
    finished(simulation)
    frames = simulation.graph.context.discovery_frames["getPublishedTopics"]
    sent = simulation.graph.context.discovery_bytes["getPublishedTopics"]
    call = 306 + 70
    answer = 385 + 160 * 20 * ROBOTS + 7 * 70
    assert sent == pytest.approx(10 * SECONDS * ROBOTS * (call + answer), rel=0.05)
    assert frames / (10 * SECONDS * ROBOTS) == pytest.approx(2, rel=0.1)


def test_answers_have_the_registered_topics_by_default():
    def polled(*case):
        simulation = built(HELLO, f"stop.elapsed={SECONDS} s", "middleware.model=ros1",
                           "middleware.polling=1 s", *case)
        simulation.run()
        return (simulation.graph.context.discovery_bytes["getPublishedTopics"],
                len(simulation.graph.middleware.processes.masters[ROBOTS].registry.publishers))

    few, topics_ = polled()
    none, _ = polled("middleware.polled_topics=0")
    further = -(-(385 + 160 * topics_) // 1448) - 1  # segments
    calls = (few - none) / (160 * topics_ + 70 * further)
    assert 3 * (SECONDS - 1) <= calls <= 3 * SECONDS


def test_nobody_polls_by_default():
    simulation = built(HELLO, "stop.elapsed=1 s", "middleware.model=ros1")
    simulation.run()
    assert "getPublishedTopics" not in simulation.graph.context.discovery_bytes


def test_the_keys_are_those_that_docs_name():
    """docs/testbed-traffic.md: one line for each item."""
    scenario = load(MAZE_8, [
        "testbed.processes={scan: 3, tf: 4}", "robot.tf=own",
        "robot.mapping.published_size=[160 m, 160 m]", "robot.laser={beams: 191, rate: 30 Hz}",
        "middleware={model: ros1, polling: 100 ms, polled_topics: 20}"]).scenario
    assert scenario.testbed.processes.scan == 3
    assert scenario.robot.mapping.padding(400 * 400) == 640_000 - 160_000

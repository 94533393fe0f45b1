"""Declared traffic (``robot.publishes``): who receives how much of it when."""

import pytest
from runs import HELLO, built, finished

from desim.monitor.traffic import kind as kind_of
from desim.scenario.load import from_mapping, load
from desim.scenario.recipients import recipients
from desim.scenario.resolved import resolved
from desim.scenario.schema.robot import OWN_TOPICS, Publication
from desim.units import NS_PER_S

SECONDS, ROBOTS = 10, 3
CAMERA = "{topic: camera, size: 1446 B, rate: 5 Hz, to: robot_1, transport: datagram}"


def counts_of(topic, *case):
    """The counts of ``topic``, which is published by robots, by the name of the robot."""
    simulation = built(HELLO, f"stop.elapsed={SECONDS} s", *case)
    finished(simulation)
    return {name.split("/")[1]: about.counts for name, about in simulation.graph.topics.items()
            if name.endswith(f"/{topic}")}


def log_of(topic, *case):
    """The times (ns) of the rows sent, frame and delivered of robot_0's ``topic``."""
    rows = []
    simulation = built(HELLO, "stop.elapsed=2 s", "deployment=field", "coordination.exchange=null",
                       *case, trace_sink=lambda batch: rows.extend(batch.tolist()))
    simulation.run()
    simulation.trace.flush()
    ids = simulation.names.id
    source, about = ids("robot_0"), ids(topic)
    sent = {b for _, kind, entity, a, b, _ in rows if (kind, entity, a) == (
        ids("sent"), source, about)}
    origin = {ids("sent"): 2, ids("frame"): 2, ids("delivered"): 3}  # the column that has it
    return [(row[0], simulation.names[row[1]], simulation.names[row[2]], row[5]) for row in rows
            if row[1] in origin and row[origin[row[1]]] == source and row[4] in sent]


def test_the_whole_log_of_a_camera():
    """1446 B and their length of 4 B fit into one datagram, of 54 B of headers: 1504 B, which a
    disk at 54 Mb/s carries in 222 815 ns. The first is due after a part of 200 ms."""
    log = log_of("/robot_0/camera", f"robot.publishes=[{CAMERA}]",
                 "network.media={lan: null, air: {model: disk, rate: 54 Mb/s}}")
    first_ns = log[0][0]
    assert 0 <= first_ns < NS_PER_S // 5
    on_air_ns = -(-1504 * 8 * NS_PER_S // 54_000_000)
    assert log == [row for k in range(10) for row in (
        (first_ns + k * NS_PER_S // 5, "sent", "robot_0", 1446),
        (first_ns + k * NS_PER_S // 5, "frame", "robot_0", 1504),
        (first_ns + k * NS_PER_S // 5 + on_air_ns, "delivered", "robot_1", on_air_ns))]


def test_the_start_of_one_is_its_own():
    """Neither another publication nor the order of the list moves it."""
    other = "{topic: cloud, size: 9 kB, rate: 7 Hz, to: robot_2}"
    alone, *rest = (log_of("/robot_0/camera", f"robot.publishes=[{text}]")[0][0] for text in (
        CAMERA, f"{CAMERA}, {other}", f"{other}, {CAMERA}"))
    assert rest == [alone, alone]


@pytest.mark.parametrize("deployment, to, messages", [
    ("testbed", "null", ROBOTS),  # the workstation collects maps
    ("testbed", "[others, workstation]", ROBOTS * ROBOTS),
    ("field", "others", ROBOTS * (ROBOTS - 1)),
    ("field", "[base, base]", ROBOTS),
    ("field", "'*_?'", ROBOTS * (ROBOTS - 1)),
    ("field", "'*'", ROBOTS * ROBOTS),  # to others and the base
])
def test_bytes_are_as_by_hand(deployment, to, messages):
    counts = counts_of("camera", f"deployment={deployment}", "hosts.base={at: [0 m, 0 m]}", *(
        ["network.media.air.model=disk"] if deployment == "field" else []),
                       f"robot.publishes=[{{topic: camera, size: 1 kB, rate: 4 Hz, to: {to}}}]")
    assert len(counts) == ROBOTS
    assert sum(one.delivered for one in counts.values()) == 4 * SECONDS * messages
    assert sum(one.bytes for one in counts.values()) == 4000 * SECONDS * messages


def test_a_type_publishes_its_own():
    types = ("fleet={size: null, robots: [{type: a, count: 1}, {type: b, count: 2}], types: {"
             "a: {robot: {publishes: [{topic: camera, size: 9 kB, rate: 10 Hz, to: others}]}}, "
             "b: {robot: {laser: {beams: 90}}}}}")
    counts = counts_of("camera", types,
                       "robot.publishes=[{topic: camera, size: 1 kB, rate: 2 Hz, to: robot_0}]")
    assert {robot: one.bytes for robot, one in counts.items()} == {
        "robot_0": 2 * 10 * SECONDS * 9000, "robot_1": 2 * SECONDS * 1000,
        "robot_2": 2 * SECONDS * 1000}


def test_robots_without_software_neither_send_nor_receive():
    counts = counts_of("camera", "robot.passive=[robot_2]",
                       "robot.publishes=[{topic: camera, size: 1 kB, rate: 2 Hz, to: others}]")
    assert {robot: one.delivered for robot, one in counts.items()} == {
        "robot_0": 2 * SECONDS, "robot_1": 2 * SECONDS}


def test_a_robot_that_was_down_publishes_again():
    """It is down from 2 to 6 s, and begins its period anew."""
    counts = counts_of("camera", "faults=[{at: 2 s, host: robot_0, down_for: 4 s}]",
                       "robot.publishes=[{topic: camera, size: 1 kB, rate: 1 Hz}]")
    assert [one.delivered for one in counts.values()] == [SECONDS - 4, SECONDS, SECONDS]


def test_a_stream_that_is_too_fast_drops_what_waits_longest():
    """8 Mb/s over a link of 2 Mb/s: three quarters find their place taken, as by roscpp."""
    simulation = built(HELLO, "stop.elapsed=10 s", "deployment=field", "fleet.size=1",
                       "network.media={lan: null, air: {model: link, rate: 2 Mb/s}}",
                       "hosts.base={at: [0 m, 0 m]}",
                       "robot.publishes=[{topic: camera, size: 100 kB, rate: 10 Hz, to: base}]")
    simulation.run()
    camera = simulation.graph.topics["/robot_0/camera"].counts
    assert list(camera.dropped) == ["outbox_full"]
    # 100 kB take 0.42 s with headers: 2 Mb/s of the link are 23 messages in 10 s.
    assert camera.delivered == pytest.approx(SECONDS / 0.4197, abs=1.5)
    assert camera.delivered + camera.dropped["outbox_full"] + camera.in_flight == 10 * SECONDS


def test_what_is_declared_is_no_deed_of_the_fleet():
    """On a network with room for it."""
    def goals(*case):
        simulation = built(HELLO, "stop.elapsed=20 s", *case)
        simulation.run()
        return {entity: digest for (row, entity), digest in simulation.trace.digests().items()
                if simulation.names[row] in ("goal", "pose")}

    assert goals() == goals("robot.publishes=[{topic: camera, size: 30 kB, rate: 10 Hz}]")


def test_the_resolved_scenario_says_who_receives():
    scenario = load(HELLO, ["robot.publishes=[{topic: camera, size: 1 kB, rate: 2 Hz}]"]).scenario
    assert scenario.robot.publishes[0].to == ("workstation",)
    assert "to: [workstation]" in resolved(scenario)


def test_others_are_the_robots_beside_the_sender():
    publication = Publication(topic="camera", size="1 kB", rate="1 Hz", to="others")
    robots, hosts = ("robot_0", "robot_1"), ("base", "robot_0", "robot_1")
    assert recipients(publication, "robot_0", robots, hosts) == ("robot_1",)


def test_it_is_traffic_of_a_kind_of_its_own():
    assert kind_of("/robot_1/camera") == kind_of("/robot_1/camera/depth") == "other"


def test_topics_of_the_robots_own_are_known():
    """All topics below the names of robots, of a fleet with everything on."""
    everything = (
        "robot={tf: own, sonar: {}, bumper: true, lasers: {front: {}, rear: {yaw: 180 deg}}, "
        "exploration: {publishes_cost: true}}", "hosts.base={at: [0 m, 0 m], monitor: true}",
        "stop.elapsed=3 s", "coordination.strategy=market", "coordination.team_state={}")
    for case in ((), ("robot.laser=null", *everything), ("deployment=field", *everything)):
        simulation = built(HELLO, *case)
        simulation.run(NS_PER_S)
        own = [name.split("/", 2)[2] for name in simulation.graph.topics
               if name.startswith("/robot_")]
        assert own
        assert not [topic for topic in own if not topic.startswith("strategy/")
                    and topic.rpartition("/")[2] not in OWN_TOPICS]


def test_the_default_receivers_have_to_exist():
    with pytest.raises(Exception, match="the key 'to' is missing") as raised:
        from_mapping({"name": "x", "deployment": "field", "robot": {
            "publishes": [{"topic": "camera", "size": "1 kB", "rate": "1 Hz"}]}})
    assert "robot.publishes.0" in str(raised.value)

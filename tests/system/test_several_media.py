"""Fleets on several networks at once: topics choose, cables fail, bases forward."""

from collections import Counter

import pytest
from runs import HELLO, built, finished

from desim.errors import InputError
from desim.monitor.summary import summarize
from desim.units import NS_PER_S

MIDDLEWARES = {
    "direct": "model: direct", "ros1": "model: ros1", "rospy": "model: ros1, client: rospy",
    "multimaster": "model: multimaster, preset: fkie_1_3_groovy", "fastdds": "model: dds",
    "cyclonedds": "model: dds, preset: cyclonedds", "zenoh": "model: zenoh"}
FIELD = ("deployment=field", "coordination.exchange.period=500 ms",
         "stop={elapsed: 20 s, explored: 100 %, by: all}")


def delivered(*case):
    """(time s, sender, receiver) of each message that arrived between hosts, and the simulation."""
    rows = []
    simulation = built(HELLO, *FIELD, *case,
                       trace_sink=lambda batch: rows.extend(batch.tolist()))
    finished(simulation)
    names = simulation.names
    return [(time_ns / NS_PER_S, names[origin], names[host])
            for time_ns, kind, host, origin, _, _ in rows
            if kind == names.id("delivered")], simulation


# ------------------------------------------------------------------------------------ failover

CABLE = ("network.media={{lan: null, cable: {{model: switch, metric: 100, rules: ["
         "{{rule: outage, hosts: [robot_0], from: 5 s, until: 15 s}}]}}, "
         "air: {{model: disk, range: 200 m, metric: 600}}}}", "network.failover={failover}")


@pytest.mark.parametrize("middleware", MIDDLEWARES)
def test_every_middleware_survives_an_unplugged_cable(middleware):
    """Without failover nothing gets to or from robot_0 while its cable is out."""
    for failover in ("null", "{}"):
        arrived, simulation = delivered(
            f"middleware={{{MIDDLEWARES[middleware]}}}",
            *(text.format(failover=failover) for text in CABLE))
        out = Counter()
        for time_s, sender, receiver in arrived:
            if 5.01 <= time_s < 15.0 and "robot_0" in (sender, receiver):
                out[sender == "robot_0"] += 1
        if failover == "null":
            assert not out
        else:  # 10 s of maps, two robots, two a second, while there is anything new in them
            assert min(out[True], out[False]) >= 15
        bytes_by_air = simulation.graph.media[1].bytes_on_air
        assert (simulation.graph.media[1].name, bytes_by_air > 0) == ("air", failover != "null")


def test_partitions_end_when_the_fallback_is_known():
    """robot_0 is cut off for 10 s without failover; with it, until the others have heard."""
    def outside_s(failover):
        _, simulation = delivered(*(text.format(failover=failover) for text in CABLE))
        summary = summarize(simulation.monitor, simulation.kernel.now_ns)
        return summary["partitions"]["total_s"]

    assert outside_s("null") == pytest.approx(10, abs=1)
    assert outside_s("{}") <= 1


def test_the_metric_decides_and_not_the_name():
    def bytes_by(cable, air):
        _, simulation = delivered(
            f"network.media={{lan: null, cable: {{model: switch, metric: {cable}}}, "
            f"air: {{model: disk, range: 200 m, metric: {air}}}}}")
        return {medium.name: medium.bytes_on_air > 0 for medium in simulation.graph.media}

    assert bytes_by(100, 600) == {"cable": True, "air": False}
    assert bytes_by(600, 100) == {"air": True, "cable": False}
    assert bytes_by(0, 0) == {"air": True, "cable": False}


# ------------------------------------------------------------------------------------ forwarding

OFFICE = ("hosts={{base: {{at: [0 m, 0 m]{forwards}}}, office: {{monitor: true}}}}",
          "network.media={{lan: {{model: switch, hosts: [base, office]}}, "
          "air: {{model: disk, range: 200 m, hosts: [base, robot_0, robot_1, robot_2]}}}}")


@pytest.mark.parametrize("middleware", MIDDLEWARES)
def test_an_office_behind_the_base_hears_the_robots(middleware):
    """Maps and distances go over the air to the base, and from there over its cable. zenoh needs no
    IP forwarding: its routers pass messages on themselves."""
    for forwards in ("", ", forwards: [air, lan]"):
        arrived, simulation = delivered(
            f"middleware={{{MIDDLEWARES[middleware]}}}",
            *(text.format(forwards=forwards) for text in OFFICE))
        heard = Counter(sender for _, sender, receiver in arrived if receiver == "office")
        if forwards or middleware == "zenoh":
            assert sorted(heard) == ["robot_0", "robot_1", "robot_2"]
            assert min(heard.values()) >= 25  # two messages a second, some seconds to be found
        else:
            assert not heard
        if forwards and middleware == "direct":  # one arrival at the base for each at the office
            lan, air = sorted(simulation.graph.media, key=lambda medium: medium.name == "air")
            base = simulation.graph.host("base").index
            assert air.rx_bytes[base] == lan.tx_bytes[base] > 0


# ------------------------------------------------------------------------------------ topics


def bytes_by_medium(*case):
    simulation = built(HELLO, *FIELD, "robot.publishes=[{topic: camera, size: 1 kB, rate: 10 Hz, "
                       "to: others}]", *case)
    finished(simulation)
    return {medium.name: medium.bytes_on_air for medium in simulation.graph.media}


def test_a_topic_has_a_network_of_its_own():
    """All but the camera's frames go by lan: 10 Hz, 3 robots, 2 receivers, 1074 B for 20 s."""
    two = "network.media={air: {model: disk, range: 200 m}, lan: {model: switch}}"
    camera = 10 * 3 * 2 * 20 * 1074
    parted = bytes_by_medium(two, "topics={camera: {medium: lan}, '*': {medium: air}, "
                                 "'/*': {medium: air}}")
    assert parted["lan"] == camera
    assert bytes_by_medium(two) == {"air": parted["air"] + camera, "lan": 0}


def test_naming_the_medium_that_is_taken_anyway_changes_nothing():
    """Not even where scans are published in batches."""
    digests = {built(HELLO, "stop.elapsed=10 s", *case).run().digest
               for case in ((), ("topics={'*': {medium: lan}}",), (
                   "topics={scan: {medium: [lan]}, '/map_exchange/*': {medium: lan}}",))}
    assert len(digests) == 1


def test_two_radios_on_a_robot_do_not_disturb_each_other():
    """Three robots that send each other 1.5 MB/s on one channel of 54 Mb/s, and 0.7 MB/s of it on
    another one by a second radio. On the same channel, two radios are no better than one."""
    def lost(second, topics):
        simulation = built(
            HELLO, *FIELD, "stop.elapsed=3 s", f"topics={topics}",
            f"network.media={{lan: null, air: {{model: radio}}{second}}}",
            "robot.publishes=[{topic: left, size: 30 kB, rate: 12 Hz, to: others}, "
            "{topic: right, size: 30 kB, rate: 12 Hz, to: others}]")
        simulation.run()
        counts = [topic.counts for name, topic in simulation.graph.topics.items()
                  if name.endswith(("/left", "/right"))]
        return sum(sum(one.dropped.values()) for one in counts) / sum(
            one.intended for one in counts)

    topics = "{left: {medium: air}, right: {medium: fair}}"
    one = lost("", "{}")
    same = lost(", fair: {model: radio}", topics)
    apart = lost(", fair: {model: radio, channel: 11}", topics)
    assert apart < 0.02 < 0.2 < one
    assert same > 0.2


def test_a_pattern_without_a_topic_is_a_warning():
    simulation = built(
        HELLO, "stop.elapsed=4 s", "topics={scann: {medium: lan}, scan: {medium: lan}}",
        "network.media.lan={model: link, rules: [{rule: range, distance: 1 km}, "
        "{rule: loss, probability: 1 %, topics: [scan, /*/maps]}]}")
    simulation.run()
    from desim.advice.warnings import warnings
    known = ("/map_exchange/*, cmd_vel, costmap, distance, explored_map, goal, goal_result, map, "
             "odom, peers, pose, scan, true_pose")
    assert [text for text in warnings(simulation.monitor) if "topic" in text] == [
        "topics: no topic of the run has matched 'scann' (did you mean 'scan'?); topics were "
        f"{known}",
        "network.media.lan.rules.1.topics: no topic of the run has matched '/*/maps' (did you mean "
        f"'map'?); topics were {known}"]


def test_zenoh_has_one_link_for_all_topics():
    with pytest.raises(InputError, match="topics: zenoh carries all topics between two hosts over "
                                         "one link; none can choose its medium or mark"):
        built(HELLO, "middleware=zenoh", "topics={scan: {medium: lan}}")


# ----------------------------------------------------------------- hosts without an interface

def joining(hosts):
    """The frames by which robots have joined an access point after 6 s; ``hosts`` have a radio."""
    simulation = built(
        HELLO, "deployment=field", "fleet.size=3", "stop.elapsed=6 s",
        "network.media={lan: null, cable: {model: switch}, air: {model: radio, "
        f"hosts: {hosts}, access_points: [{{at: [-8 m, 6 m]}}], "
        "infrastructure: {associated: false, constants: {beacon_frame: null}}}}")
    finished(simulation)
    (air,) = (medium for medium in simulation.graph.media if medium.name == "air")
    return air.model.control()[0]


def test_who_has_no_radio_does_not_join():
    """Each robot scans for 4.2 s and sends and gets eight frames; ``null`` is the twin."""
    assert joining("[robot_0, robot_2]") == 16
    assert joining("null") == 24

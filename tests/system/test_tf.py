"""tf, cost and gain as traffic: sizes and rates by hand."""

import pytest
from runs import HELLO, built, finished

from desim.middleware.contents import (
    BASE_FRAME_BYTES,
    LASER_FRAME_BYTES,
    MAP_FRAME_BYTES,
    ODOM_FRAME_BYTES,
    tf_message_bytes,
)
from desim.monitor.traffic import kind
from desim.robot.transform_broadcaster import ODOMETRY_BYTES, ROBOT_BYTES

SECONDS, ROBOTS = 10, 3


def test_sizes_are_those_of_the_message_definition():
    """tf/tfMessage: a count of 4 B; of its transform the header (sequence number 4, stamp 8, frame
    id 4 + L), the child frame id 4 + C, a translation of 3 and a rotation of 4 doubles."""
    by_hand = 4 + 4 + 8 + 4 + 4 + 7 * 8
    assert tf_message_bytes(0, 0) == by_hand == 80
    # With the frames of the paper's robots; computed from the definitions elsewhere, too.
    assert (ODOMETRY_BYTES, *ROBOT_BYTES) == (118, 107, 123, 124)
    assert (MAP_FRAME_BYTES, ODOM_FRAME_BYTES, BASE_FRAME_BYTES, LASER_FRAME_BYTES) == (
        13, 14, 24, 25)


def tf_counts(*case):
    """Messages and bytes of tf that arrived over the network, and the hosts' received bytes."""
    simulation = built(HELLO, f"stop.elapsed={SECONDS} s", "middleware=direct", *case)
    simulation.run()
    topics = [topic.counts for name, topic in simulation.graph.topics.items()
              if name.endswith("tf")]
    return sum(one.delivered for one in topics), sum(one.bytes for one in topics)


@pytest.mark.parametrize("deployment, audience, per_tick, of_odometry", [
    # From the workstation to each robot its own; the robot's are on the spot.
    ("testbed", "own", 0, ROBOTS * 1),
    # From the workstation all to all; and each robot's three to all others.
    ("testbed", "all", ROBOTS * (ROBOTS - 1), ROBOTS * ROBOTS),
    ("field", "own", 0, 0),
    ("field", "all", ROBOTS * (ROBOTS - 1), ROBOTS * (ROBOTS - 1)),
])
def test_bytes_over_the_network_are_as_by_hand(deployment, audience, per_tick, of_odometry):
    delivered, size_bytes = tf_counts(f"deployment={deployment}", f"robot.tf={audience}")
    # Odometry is read from 0 s on, the last time at 10 s; what is sent then is still under way.
    odometry = 10 * SECONDS * of_odometry
    software = 10 * SECONDS * per_tick
    assert delivered == odometry + 3 * software
    assert size_bytes == 118 * odometry + (107 + 123 + 124) * software


def test_the_page_has_the_load_of_thirty_robots():
    robots = 30
    each_bps = 10 * 118 * robots + 10 * (107 + 123 + 124) * (robots - 1)
    assert (round(each_bps / 1e3), round(robots * each_bps / 1e6, 1)) == (138, 4.1)
    # TCPROS 4 B, TCP with timestamps 32 B, IP 20 B, Ethernet 18 B.
    headers = each_bps / (472 / 4) * (4 + 32 + 20 + 18)
    assert headers / each_bps == pytest.approx(0.63, abs=0.01)


def test_without_tf_there_is_no_topic_of_it():
    simulation = built(HELLO, "stop.elapsed=1 s")
    finished(simulation)
    assert not [name for name in simulation.graph.topics if "tf" in name]


@pytest.mark.parametrize("topic, of", [("/tf", "coordination"), ("/robot_1/tf", "simulation"),
                                       ("/robot_1/cost", "monitoring")])
def test_kinds_of_this_traffic(topic, of):
    assert kind(topic) == of


def test_transforms_change_no_deed_of_a_fleet():
    """On a network with room for them."""
    def goals(*case):
        simulation = built(HELLO, "stop.elapsed=20 s", *case)
        simulation.run()
        return {entity: digest for (row, entity), digest in simulation.trace.digests().items()
                if simulation.names[row] in ("goal", "pose")}

    assert goals() == goals("robot.tf=own") == goals("robot.exploration.publishes_cost=true")


def test_cost_and_gain_go_to_the_monitor():
    simulation = built(HELLO, f"stop.elapsed={SECONDS} s",
                       "robot.exploration.publishes_cost=true")
    simulation.run()
    counts = [simulation.graph.topics[f"/robot_{k}/{name}"].counts
              for k in range(ROBOTS) for name in ("cost", "gain")]
    assert all(one.bytes == 8 * one.delivered for one in counts)
    # Once a second while there is a goal, which there is but for the first second.
    assert all(SECONDS - 2 <= one.delivered <= SECONDS for one in counts)

"""The news of robots with pose graphs: all of it arrives, whatever is lost."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim.ports import Pose2D
from desim.ports.sharing import SharedMessage
from desim.robot.localization.graph_exchange import GraphExchange
from desim.robot.localization.graph_news import GraphNode
from desim.robot.localization.kinds.pose_graph import GraphSlam
from desim.robot.slam.fleet_graph import Closure, FleetGraph
from desim.testing.localization_bench import LocalizationBench
from desim.testing.localization_checks import BenchScan, scan_of

STEP = np.array((1.0, 0.0, 0.1))


class Robot:
    """A context that has an exchange, and nothing else."""

    def __init__(self, name):
        self.name, self.now_ns, self.said = name, 0, []
        self.fleet = FleetGraph()
        self.exchange = GraphExchange(self.fleet)
        self.exchange.start(self)

    def listen(self, callback):
        self.callback = callback

    def publish(self, content):
        self.said.append(content)

    def drives(self):
        own = len(self.exchange.nodes)
        node = GraphNode(own, STEP, np.eye(3), None)
        self.exchange.nodes.append(node)
        self.fleet.add(self.name, *node)

    def says(self, other, lost=False):
        said, self.said = self.said, []
        for content in said:
            assert content.size_bytes > 0
            if not lost:
                other.callback(other, SharedMessage(self.name, content, 0))


@given(st.lists(st.booleans(), max_size=30))
def test_nodes_and_ties_that_were_lost_come_again(losses):
    one, two = Robot("one"), Robot("two")
    for k, lost in enumerate([*losses, False, False, False]):
        one.drives()
        if k % 3 == 2:
            one.exchange.tie(one, Closure(k, "one", k - 2, 2.0 * STEP, np.eye(3)))
        one.exchange.send(one)
        one.says(two, lost)
        two.says(one)
    one.exchange.send(one)
    one.says(two)
    assert two.fleet.path("one") == pytest.approx(one.fleet.path("one"))
    assert len(two.fleet.graph.residuals()) == len(one.fleet.graph.residuals())


def test_a_tie_waits_for_the_nodes_that_it_is_about():
    one, two, three = Robot("one"), Robot("two"), Robot("three")
    one.drives()
    one.exchange.send(one)
    one.says(two)
    two.drives()
    two.exchange.tie(two, Closure(0, "one", 0, STEP, np.eye(3)))
    two.exchange.send(two)
    two.says(three)
    assert len(three.fleet.graph.residuals()) == 0  # it has not heard of one yet
    one.drives()
    one.exchange.send(one)
    one.says(three)
    three.says(one)  # it asks for what it has missed
    one.exchange.send(one)
    one.says(three)
    assert len(three.fleet.graph.residuals()) == 2  # one's step, and the tie


@pytest.mark.parametrize("team, beams", [("sightings", 0), ("scans", 181), ("all", 181)])
def test_what_goes_to_the_team_is_what_is_wanted(team, beams):
    bench = LocalizationBench(GraphSlam(GraphSlam.Params(team=team)), Pose2D(2.0, 2.0, 0.0))
    for k in range(30):
        at = Pose2D(2.0 + 0.1 * k, 2.0, 0.0)
        bench.read((k + 1) * 10**8, at, BenchScan(at, scan_of(np.array(at))))
    news, = {type(content): content for content in bench.published}.values()
    assert all((0 if node.scan is None else len(node.scan)) == beams for node in news.nodes)


def test_a_robot_that_does_not_know_where_it_began_tells_nothing():
    bench = LocalizationBench(GraphSlam(GraphSlam.Params()), None)
    at = Pose2D(2.0, 2.0, 0.0)
    for k in range(30):
        bench.read((k + 1) * 10**8, at, BenchScan(at, scan_of(np.array(at))))
    assert bench.published == []

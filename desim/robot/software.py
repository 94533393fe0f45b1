"""What runs on a robot's computer (the paper's Figure 5)."""

from __future__ import annotations

from desim import plugins
from desim.errors import below
from desim.middleware.graph import Host, Node
from desim.robot.exploration import Explore
from desim.robot.localization import GroundTruth, OdometryLocalization
from desim.robot.map_sharing import MapSharing
from desim.robot.mapping import Mapping
from desim.robot.monitor_feed import MonitorFeed
from desim.robot.navigation.move_base import MoveBase
from desim.robot.tiles import Belief
from desim.scenario.schema.fleet import BodyType
from desim.scenario.schema.whole import Scenario

LOCALIZATION = {"ground_truth": GroundTruth, "odometry": OdometryLocalization}


def robot_software(host: Host, scenario: Scenario, body: BodyType, belief: Belief,
                   peers: tuple[str, ...], monitored: bool) -> list[Node]:
    """The nodes of one robot, in the order in which they start. ``peers`` are the names of the
    other robots that carry software; ``monitored``: some host collects maps and distances."""
    robot, coordination = scenario.robot, scenario.coordination
    with below("coordination"):
        strategy_class = plugins.load("strategy", coordination.strategy)
        strategy = strategy_class(strategy_class.Params(**coordination.parameters()))
    nodes = [
        LOCALIZATION[robot.localization](host),
        Mapping(host, robot.mapping, belief),
        MapSharing(host, coordination.exchange, belief, peers),
        MoveBase(host, robot.navigation, body, robot.laser),
        Explore(host, robot.exploration, strategy, robot.navigation, body),
    ]
    if monitored:
        nodes.append(MonitorFeed(host, belief, scenario.testbed.monitor_period_ns))
    return nodes

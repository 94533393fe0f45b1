"""The list of a robot's nodes (the paper's Figure 5)."""

from __future__ import annotations

from desim import plugins
from desim.errors import below
from desim.middleware.host import Host
from desim.middleware.node import Node
from desim.ports import Peer
from desim.robot.exploration import Explore
from desim.robot.localization import GroundTruth, OdometryLocalization
from desim.robot.map_sharing import MapSharing
from desim.robot.mapping import Mapping
from desim.robot.monitor_feed import MonitorFeed
from desim.robot.navigation.global_costmap import GlobalCostmap
from desim.robot.navigation.move_base import MoveBase
from desim.robot.robot_map import RobotMap
from desim.scenario.schema.fleet import BodyType
from desim.scenario.schema.whole import Scenario

LOCALIZATION = {"ground_truth": GroundTruth, "odometry": OdometryLocalization}


def robot_software(host: Host, scenario: Scenario, body: BodyType, robot_map: RobotMap,
                   peers: tuple[str, ...], monitored: bool) -> list[Node]:
    """The nodes of one robot, in the order in which they start. ``peers`` are the names of the
    other robots that carry software; ``monitored``: some host collects maps and distances.

    Nodes of one robot share live objects, as nodelets do: the map, the costmap and the poses of
    peers. They are given to them here. A message of the topics ``map``, ``costmap`` and ``peers``
    says that the object of that name has changed or can be used, and carries nothing.
    """
    robot, coordination = scenario.robot, scenario.coordination
    costmap = GlobalCostmap(robot_map, body.radius_m, robot.navigation.inflation_radius_m,
                            robot.navigation.inflation_scaling)
    heard: dict[str, Peer] = {}
    with below("coordination"):
        strategy = plugins.load("strategy", coordination.strategy)(coordination.params)
    nodes = [
        LOCALIZATION[robot.localization](host),
        Mapping(host, robot.mapping, robot_map),
        MapSharing(host, coordination.exchange, robot_map, peers, heard),
        MoveBase(host, robot.navigation, body, robot.scanner, costmap),
        Explore(host, robot.exploration, strategy, robot.navigation, body, costmap, heard),
    ]
    if monitored:
        nodes.append(MonitorFeed(host, robot_map, scenario.testbed.monitor_period_ns))
    return nodes

"""The list of a robot's nodes (the paper's Figure 5)."""

from __future__ import annotations

from desim import plugins
from desim.errors import below
from desim.middleware.host import Host
from desim.middleware.node import Node
from desim.ports import Peer
from desim.robot import exploration, localization, map_sharing, mapping, monitor_feed
from desim.robot.navigation import global_costmap, move_base
from desim.robot.robot_map import RobotMap
from desim.scenario.schema.fleet import BodyType
from desim.scenario.schema.scenario import Scenario


def robot_software(host: Host, scenario: Scenario, body: BodyType, robot_map: RobotMap,
                   peers: tuple[str, ...], monitored: bool) -> list[Node]:
    """The nodes of one robot, in the order in which they start. ``peers`` are the names of the
    other robots that carry software; ``monitored``: some host collects maps and distances.

    Nodes of one robot share live objects, as nodelets do: the map, the costmap and the poses of
    peers. They are given to them here. A message of the topics ``map``, ``costmap`` and ``peers``
    says that the object of that name has changed or can be used, and carries nothing.
    """
    robot, coordination = scenario.robot, scenario.coordination
    costmap = global_costmap.GlobalCostmap(
        robot_map, body.radius_m, robot.navigation.inflation_radius_m,
        robot.navigation.inflation_scaling)
    heard: dict[str, Peer] = {}
    with below("coordination"):
        strategy = plugins.load("strategy", coordination.strategy)(coordination.params)
    nodes = [
        localization.Localization(host, localization.SOURCES[robot.localization]),
        mapping.Mapping(host, robot.mapping, robot_map),
        map_sharing.MapSharing(host, coordination.exchange, robot_map, peers, heard),
        move_base.MoveBase(host, robot.navigation, body, robot.scanner, costmap),
        exploration.Explore(host, robot.exploration, strategy, robot.navigation, body, costmap,
                            heard),
    ]
    if monitored:
        nodes.append(monitor_feed.MonitorFeed(host, robot_map, scenario.testbed.monitor_period_ns))
    return nodes

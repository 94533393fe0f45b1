"""The list of a host's nodes: a robot's (the paper's Figure 5), or a central coordinator's."""

from __future__ import annotations

from collections.abc import Callable

from desim import plugins
from desim.errors import below
from desim.middleware.host import Host
from desim.middleware.node import Node
from desim.ports import Pose2D, Strategy
from desim.ports.local_planners import LocalPlanner, LocalPlannerTraits
from desim.ports.localization import Localization
from desim.ports.sharing import Sharing
from desim.robot import monitor_feed, transform_broadcaster
from desim.robot.coordination.coordinate import Coordinate
from desim.robot.coordination.explore import Explore
from desim.robot.coordination.task_link import TaskLink
from desim.robot.localization.node import LocalizationNode
from desim.robot.localization.pose_publisher import CorrectionNode, PosePublisher
from desim.robot.localization.remote_slam import RemoteSlam
from desim.robot.localization.sensor_pose import SENSORS, SensorPose
from desim.robot.mapping.map_receiver import MapReceiver
from desim.robot.mapping.node import Mapping
from desim.robot.mapping.robot_map import RobotMap
from desim.robot.navigation.global_costmap import GlobalCostmap
from desim.robot.navigation.map_queries import MapQueries
from desim.robot.navigation.move_base import MoveBase
from desim.robot.navigation.moving_bodies import MovingBodies
from desim.robot.sharing.node import MapSharing, own_map_for
from desim.robot.team import Team
from desim.robot.team_state import TeamStateNode
from desim.scenario.schema.communication import Exchange, StrategyChoice
from desim.scenario.schema.fleet import BodyType
from desim.scenario.schema.robot import Equipment
from desim.scenario.schema.scenario import Scenario

Pilot = Callable[[str, Strategy], Strategy]


def robot_software(host: Host, scenario: Scenario, robot: Equipment, choice: StrategyChoice,
                   body: BodyType, robot_map: RobotMap, peers: tuple[str, ...], team: Team,
                   start: Pose2D | None, monitored: bool, link: TaskLink,
                   pilot: Pilot | None = None) -> list[Node]:
    """The nodes of one ``robot``, which runs the strategy of ``choice``, in the order in which they
    start. ``peers`` are the names of the other robots that carry software; ``start``: the robot's
    pose where it is known; ``monitored``: some host collects maps and distances; ``link``: to the
    task; ``pilot`` as ``Simulation`` takes it.

    Nodes of one robot share objects, as nodelets do: the map, the costmap and the poses of peers.
    This function hands the objects to the nodes. An empty message on the topic ``map``, ``costmap``
    or ``peers`` announces that the object of this name has changed or can be used.
    """
    coordination = scenario.coordination
    queries = _queries(robot, robot_map, body.inscribed_radius_m)
    with below("coordination"):
        strategy = _strategy(choice)
    if pilot is not None:
        strategy = pilot(host.name, strategy)
    sharing = _sharing(coordination.exchange)
    own_map = own_map_for(robot_map, sharing)
    map_sharing = MapSharing(host, sharing, robot_map, peers, team, own_map)
    nodes: list[Node] = [
        *_localization(host, robot, own_map, start, _bodies_m(scenario, peers),
                       *((peers, ()) if team.common_frame else ((), peers))),
        map_sharing,
        _move_base(host, robot, body, queries.costmap, team,
                   0.5 * _bodies_m(scenario, peers) or body.radius_m),
        Explore(host, robot.exploration, strategy, robot.navigation, body, queries, team,
                next(iter(robot.lasers_by_topic)), map_sharing.share, link),
    ]
    if coordination.team_state is not None:
        nodes.append(TeamStateNode(host, coordination.team_state, team, peers, has_body=True))
    if scenario.robot.tf != "none":
        nodes.append(transform_broadcaster.TransformBroadcaster(
            host, "tf", transform_broadcaster.of_software(
                host.name, scenario.robot.tf, len(robot.lasers_by_topic)),
            transform_broadcaster.topic_of(host.name, scenario.robot.tf),
            scenario.tf_processes))
    if monitored:
        nodes.append(monitor_feed.MonitorFeed(host, robot_map, scenario.testbed.monitor_period_ns))
    return nodes


def coordinator_software(host: Host, scenario: Scenario, choice: StrategyChoice,
                         robot_map: RobotMap, robots: tuple[str, ...], team: Team,
                         link: TaskLink) -> list[Node]:
    """The nodes of a host without a body that runs a strategy. It plans for the widest robot of the
    fleet."""
    queries = _queries(scenario.robot, robot_map, max(
        body.inscribed_radius_m for body in scenario.fleet.types.values()))
    with below(f"hosts.{host.name}.strategy"):
        strategy = _strategy(choice)
    nodes: list[Node] = [
        MapSharing(host, _sharing(scenario.coordination.exchange), robot_map, robots, team,
                   robot_map),
        Coordinate(host, scenario.robot.exploration.rate_hz, strategy, queries, team, link),
    ]
    if scenario.coordination.team_state is not None:
        nodes.append(TeamStateNode(host, scenario.coordination.team_state, team, robots,
                                   has_body=False))
    return nodes


def remote_slam(host: Host, scenario: Scenario, name: str, robot: Equipment, robot_map: RobotMap,
                peers: tuple[str, ...], start: Pose2D | None, team: tuple[str, ...]) -> Node:
    """The node of SLAM for the robot ``name``, on another host than its own. Arguments as those of
    ``robot_software``; ``robot_map`` is not the robot's."""
    return RemoteSlam(host, name, _new_localization(robot), robot, robot_map, start,
                      _bodies_m(scenario, peers), team)


def _localization(host: Host, robot: Equipment, robot_map: RobotMap, start: Pose2D | None,
                  bodies_m: float, team: tuple[str, ...], strangers: tuple[str, ...]
                  ) -> list[Node]:
    """The nodes that make poses and the robot's own map of the readings of sensors, or take both
    from the host that does."""
    if robot.localization.host not in (None, host.name):
        return [PosePublisher(host), MapReceiver(host, robot_map)]
    localization = _new_localization(robot)
    source = SENSORS.get(type(localization))
    if source is not None:
        nodes: list[Node] = [SensorPose(host, source)]
    else:
        ideal = host.computer is None
        node = (LocalizationNode if ideal else CorrectionNode)(
            host, localization, robot, robot_map, start, bodies_m, team, strangers)
        nodes = [node] if ideal else [node, PosePublisher(host)]
        if node.draws_map:
            return nodes
    return [*nodes, *(Mapping(host, robot.mapping, robot_map, topic)
                    for topic in robot.lasers_by_topic)]


def _new_localization(robot: Equipment) -> Localization:
    choice = robot.localization
    with below("robot.localization"):
        return plugins.load("localization", choice.model)(choice.params)


def _move_base(host: Host, robot: Equipment, body: BodyType, costmap: GlobalCostmap, team: Team,
               others_m: float) -> Node:
    """The node that drives. ``others_m``: the radius of the widest teammate."""
    choice = robot.navigation.local
    with below("robot.navigation.local"):
        steering: LocalPlanner = plugins.load("local_planner", choice.model)(choice.params)
    follows = LocalPlannerTraits.of(steering).follows_neighbours
    return MoveBase(host, robot, body, costmap, steering,
                    MovingBodies(team, costmap, others_m) if follows else None)


def _bodies_m(scenario: Scenario, peers: tuple[str, ...]) -> float:
    """The width of the widest teammate, 0 without one."""
    widest_m = max(kind.radius_m for kind in scenario.fleet.types.values())
    return 2.0 * widest_m if peers else 0.0


def _strategy(choice: StrategyChoice) -> Strategy:
    return plugins.load("strategy", choice.strategy)(choice.params)


def _sharing(choice: Exchange | None) -> Sharing | None:
    return None if choice is None else plugins.load("sharing", choice.model)(choice.params)


def _queries(robot: Equipment, robot_map: RobotMap, radius_m: float) -> MapQueries:
    costmap = GlobalCostmap(robot_map, radius_m, robot.navigation.inflation_radius_m,
                                       robot.navigation.inflation_scaling)
    return MapQueries(costmap, robot.exploration, robot.navigation.goal_tolerance_m,
                      min(robot.mapping.usable_range_m, robot.first_laser.max_range_m))

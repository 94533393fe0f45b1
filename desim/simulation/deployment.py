"""The deployment of a scenario: which computers there are, where, and what runs on each.

``testbed``: simulator and monitor on a workstation, each robot's controller in a virtual machine on
a cluster node, everything on one LAN. ``field``: one computer on each robot, over the air.
"""

from __future__ import annotations

from math import nan
from typing import NamedTuple

from desim.errors import InputError
from desim.ports import natural_key
from desim.ports.antenna import Antenna
from desim.scenario.cluster_nodes import cluster_nodes
from desim.scenario.names import WORKSTATION, robot_names
from desim.scenario.robot_types import equipment_of, types_of
from desim.scenario.schema.clock import ClockParams
from desim.scenario.schema.communication import StrategyChoice
from desim.scenario.schema.computer import ComputerParams
from desim.scenario.schema.scenario import Scenario


class HostPlan(NamedTuple):
    """One computer.

    ``robot``: index of the body whose place it shares, or None; then it stands at ``x_m, y_m``
    (NaN: without a place). ``drives``: indices of the bodies whose sensors and motors are attached
    to it. ``software``: index of the robot that it controls. ``monitor``: whether robots send it
    their maps and distances. ``strategy``: of a central coordinator.
    ``antenna``: with its height above the ground. ``computer``: a robot's own, or its virtual
    machine, which is on ``node`` of the cluster. ``clock``: None where it shows the true time.
    ``slam``: indices of the other robots whose SLAM runs here.
    """

    name: str
    robot: int | None
    x_m: float
    y_m: float
    drives: tuple[int, ...]
    software: int | None
    monitor: bool
    strategy: StrategyChoice | None = None
    antenna: Antenna = Antenna()
    computer: ComputerParams = ComputerParams()
    clock: ClockParams | None = None
    node: str | None = None
    slam: tuple[int, ...] = ()

    @property
    def passive(self) -> bool:
        """Whether it is that of a robot without software."""
        return self.robot is not None and self.software is None


def plan(scenario: Scenario) -> list[HostPlan]:
    """The hosts of a scenario in natural order of their names. Raises ``InputError`` for a robot
    that cannot reach the host of its SLAM."""
    testbed = scenario.deployment == "testbed"
    robots = robot_names(scenario)
    passive = frozenset(scenario.robot.passive)
    equipment = equipment_of(scenario)
    antennas = [own.antenna.model_copy(update={
        "height_m": own.antenna.height_m + body.altitude_m})
        for own, body in zip(equipment, types_of(scenario.fleet), strict=True)]
    nodes = {robot: node for node, robots in cluster_nodes(scenario).items() for robot in robots
             } if testbed else {}
    hosts = [HostPlan(name, i, nan, nan, () if testbed else (i,),
                      None if name in passive else i, False, antenna=antennas[i],
                     computer=equipment[i].computer, clock=equipment[i].clock,
                     node=nodes.get(name))
             for i, name in enumerate(robots)]
    if testbed:
        hosts.append(HostPlan(WORKSTATION, None, nan, nan, tuple(range(len(robots))), None, True,
                              computer=scenario.testbed.computer,
                              clock=scenario.testbed.clock))
    for name, stationary in scenario.hosts.items():
        x_m, y_m = stationary.at_m or (nan, nan)
        hosts.append(HostPlan(name, None, x_m, y_m, (), None, stationary.monitor,
                              stationary.strategy, stationary.antenna, stationary.computer,
                              stationary.clock))
    slam = _slam_elsewhere(scenario, [(host.name, host.software) for host in hosts])
    return [host._replace(slam=tuple(slam.get(host.name, ())))
            for host in sorted(hosts, key=lambda host: natural_key(host.name))]


def _slam_elsewhere(scenario: Scenario, hosts: list[tuple[str, int | None]]
                    ) -> dict[str, list[int]]:
    """The robots whose SLAM runs on another host, by that host."""
    equipment, found = equipment_of(scenario), dict[str, list[int]]()
    forwarded = any(host.forwards for host in scenario.hosts.values())
    for name, robot in hosts:
        if robot is None:
            continue
        elsewhere = equipment[robot].localization.host
        if elsewhere in (None, name):
            continue
        attached = [medium.hosts for medium in scenario.network.media.values()
                    if not medium.inside]
        if not forwarded and not any(own is None or {name, elsewhere} <= {*own}
                                     for own in attached):
            raise InputError(f"robot.localization.host: {name} and {elsewhere} have no medium in "
                             "common (network.media.*.hosts), and no host forwards")
        found.setdefault(elsewhere, []).append(robot)
    return found

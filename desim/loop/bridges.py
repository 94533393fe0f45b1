"""The bridges: programs by which a robot of desim speaks to those of ROS."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from desim.errors import InputError
from desim.scenario.names import robot_names
from desim.scenario.schema.scenario import Scenario


class Bridge(NamedTuple):
    """A program for ``python``, a file of this package, that needs ``module``; ``remedy``: how to
    get that."""

    name: str
    python: str
    module: str
    remedy: str

    def command(self, robot: str) -> Sequence[str]:
        """The command that starts the bridge of ``robot``."""
        return [self.python, str(Path(__file__).with_name(f"{self.name}.py")), robot]

    def log(self, robot: str) -> str:
        """The file's name of what the bridge of ``robot`` says."""
        return f"{robot}.{self.name}.log"


ROS1 = Bridge("ros1_bridge", "/usr/bin/python3", "rospy",  # as on Debian and Ubuntu
              "apt-get install python3-rospy python3-sensor-msgs python3-nav-msgs "
              "python3-tf2-msgs")
ROS2 = Bridge("ros2_bridge", sys.executable, "cyclonedds", "pip install 'desim[loop]'")


def bridges_of(scenario: Scenario) -> tuple[Bridge, ...]:
    """The bridges that each robot with programs has."""
    loop = scenario.loop
    return (*([] if loop.ros_master is None else [ROS1]),
            *([] if loop.dds_domain is None else [ROS2]))


def refuse_without_bridges(scenario: Scenario) -> None:
    """Raise ``InputError`` where a robot of ``scenario`` with programs has a bridge that cannot run
    here."""
    if scenario.loop.hosts.isdisjoint(robot_names(scenario)):
        return
    for bridge in bridges_of(scenario):
        found = subprocess.run([bridge.python, "-c", f"import {bridge.module}"],
                               capture_output=True, check=False)
        if found.returncode:
            key = "ros_master" if bridge is ROS1 else "dds_domain"
            raise InputError(f"loop.{key}: the robots' topics need {bridge.module} for "
                             f"{bridge.python}: {bridge.remedy}")

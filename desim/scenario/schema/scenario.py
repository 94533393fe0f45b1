"""The schema of a whole scenario; each section has a file of its own beside this one."""

from __future__ import annotations

import zlib
from typing import Annotated, Literal

from pydantic import Field

from desim.ports import Params
from desim.scenario.interrupts import interruptible
from desim.scenario.schema.clock import ClockParams
from desim.scenario.schema.communication import (
    Coordination,
    Fault,
    MiddlewareChoice,
    Name,
    Network,
    StationaryHost,
    TopicChoice,
)
from desim.scenario.schema.computer import WorkstationComputer
from desim.scenario.schema.cost_model import ComputersChoice
from desim.scenario.schema.environment import Environment
from desim.scenario.schema.experiment import Measure, Stop, TaskChoice, TraceParams
from desim.scenario.schema.fleet import FleetParams
from desim.scenario.schema.loop import Loop
from desim.scenario.schema.robot import Robot
from desim.units import Frequency, Pace

Pattern = Annotated[str, Field(pattern=r"^/?[A-Za-z0-9_*?]+(/[A-Za-z0-9_*?]+)*$")]


class SubscribingProcesses(Params):
    """The processes on a robot's machine that subscribe to topics of the simulator. In ROS 1 each
    has a connection of its own, and gets each message."""

    scan: int = Field(1, ge=1, le=20, description="of each laser (the published launch file has 3: "
                                               "slam_gmapping, move_base, explore)")
    odom: int = Field(1, ge=1, le=20, description="(1: move_base)")
    tf: int = Field(1, ge=1, le=20, description=(
        "where robot.tf is not none (4: slam_gmapping, move_base, explore, robot_pose_publisher)"))


class Testbed(Params):
    """The paper's cluster: simulator and monitor on a workstation, controllers in virtual machines
    on cluster nodes."""

    __test__ = False

    robots_per_node: int = Field(4, ge=1, description=(
        "virtual machines that share a node's network port and its processors (the paper)"))
    processors_per_node: int = Field(8, ge=1, le=1024, description=(
        "physical processors, which the virtual ones of robot.computer share (published scripts: "
        "ppn=8)"))
    computer: WorkstationComputer = Field(default_factory=WorkstationComputer,
                                          description="the workstation")
    clock: ClockParams | None = Field(None, description=(
        "of the workstation, which stamps what sensors see (null: it shows the true time)"))
    monitor_period_ns: Pace = Field("1 s", description="each robot's map and distance to the "
                                                        "monitor (the published code)")
    processes: SubscribingProcesses = Field(default_factory=SubscribingProcesses)


class Physics(Params):
    """The world's own clock."""

    model: str = Field("plane", description="a world plug-in")
    rate_hz: Frequency = Field("60 Hz", description="base tick (MORSE, the paper)")


class Scenario(Params):
    """One run, fully described."""

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,99}$", description=(
        "of the run; its results are in results/<name>/<run id>"))
    seed: int = Field(0, ge=0, le=2**63 - 1, description="of all random numbers")
    deployment: Literal["testbed", "field"] = Field("testbed", description=(
        "testbed: the paper's cluster, everything over one LAN; field: a computer on each robot, "
        "radio between them"))
    testbed: Testbed = Field(default_factory=Testbed)
    physics: Physics = Field(default_factory=Physics)
    environment: Environment = Field(default_factory=Environment)
    fleet: FleetParams = Field(default_factory=FleetParams)
    robot: Robot = Field(default_factory=Robot)
    hosts: dict[Name, StationaryHost] = Field({}, description="computers without a body, by name")
    network: Network = Field(default_factory=Network)
    topics: dict[Pattern, TopicChoice] = Field({}, description=(
        "networks of topics, by patterns with * and ?, which stand for slashes, too: scan is that "
        "of every host, /map_exchange/* is absolute; the first that matches counts"))
    middleware: MiddlewareChoice = Field(default_factory=MiddlewareChoice)
    computers: ComputersChoice = Field(default_factory=ComputersChoice)
    coordination: Coordination = Field(default_factory=Coordination)
    task: TaskChoice = Field(default_factory=TaskChoice)
    faults: tuple[Fault, ...] = ()
    loop: Loop = Field(default_factory=Loop)
    stop: Stop = Field(default_factory=Stop)
    measure: Measure = Field(default_factory=Measure)
    trace: TraceParams = Field(default_factory=TraceParams)

    @property
    def tf_processes(self) -> int:
        """The processes of a host that listen to tf over the network."""
        return self.testbed.processes.tf if self.deployment == "testbed" else 1

    def __hash__(self) -> int:
        # Mappings have no hash of their own, and Python's hash of text differs between processes.
        with interruptible():
            return zlib.crc32(self.model_dump_json(by_alias=True).encode())

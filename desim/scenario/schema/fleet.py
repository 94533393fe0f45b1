"""The fleet family: how many robots, of which types, starting where."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field

from desim.ports import Params
from desim.scenario.schema.communication import Name, StrategyChoice
from desim.scenario.schema.footprint import Corner, anticlockwise, radii_m
from desim.scenario.schema.robot import Equipment
from desim.scenario.schema.shapes import BY_SHAPE
from desim.units import (
    Acceleration,
    Angle,
    AngularAcceleration,
    AngularSpeed,
    Duration,
    Length,
    Position,
    Speed,
)

MAX_ROBOTS = 1000  # some thirty times the paper's largest fleet
MAX_CORNERS = 100  # of a footprint: far more than one that is measured has


class BodyType(Params):
    """A kind of robot body."""

    drive: Literal["differential", "holonomic", "aerial"] = Field("differential", description=(
        "aerial: holonomic, and above the ground"))
    altitude_m: Length = Field("0 m", description=(
        "of the underside of an aerial body, above 0: it flies over walls that are not higher, and "
        "carries laser and antenna so much higher; 0 of all others"))
    radius_m: Length = Field("0.26 m", gt=0, description=(
        "circle around the footprint, which a footprint gives by itself (Pioneer 3-DX: around the "
        "footprint in the launch files of the paper's testbed)"))
    footprint: tuple[tuple[Position, Position], ...] | None = Field(
        None, min_length=3, max_length=MAX_CORNERS, description=(
            "the outline of the body, a convex polygon: x ahead and y to the left of the point "
            "around which it turns, of each corner (null: a disc of the radius)"))
    height_m: Length = Field("0.24 m", gt=0, description="(Pioneer 3-DX data sheet: 23.7 cm)")
    clearance_m: Length = Field("0 m", description=(
        "between the ground and the body: it drives over walls that are not higher (0: over none)"))
    max_speed_mps: Speed = Field("1.2 m/s", gt=0,
                                 description="(the paper; Pioneer 3-DX data sheet)")
    max_turn_radps: AngularSpeed = Field("5.24 rad/s", gt=0, description="(the paper; 300 deg/s)")
    acceleration_mps2: Acceleration = Field("2.5 m/s^2",
                                            description="(TrajectoryPlannerROS acc_lim_x)")
    turn_acceleration_radps2: AngularAcceleration = Field(
        "3.2 rad/s^2", description="(TrajectoryPlannerROS acc_lim_theta)")
    command_timeout_ns: Duration = Field("0.5 s", description=(
        "the base stops when no command came for so long (diff_drive_controller cmd_vel_timeout)"))

    @property
    def passes_m(self) -> float:
        """The height of the highest walls that it gets over."""
        return max(self.altitude_m, self.clearance_m)

    @property
    def corners_m(self) -> tuple[Corner, ...]:
        """The corners of the footprint anticlockwise; a disc has none."""
        return anticlockwise(self.footprint) if self.footprint else ()

    @property
    def inscribed_radius_m(self) -> float:
        """The radius of the largest circle around its middle that lies within the body."""
        return radii_m(self.footprint)[0] if self.footprint else self.radius_m


class RobotType(BodyType):
    """A kind of robot: its body, and what it carries and runs if that differs from the fleet's."""

    robot: Equipment | None = Field(None, description=(
        "keys of the section robot that are different for this type (null: none)"))
    strategy: StrategyChoice | None = Field(None, description=(
        "the strategy of this type (null: that of coordination)"))

    def parsed(self) -> Self:
        """The type with the values of its strategy's parameters in place of what was written."""
        return self if self.strategy is None else self.model_copy(
            update={"strategy": self.strategy.parsed()})


class Group(Params):
    """Some robots of one type."""

    type: str
    count: int = Field(ge=1, le=MAX_ROBOTS)


class StartLine(Params):
    """Robots in a row: the i-th starts at ``from + i * step``."""

    origin_m: tuple[Position, Position] = Field(("-38 m", "38 m"), alias="from",
                                                description="(the paper: x = -38 m, y = 38 m)")
    step_m: tuple[Position, Position] = Field(("0 m", "-2 m"), description="(the paper: 2 m apart)")
    heading_rad: Angle = Field("0 rad", description="(the paper does not say)")
    snap: bool = Field(False, description="move a start inside a wall to the nearest free pose")


class StartGrid(Params):
    """Robots in rows of ``columns``: the i-th starts in column i mod columns, row i div columns."""

    columns: int = Field(ge=1, description="robots in a row")
    origin_m: tuple[Position, Position] = Field(("-38 m", "38 m"), alias="from",
                                                description="the first robot (the paper's line)")
    step_m: tuple[Position, Position] = Field(("2 m", "-2 m"), description=(
        "from column to column in x, from row to row in y (the paper: 2 m apart)"))
    heading_rad: Angle = Field("0 rad", description="(the paper does not say)")
    snap: bool = Field(False, description="move a start inside a wall to the nearest free pose")


class StartRandom(Params):
    """Robots at random free places with random headings, each drawn from a stream of its own."""

    apart_m: Length = Field(gt=0, description="between the middles of two robots, at least")
    within_m: tuple[tuple[Position, Position], tuple[Position, Position]] | None = Field(
        None, description="two corners of the rectangle that they are in (the whole terrain)")

    @property
    def snap(self) -> bool:
        """Places are free when they are drawn."""
        return False


class StartPose(Params):
    """One robot's start."""

    name: Name | None = Field(None, description=(
        "the robot's name; all poses have one, or none has and the i-th is that of robot_i"))
    x_m: Position
    y_m: Position
    heading_rad: Angle = "0 rad"


class StartList(Params):
    """Robots at given poses."""

    poses: tuple[StartPose, ...] = Field(min_length=1)
    snap: bool = False


class StartFile(Params):
    """Poses from a CSV file with the columns x_m, y_m and, if wanted, heading_rad and name."""

    file: str = Field(description="path, relative to the scenario that names it")
    snap: bool = False


class FleetParams(Params):
    """The robots."""

    size: int | None = Field(None, ge=0, le=MAX_ROBOTS, description=(
        "number of robots, 0: hosts alone (default: the groups' counts together, or as many as "
        "there are start poses, or 1)"))
    robots: Annotated[str | tuple[Group, ...], BY_SHAPE] = Field(
        "pioneer3dx", description="a type, or groups of types: the first robots are of the first")
    types: dict[Name, RobotType] = Field({}, description=(
        "own types beside the built-in ones; one of the same name as a built-in one says what is "
        "different"))
    start: Annotated[StartLine | StartGrid | StartRandom | StartList | StartFile,
                     BY_SHAPE] = Field(default_factory=StartLine)

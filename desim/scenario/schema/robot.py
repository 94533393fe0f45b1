"""The robot family: sensors and software, of the whole fleet or of one type of robot."""

from __future__ import annotations

from functools import cached_property
from typing import Annotated, Literal

from pydantic import Field

from desim.ports import Params
from desim.ports.antenna import Antenna
from desim.scenario.schema.clock import ClockParams
from desim.scenario.schema.communication import Name, PluginChoice
from desim.scenario.schema.computer import ComputerParams
from desim.scenario.schema.navigation import Navigation
from desim.scenario.schema.power import PowerParams
from desim.scenario.schema.shapes import BY_SHAPE
from desim.units import (
    Angle,
    Duration,
    Frequency,
    Length,
    MessageSize,
    Pace,
    Period,
    Position,
)


class Laser(Params):
    """A planar laser scanner."""

    beams: int = Field(180, ge=2, le=100_000, description="rays of a sweep (the paper: 180)")
    field_of_view_rad: Angle = Field("190 deg", gt=0, description="(SICK LMS500, the paper)")
    max_range_m: Length = Field("26 m", gt=0, description="(the paper)")
    height_m: Length = Field("0.35 m", description=(
        "of its plane above the ground; it looks over walls, doors and robots that are lower (our "
        "estimate: a scanner on the deck of a Pioneer 3-DX, which is 0.24 m high)"))
    rate_hz: Frequency = Field("25 Hz", description="(the paper)")
    noise_m: Length = Field("0 m", description="standard deviation of a range, Gaussian (MORSE's "
                                             "Sick has none)")
    pose: Literal["last_tick", "interpolated"] = Field("last_tick", description=(
        "a scan between two world ticks sees the pose of the last tick, or the interpolated one"))
    x_m: Position = Field("0 m", description="of its place on the body, ahead of the middle")
    y_m: Position = Field("0 m", description="of its place on the body, to the left of the middle")
    yaw_rad: Angle = Field("0 rad", description="of the middle of its view, to the left of ahead")

    @cached_property
    def angle_min_rad(self) -> float:
        """The direction of the first beam, as seen from the robot's heading."""
        return self.yaw_rad - 0.5 * self.field_of_view_rad

    @cached_property
    def increment_rad(self) -> float:
        """The angle between two beams."""
        return self.field_of_view_rad / (self.beams - 1)


SCAN = "scan"  # the topic of a robot's first laser, which SLAM reads


def _named(**parameters: object) -> Laser:
    """A laser with a name, which says all of its parameters: none is another laser's."""
    laser = Laser(**parameters)
    return laser.model_copy(update=dict(laser))


BUILT_IN_LASERS = {
    "lms500": _named(),
    # ROBOTIS e-Manual, LDS-01: 0.12 to 3.5 m, 1 degree, 300 rpm; the noise is that of
    # turtlebot3_description/urdf/turtlebot3_burger.gazebo.xacro (ROBOTIS-GIT/turtlebot3, noetic).
    "lds01": _named(beams=360, field_of_view="359 deg", yaw="179.5 deg", max_range="3.5 m",
                    rate="5 Hz", noise="0.01 m"),
    # Slamtec's data sheet of the RPLIDAR A1M8: 0.15 to 12 m, 360 samples a scan at 5.5 Hz.
    "rplidar_a1": _named(beams=360, field_of_view="359 deg", yaw="179.5 deg", max_range="12 m",
                         rate="5.5 Hz"),
    # urdf/sick_lms1xx.urdf.xacro (clearpathrobotics/LMS1xx); the range is SICK's of the LMS111.
    "lms111": _named(beams=720, field_of_view="270 deg", max_range="20 m", rate="50 Hz",
                     noise="0.001 m"),
}


def laser_of(given: str | Laser) -> Laser:
    """The parameters of a laser that may be given by its name."""
    return BUILT_IN_LASERS[given] if isinstance(given, str) else given


class Sonar(Params):
    """A ring of sonars, which all fire at once."""

    transducers: tuple[tuple[Position, Position, Angle], ...] = Field((
        ("0.069 m", "0.136 m", "90 deg"), ("0.114 m", "0.119 m", "50 deg"),
        ("0.148 m", "0.078 m", "30 deg"), ("0.166 m", "0.027 m", "10 deg"),
        ("0.166 m", "-0.027 m", "-10 deg"), ("0.148 m", "-0.078 m", "-30 deg"),
        ("0.114 m", "-0.119 m", "-50 deg"), ("0.069 m", "-0.136 m", "-90 deg")), min_length=1,
        description="x, y and yaw of each on the body (the front ring of a Pioneer 3-DX, as "
                    "Stage's pioneer.inc has it)")
    cone_rad: Angle = Field("30 deg", gt=0, le=1.6, description="the width of a view (Stage: 30)")
    min_range_m: Length = Field("0.1 m", gt=0, description="what is nearer reads this (Stage)")
    max_range_m: Length = Field("5 m", gt=0, description="(Stage)")
    height_m: Length = Field("0.2 m", description="of its plane (our estimate: below the deck)")
    rate_hz: Frequency = Field("10 Hz", description="(a Pioneer's server sends readings so often)")
    rays: int = Field(5, ge=2, le=100, description=(
        "beams over the cone, the shortest of which is read (our choice: 7.5 deg apart)"))

    @property
    def cones(self) -> tuple[Laser, ...]:
        """The view of each transducer, as a laser's."""
        return tuple(Laser().model_copy(update={
            "beams": self.rays, "field_of_view_rad": self.cone_rad,
            "max_range_m": self.max_range_m, "height_m": self.height_m, "rate_hz": self.rate_hz,
            "x_m": x_m, "y_m": y_m, "yaw_rad": yaw_rad}) for x_m, y_m, yaw_rad in self.transducers)


class Odometry(Params):
    """Wheel odometry. All kinds of localization but ``ground_truth`` read it."""

    rate_hz: Frequency = Field("10 Hz", description="(the paper)")
    model: Literal["independent", "random_walk"] = Field("independent", description=(
        "independent: each reading is the true pose plus fresh noise (MORSE's pose noise); "
        "random_walk: each step adds noise, so that it drifts"))
    position_noise_m: Length = Field("0.022 m", description="standard deviation (the paper)")
    heading_noise_rad: Angle = Field("0.02 rad", ge=0, description="standard deviation (the paper)")


class MappingParams(Params):
    """The occupancy grid that a robot makes of its own scans."""

    resolution_m: Length = Field("0.2 m", gt=0, description="(the published gmapping delta)")
    linear_update_m: Length = Field("1 m", description="a scan is taken in after driving so far "
                                                     "(gmapping linearUpdate)")
    angular_update_rad: Angle = Field("0.5 rad", ge=0, description="or turning so far (gmapping)")
    temporal_update_ns: Period | None = Field(None, description=(
        "or when the last one is so old: with this a robot that stands still sees doors open and "
        "close (null: never; gmapping temporalUpdate)"))
    published_size_m: tuple[Length, Length] | None = Field(None, description=(
        "width and height of whole maps in messages, which are padded with unknown cells up to it "
        "(gmapping's xmin to ymax: 160 m x 160 m in the published launch file; null: the terrain's)"
        "; a cell is a byte, and a message has at most 1 GB"))
    usable_range_m: Length = Field("25 m", gt=0, description=(
        "a longer beam clears space up to here and marks nothing (the published code's maxUrange)"))

    @property
    def published_cells(self) -> int:
        """The cells up to which whole maps in messages are padded; 0: they are not."""
        if self.published_size_m is None:
            return 0
        width, height = (round(side_m / self.resolution_m) for side_m in self.published_size_m)
        return width * height

    def padding(self, cells: int) -> int:
        """The cells that a message of a map of ``cells`` has beside these."""
        return max(0, self.published_cells - cells)


class ExplorationParams(Params):
    """Frontiers and goals."""

    rate_hz: Frequency = Field("1 Hz", description="goals are looked at no oftener than this "
                                                "(explore planner_frequency)")
    min_frontier_m: Length = Field("0.8 m", description="smaller clusters are ignored "
                                                      "(explore_lite min_frontier_size 0.75 m)")
    blacklist_radius_m: Length = Field("1 m", description=(
        "around a goal that was given up (explore_lite: 5 cells, 1 m with cells of 0.2 m; "
        "explore_multirobot: 2 cells)"))
    blacklist_for_ns: Duration | None = Field("60 s", description=(
        "how long a given-up goal is avoided (null: for good, as in explore_lite and "
        "explore_multirobot)"))
    publishes_cost: bool = Field(False, description=(
        "the way to the goal and the size of its frontier go to the monitor, at this rate (the "
        "published explore's estimated_cost, in parts)"))


class LocalizationChoice(PluginChoice):
    """The localization: how a robot estimates its pose."""

    kind, name_key = "localization", "model"

    model: str = Field("ground_truth", description=(
        "a localization plug-in: ground_truth, odometry, gmapping, scan_matching (ours; the paper: "
        "gmapping)"))
    host: str | None = Field(None, description=(
        "SLAM runs on this host, which gets scans and odometry over the network, and sends poses "
        "and maps back (null: on the robot itself)"))
    map_period_ns: Pace = Field("5 s", description=(
        "with a host: whole maps to the robot go out so often, if something was drawn (gmapping "
        "map_update_interval)"))


# The last parts of the topics that a robot's own software uses.
OWN_TOPICS = (SCAN, "odom", "true_pose", "sonar", "bumper", "cmd_vel", "pose", "map", "costmap",
              "peers", "goal", "goal_result", "cost", "gain", "explored_map", "distance",
              "team_state", "tf", "map_to_odom", "slam_map")
OTHERS = "others"  # as a receiver: all robots but the sender


class Publication(Params):
    """Messages of a declared size that a robot publishes at a rate: of a camera, say. Nothing reads
    them."""

    topic: str = Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*(/[A-Za-z][A-Za-z0-9_]*)*$", description=(
        "below the robot's name: camera of robot_3 is /robot_3/camera"))
    size_bytes: MessageSize = Field(description="of a message, without headers")
    rate_hz: Frequency = Field(description=(
        "of messages; the first one goes out after a part of the period that is drawn by name"))
    to: Annotated[str | tuple[str, ...], BY_SHAPE] | None = Field(None, description=(
        "hosts by name or by patterns with * and ?, or others: all robots but the sender (default: "
        "the hosts that collect maps and distances)"))
    transport: Literal["stream", "datagram"] = Field("stream", description=(
        "stream: TCPROS; datagram: best effort, cut into packets by the middleware (UDPROS, DDS)"))
    queue: int = Field(1, ge=0, description=(
        "messages that may wait for a receiver, then the oldest goes (0: any number)"))


class Equipment(Params):
    """The equipment and software of a robot."""

    localization: LocalizationChoice = Field(default_factory=LocalizationChoice)
    laser: Annotated[str | Laser | None, BY_SHAPE] = Field(default_factory=Laser, description=(
        "lms500, lds01, rplidar_a1, lms111, or its parameters: the only one (null where there are "
        "lasers)"))
    lasers: dict[Name, Annotated[str | Laser, BY_SHAPE]] = Field({}, description=(
        "several, by name, in place of the only one; SLAM reads the first"))
    sonar: Sonar | None = Field(None, description="a ring of sonars ({}: a Pioneer's; null: none)")
    bumper: bool = Field(False, description=(
        "senses contacts on all sides; navigation then stops and backs off (as Kobuki's "
        "safety_controller does)"))
    antenna: Antenna = Field(default_factory=Antenna)
    computer: ComputerParams = Field(default_factory=ComputerParams)
    clock: ClockParams | None = Field(None, description="(null: it shows the true time)")
    power: PowerParams | None = Field(None, description=(
        "what its parts draw ({}: a Pioneer 3-DX; null: its energy is not measured)"))
    odometry: Odometry = Field(default_factory=Odometry)
    mapping: MappingParams = Field(default_factory=MappingParams)
    navigation: Navigation = Field(default_factory=Navigation)
    exploration: ExplorationParams = Field(default_factory=ExplorationParams)
    publishes: tuple[Publication, ...] = Field((), description=(
        "traffic beside that of its software: messages of a declared size at a rate"))

    @property
    def first_laser(self) -> Laser:
        """The first laser."""
        return next(iter(self.lasers_by_topic.values()))

    @property
    def lasers_by_topic(self) -> dict[str, Laser]:
        """The lasers by the topics of their scans: of the first one ``scan``, of another one
        ``<name>/scan``."""
        first, *others = self.lasers or ("",)
        named = self.lasers or {first: self.laser or Laser()}
        return {SCAN if name == first else f"{name}/{SCAN}": laser_of(named[name])
                for name in (first, *others)}


class Robot(Equipment):
    """The equipment and software of every robot whose type has none of its own."""

    tf: Literal["none", "own", "all"] = Field("none", description=(
        "transforms between frames as traffic, which nothing reads: own, four messages ten times a "
        "second to the robot itself (as after yzrobot's tf_splitter); all, to the whole fleet (as "
        "in ROS without it)"))
    passive: tuple[str, ...] = Field((), description="names of robots that carry no software: they "
                                               "stand where they are and say nothing")

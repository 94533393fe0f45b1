"""The navigation section of the robot family: costmaps, planners, recovery."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from desim.ports import Constants, Params
from desim.scenario.schema.communication import PluginChoice
from desim.units import Frequency, Length, Period

MAX_LOCAL_SIDE = 1000  # cells of the local window; the published one has 60


class NavigationConstants(Constants):
    """The constants of recoveries and of the local planner's costs."""

    stuck_after_ns: Period = Field("5 s", description=(
        "of recovery progress: the way became no shorter for so long (move_base "
        "controller_patience)"))
    give_up_after: int = Field(3, ge=1, description=(
        "of recovery progress: recoveries before the goal is aborted"))
    planner_patience_ns: Period = Field("5 s", description=(
        "of recovery move_base: so long without a path starts a recovery (move_base.cpp)"))
    controller_patience_ns: Period = Field("15 s", description=(
        "of recovery move_base: so long without a clear velocity starts a recovery (move_base.cpp; "
        "MoveBase.cfg: 5 s)"))
    oscillation_timeout_ns: Period | None = Field(None, description=(
        "of recovery move_base: so long near one place starts a recovery (null: never, as in "
        "move_base.cpp)"))
    oscillation_distance_m: Length = Field("0.5 m", description=(
        "of recovery move_base: what counts as another place (move_base.cpp)"))
    conservative_reset_m: Length = Field("3 m", description=(
        "of recovery move_base: side of the square that the first reset leaves "
        "(conservative_reset_dist)"))
    sensor_timeout_ns: Period = Field("0.5 s", description=(
        "the robot stops when its newest scan is older (move_base: sensor not current; at least "
        "two periods of the laser)"))
    keep_right_m: Length = Field("0.4 m", description=(
        "drive so far to the right of the planned way, so that robots that meet on one way pass "
        "each other (1.5 robot radii)"))
    clearance_m: Length = Field("0.1 m", description=(
        "distance that rollouts keep from obstacles beside the robot's radius (one cell of the "
        "local grid)"))
    path_weight: float = Field(0.6, ge=0, description=(
        "per metre that a rollout ends beside the way (TrajectoryPlannerROS path_distance_bias)"))
    goal_weight: float = Field(0.8, ge=0, description=(
        "per metre to the point ahead on the way (TrajectoryPlannerROS goal_distance_bias)"))
    obstacle_weight: float = Field(0.001, ge=0, description=(
        "per unit of inflated cost (TrajectoryPlannerROS occdist_scale 0.01 per cell of 0.1 m)"))


class LocalPlannerChoice(PluginChoice):
    """The local planner: from a path to velocities."""

    kind, name_key = "local_planner", "model"

    model: str = Field("dynamic_window", description=(
        "a local planner plug-in: dynamic_window (ours), regulated_pure_pursuit, dwb, orca"))


class Navigation(Params):
    """Costmaps, global and local planner, recovery."""

    control_rate_hz: Frequency = Field("10 Hz", description="(the published code)")
    local_rate_hz: Frequency = Field("5 Hz", description="update of the local layer (the paper)")
    local_size_m: Length = Field("6 m", gt=0,
                                 description="side of the local window (the published yaml)")
    local_resolution_m: Length = Field("0.1 m", gt=0, description="(the published yaml)")
    inflation_radius_m: Length = Field("0.55 m", description="(costmap_2d default)")
    inflation_scaling: float = Field(10.0, gt=0, description="cost decay per metre (costmap_2d "
                                                             "cost_scaling_factor)")
    sim_time_ns: Period = Field("1 s", description="rollout length (TrajectoryPlannerROS)")
    speed_samples: int = Field(3, ge=1, le=100, description="(TrajectoryPlannerROS vx_samples)")
    turn_samples: int = Field(20, ge=3, le=1000,
                              description="(TrajectoryPlannerROS vtheta_samples)")
    goal_tolerance_m: Length = Field("0.4 m", gt=0, description="(two cells of the map)")
    local: LocalPlannerChoice = Field(default_factory=LocalPlannerChoice)
    recovery: Literal["progress", "move_base"] = Field("progress", description=(
        "when a robot is stuck and what it tries. progress: without progress it plans again, turns "
        "once, retreats; move_base: the published triggers and order"))
    transform_tolerance_ns: Period = Field("0.3 s", description=(
        "the robot stops when its pose has a stamp that is older by its own clock "
        "(costmap_2d transform_tolerance)"))
    constants: NavigationConstants = Field(default_factory=NavigationConstants, description=(
        "single constants that differ (those of move_base, TrajectoryPlannerROS, ours)"))

"""Parameters of navigation in ROS, from YAML files and from ``<param>`` of launch files.

Those of Nav2, of ROS 1's move_base and its planners, of diff_drive_controller and of explore_lite.
Limits of speed and acceleration act one after another (planner, smoother, base): the lowest holds.
Of costmaps the local one counts, of controllers and goal checkers the first one that is listed.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path as FilePath
from typing import NamedTuple

from desim import outside_xml
from desim.errors import InputError
from desim.imports.robots.found import FoundRobot, Unused, hull
from desim.scenario import yaml12
from desim.scenario.source_places import Path, Places, SourcePlace, items
from desim.units import (
    ACCELERATION,
    ANGULAR_ACCELERATION,
    ANGULAR_SPEED,
    FREQUENCY,
    LENGTH,
    NS_PER_S,
    PERIOD,
    POSITION,
    SPEED,
)


class RosParameter(NamedTuple):
    """A parameter of a node: the sections that it stands in and its name, value and place."""

    path: tuple[str, ...]
    value: object
    place: SourcePlace

    @property
    def number(self) -> float:
        """Its value; a parameter that is no finite number above 0 counts as absent: nan."""
        value = self.value
        if isinstance(value, bool) or not isinstance(value, int | float):
            return math.nan
        return float(value) if 0 < value < math.inf else math.nan


Written = Callable[[float], object]


def _hertz(value: float) -> str:
    return FREQUENCY.format(Fraction(str(value)))


def _seconds(value: float) -> str:
    return PERIOD.format(round(value * NS_PER_S))


_NAVIGATION = ("robot", "navigation")
_CONSTANTS = (*_NAVIGATION, "constants")
_SPEED: tuple[Path, Written] = (("max_speed",), SPEED.format)
_TURN: tuple[Path, Written] = (("max_turn",), ANGULAR_SPEED.format)
_GAIN: tuple[Path, Written] = (("acceleration",), ACCELERATION.format)
_TURN_GAIN: tuple[Path, Written] = (("turn_acceleration",), ANGULAR_ACCELERATION.format)
# The lowest of these holds, wherever they are said.
_LIMITS: dict[str, tuple[Path, Written]] = {
    "max_vel_x": _SPEED, "max_speed_xy": _SPEED, "max_vel_trans": _SPEED, "max_trans_vel": _SPEED,
    "desired_linear_vel": _SPEED, "vx_max": _SPEED, "linear.x.max_velocity": _SPEED,
    "max_vel_theta": _TURN, "max_rot_vel": _TURN, "max_vel_rot": _TURN,
    "max_rotational_vel": _TURN, "wz_max": _TURN, "angular.z.max_velocity": _TURN,
    "acc_lim_x": _GAIN, "ax_max": _GAIN, "max_linear_accel": _GAIN,
    "linear.x.max_acceleration": _GAIN,
    "acc_lim_theta": _TURN_GAIN, "acc_lim_th": _TURN_GAIN, "az_max": _TURN_GAIN,
    "max_angular_accel": _TURN_GAIN, "angular.z.max_acceleration": _TURN_GAIN,
    "cmd_vel_timeout": (("command_timeout",), _seconds),
}
_LISTED = {"max_velocity": (_SPEED, _TURN), "max_accel": (_GAIN, _TURN_GAIN)}  # x, y, theta
_OF_FLEETS = {"limits.linear": (_SPEED, _GAIN), "limits.angular": (_TURN, _TURN_GAIN)}  # Open-RMF
# The last one that is said holds.
_KEYS: dict[str, tuple[Path, Written]] = {
    "controller_frequency": ((*_NAVIGATION, "control_rate"), _hertz),
    "inflation_radius": ((*_NAVIGATION, "inflation_radius"), LENGTH.format),
    "cost_scaling_factor": ((*_NAVIGATION, "inflation_scaling"), float),
    "xy_goal_tolerance": ((*_NAVIGATION, "goal_tolerance"), LENGTH.format),
    "sim_time": ((*_NAVIGATION, "sim_time"), _seconds),
    "vx_samples": ((*_NAVIGATION, "speed_samples"), int),
    "vtheta_samples": ((*_NAVIGATION, "turn_samples"), int),
    "vth_samples": ((*_NAVIGATION, "turn_samples"), int),
    "planner_patience": ((*_CONSTANTS, "planner_patience"), _seconds),
    "controller_patience": ((*_CONSTANTS, "controller_patience"), _seconds),
    "oscillation_timeout": ((*_CONSTANTS, "oscillation_timeout"), _seconds),
    "oscillation_distance": ((*_CONSTANTS, "oscillation_distance"), LENGTH.format),
    "conservative_reset_dist": ((*_CONSTANTS, "conservative_reset"), LENGTH.format),
    "min_frontier_size": (("robot", "exploration", "min_frontier"), LENGTH.format),
    "explore.planner_frequency": (("robot", "exploration", "rate"), _hertz),
    "local_costmap.update_frequency": ((*_NAVIGATION, "local_rate"), _hertz),
    "local_costmap.width": ((*_NAVIGATION, "local_size"), LENGTH.format),
    "local_costmap.resolution": ((*_NAVIGATION, "local_resolution"), LENGTH.format),
    **{f"{costmap}_costmap.transform_tolerance": (
        (*_NAVIGATION, "transform_tolerance"), _seconds) for costmap in ("local", "global")},
    "global_costmap.resolution": (("robot", "mapping", "resolution"), LENGTH.format),
    "slam_toolbox.resolution": (("robot", "mapping", "resolution"), LENGTH.format),
    "robot_radius": (("radius",), LENGTH.format),
    "profile.footprint": (("radius",), LENGTH.format),
}
_MOVE_BASE = ("planner_patience", "controller_patience", "oscillation_timeout",
              "conservative_reset_dist")
# Sections whose limits are those of their own manoeuvres.
_OF_MANOEUVRES = ("behavior_server", "behaviour_server", "recoveries_server", "docking_server",
                "collision_monitor")
_SIDEWAYS = re.compile(r"(omni|mecanum|swerve)\w*drive", re.IGNORECASE)  # a base's controller
_TOP = "(at the top)"


def of_yaml(path: FilePath, found: FoundRobot) -> list[RosParameter]:
    """The parameters in a YAML file. Raises ``InputError``."""
    data, places, complaints = yaml12.read_as_ros(str(path))
    found.notes += complaints
    return _flat(data, places, (), ())


def of_launch(path: FilePath, found: FoundRobot) -> list[RosParameter]:
    """The ``<param>`` elements of a launch file of ROS 1. Raises ``InputError``."""
    parameters = []

    def collect(element: outside_xml.Element, node: tuple[str, ...]) -> None:
        if element.tag == "node":
            node = (element.attributes.get("name", "node"),)
        elif element.tag == "param" and "value" in element.attributes:
            name, value = element.attributes.get("name", ""), element.attributes["value"]
            place = SourcePlace(str(path), element.line, 1)
            parameters.append(RosParameter((*node, *name.strip("/").split("/")), _scalar(value),
                                        place))
        for child in element.children:
            collect(child, node)

    collect(outside_xml.read(path), ())
    return parameters


def _scalar(text: str) -> object:
    try:
        value = float(text)
    except ValueError:
        return {"true": True, "false": False}.get(text.lower(), text)
    return value if math.isfinite(value) else text


def _flat(value: object, places: Places, at: Path, names: tuple[str, ...]) -> list[RosParameter]:
    if not isinstance(value, dict):
        return [RosParameter(names, value, places.key(at))]
    flat = []
    for key, below in items(value):
        own = [] if key == "ros__parameters" else [part for part in str(key).split("/") if part]
        flat += _flat(below, places, (*at, key),
                      (*names, *(part for name in own for part in name.split("."))))
    return flat


def take(parameters: list[RosParameter], inert: set[str], found: FoundRobot) -> None:
    """Add what the parameters of a file say, without those of ``inert`` sections. Raises
    ``InputError``."""
    explores = {one.path[:-1] for one in parameters
                if one.path[-1:] in [("min_frontier_size",), ("potential_scale",), ("gain_scale",)]}
    # What is said later replaces what was said before: the local costmap comes after the global
    # one, what goal checkers and move_base say after what planners say of the same, and a footprint
    # after a radius.
    parameters = sorted(parameters, key=lambda one: (
        "local_costmap" in one.path, "goal_checker" in " ".join(one.path),
        not any(name.endswith("PlannerROS") for name in one.path),
        one.path[-1:] == ("footprint",)))
    for one in parameters:
        explore = one.path[:-1] in explores
        if inert.intersection(one.path) or not _taken(one, explore, found):
            section, key = (one.path[0], one.path[1:]) if one.path[1:] else (_TOP, one.path)
            found.unused.append(Unused(section, ".".join(key), one.place))


def _taken(one: RosParameter, explore: bool, found: FoundRobot) -> bool:
    """Whether desim has a counterpart of this parameter, which is then set."""
    name = one.path[-1] if one.path else ""
    if name == "footprint" and math.isnan(one.number):
        return _outline(one, found)
    if name == "type" and _SIDEWAYS.search(str(one.value)):
        found.put(("drive",), "holonomic", one.place)
        return True
    if name in ("holonomic_robot", "robot_model_type", "motion_model"):
        holonomic = one.value is True or str(one.value).rpartition("::")[2].startswith("Omni")
        found.put(("drive",), "holonomic" if holonomic else "differential", one.place)
        if "ackermann" in str(one.value).lower():
            found.notes.append(f"{one.place}: {name} is Ackermann; no drive of desim steers so: "
                               "differential, which turns on the spot")
        return True
    if name in _LISTED and isinstance(one.value, list) and len(one.value) == 3:
        for axis, (path, written) in zip((0, 2), _LISTED[name], strict=True):
            _limit(one._replace(value=one.value[axis]), path, written, found)
        return True
    limits = _OF_FLEETS.get(".".join(one.path[-2:]), ())
    if limits and isinstance(one.value, list) and len(one.value) == 2:
        for value, (path, written) in zip(one.value, limits, strict=True):
            _limit(one._replace(value=value), path, written, found)
        return True
    if math.isnan(one.number) or set(_OF_MANOEUVRES).intersection(one.path):
        return False
    for spelt in (".".join(one.path[-3:]), name):
        if spelt in _LIMITS:
            _limit(one, *_LIMITS[spelt], found)
            return True
    sections = [*one.path[:-1], "explore"] if explore else one.path[:-1]
    for spelt in (*(f"{section}.{name}" for section in sections), name):
        if spelt in _KEYS:
            path, written = _KEYS[spelt]
            found.put(path, written(one.number), one.place)
            if name in _MOVE_BASE:
                found.put((*_NAVIGATION, "recovery"), "move_base", one.place)
            return True
    return False


def _limit(one: RosParameter, path: Path, written: Written, found: FoundRobot) -> None:
    if math.isnan(one.number):
        return
    before = found.limits.get(path, math.inf)
    if one.number < before:
        found.limits[path] = one.number
        found.put(path, written(one.number), one.place)


def _outline(one: RosParameter, found: FoundRobot) -> bool:
    """Whether a footprint is given, as a list or as the text of one."""
    given = one.value
    if isinstance(given, str):
        if not given.strip(" []"):
            return False
        try:
            given = json.loads(given)
        except ValueError:
            given = None
    corners = [(float(corner[0]), float(corner[1])) for corner in given
               if isinstance(corner, list) and len(corner) == 2
               and all(isinstance(value, int | float) and math.isfinite(value)
                       for value in corner)] if isinstance(given, list) else []
    if given == []:
        return False
    if not isinstance(given, list) or len(corners) != len(given) or len(hull(corners)) < 3:
        raise InputError(f"{one.place}: footprint: must be a list of at least 3 corners, e.g. "
                         f"[[0.2, 0.2], [0.2, -0.2], [-0.2, 0]], got {one.value!r}")
    outer = hull(corners)
    if len(outer) < len(set(corners)):
        found.notes.append(f"{one.place}: footprint: its convex hull, of {len(outer)} corners")
    found.put(("footprint",), [[POSITION.format(x), POSITION.format(y)] for x, y in outer],
              one.place)
    return True


def inert_sections(parameters: list[RosParameter], found: FoundRobot) -> set[str]:
    """The sections, in all files together, of plug-ins that are not the chosen ones."""
    values = {one.path[-1]: one.value for one in parameters if one.path}
    inert: set[str] = set()
    for listed in ("controller_plugins", "goal_checker_plugins"):
        names = values.get(listed)
        if isinstance(names, list):
            inert.update(map(str, names[1:]))
    planners = list(dict.fromkeys(name for one in parameters for name in one.path[:-1]
                                  if name.endswith("PlannerROS")))
    if len(planners) > 1:
        chosen = str(values.get("base_local_planner", "TrajectoryPlannerROS")).rpartition("/")[2]
        chosen = chosen if chosen in planners else planners[0]
        inert.update(set(planners) - {chosen})
        found.notes.append(f"of the local planners {', '.join(planners)}, {chosen} counts "
                           "(base_local_planner)")
    return inert

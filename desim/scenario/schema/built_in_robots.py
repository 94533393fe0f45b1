"""The types of robots that need no declaration.

Each footprint is that of the body, without the margin that navigation files add. Heights of lasers
are sums along the joints of the named descriptions.
"""

from __future__ import annotations

from desim.scenario.schema.fleet import RobotType
from desim.scenario.schema.robot import BUILT_IN_LASERS, Equipment


def _carrying(laser: str, x_m: float, height_m: float) -> Equipment:
    """Equipment with a laser of this name, so far ahead of the middle and above the ground."""
    mounted = BUILT_IN_LASERS[laser].model_copy(update={"x_m": x_m, "height_m": height_m})
    return Equipment().model_copy(update={"laser": mounted})


def _rectangle(back: str, front: str, half_width: str) -> tuple[tuple[str, str], ...]:
    """A footprint that is as wide to the left as to the right."""
    return ((back, f"-{half_width}"), (front, f"-{half_width}"), (front, half_width),
            (back, half_width))


BUILT_IN_TYPES = {
    "pioneer3dx": RobotType(),
    "holonomic": RobotType(drive="holonomic"),
    # ROBOTIS e-Manual: 138 x 178 x 192 mm, 0.22 m/s, 2.84 rad/s. ROBOTIS-GIT/turtlebot3:
    # turtlebot3_description/urdf/turtlebot3_burger.urdf (box around the axis of the wheels, laser);
    # accelerations: turtlebot3_navigation/param/dwa_local_planner_params_burger.yaml (noetic).
    "turtlebot3_burger": RobotType(
        footprint=_rectangle("-0.102 m", "0.038 m", "0.089 m"), height="0.192 m",
        max_speed="0.22 m/s", max_turn="2.84 rad/s", acceleration="2.5 m/s^2",
        turn_acceleration="3.2 rad/s^2", robot=_carrying("lds01", -0.032, 0.182)),
    # ROBOTIS e-Manual: 281 x 306 x 141 mm, 0.26 m/s, 1.82 rad/s. ROBOTIS-GIT/turtlebot3:
    # turtlebot3_description/urdf/turtlebot3_waffle.urdf (laser); back and front, accelerations:
    # turtlebot3_navigation/param/*_waffle.yaml (noetic).
    "turtlebot3_waffle": RobotType(
        footprint=_rectangle("-0.205 m", "0.077 m", "0.153 m"), height="0.141 m",
        max_speed="0.26 m/s", max_turn="1.82 rad/s", acceleration="2.5 m/s^2",
        turn_acceleration="3.2 rad/s^2", robot=_carrying("lds01", -0.064, 0.132)),
    # TurtleBot 4 User Manual (turtlebot/turtlebot4-user-manual, overview/features.md): 342 x 339 x
    # 351 mm, 0.31 m/s in safe mode, 1.9 rad/s. Laser: turtlebot4_description/urdf/standard/
    # turtlebot4.urdf.xacro (turtlebot/turtlebot4); accelerations, timeout: irobot_create_control/
    # config/control.yaml (iRobotEducation/create3_sim).
    "turtlebot4": RobotType(
        radius="0.171 m", height="0.351 m", max_speed="0.31 m/s", max_turn="1.9 rad/s",
        acceleration="0.9 m/s^2", turn_acceleration="7.725 rad/s^2", command_timeout="0.5 s",
        robot=_carrying("rplidar_a1", -0.04, 0.193)),
    # Clearpath's data sheet of the Husky A200: 990 x 670 x 390 mm, 1 m/s. husky/husky
    # (noetic-devel): husky_control/config/control.yaml (limits, timeout); husky_description/urdf/
    # husky.urdf.xacro and accessories/sick_lms1xx_mount.urdf.xacro (LMS1xx on the top plate).
    "husky": RobotType(
        footprint=_rectangle("-0.495 m", "0.495 m", "0.335 m"), height="0.39 m",
        max_speed="1 m/s", max_turn="2 rad/s", acceleration="3 m/s^2",
        turn_acceleration="6 rad/s^2", command_timeout="0.25 s",
        robot=_carrying("lms111", 0.337, 0.44)),
    # Clearpath's data sheet of the Jackal: 508 x 430 x 250 mm, 2 m/s. jackal/jackal
    # (noetic-devel): jackal_control/config/control.yaml (limits, timeout); jackal_description/urdf/
    # jackal.urdf.xacro and accessories/sick_lms1xx_upright_mount.urdf.xacro (front mount).
    "jackal": RobotType(
        footprint=_rectangle("-0.254 m", "0.254 m", "0.215 m"), height="0.25 m",
        max_speed="2 m/s", max_turn="4 rad/s", acceleration="20 m/s^2",
        turn_acceleration="25 rad/s^2", command_timeout="0.25 s",
        robot=_carrying("lms111", 0.12, 0.397)),
}

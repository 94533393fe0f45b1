"""The messages of ROS that a robot publishes: their fields by name, the same in ROS 1 and ROS 2.

Fields that are not there are zero. Stamps are ns since 1970. Frames are those of REP 105, in the
namespace of the robot but for ``map``, which a fleet has in common.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from desim.middleware.contents import LaserScan, Pose
from desim.ports import GridSpec, Pose2D
from desim.robot.transforms import motion_to, moved

Fields = dict[str, Any]

MAP = "map"


def laser_scan(robot: str, laser: str, scan: LaserScan, stamp_ns: int) -> Fields:
    """sensor_msgs/LaserScan of the laser of a topic, which gives its frame the name."""
    beams = len(scan.ranges)
    return {"header": _header(stamp_ns, f"{robot}/{laser}"), "angle_min": scan.angle_min_rad,
            "angle_max": scan.angle_min_rad + (beams - 1) * scan.angle_increment_rad,
            "angle_increment": scan.angle_increment_rad, "range_max": scan.range_max_m,
            "ranges": scan.ranges.tolist()}


def odometry(robot: str, pose: Pose, stamp_ns: int) -> Fields:
    """nav_msgs/Odometry without velocities."""
    return {"header": _header(stamp_ns, f"{robot}/odom"), "child_frame_id": f"{robot}/base_link",
            "pose": {"pose": _pose(*pose[1:])}}


def laser_transform(robot: str, laser: str, scan: LaserScan, stamp_ns: int) -> Fields:
    """geometry_msgs/TransformStamped: the place of a laser on its robot."""
    return _transform(stamp_ns, f"{robot}/base_link", f"{robot}/{laser}",
                      Pose2D(scan.x_m, scan.y_m, 0.0))


def odometry_transform(robot: str, pose: Pose, stamp_ns: int) -> Fields:
    """geometry_msgs/TransformStamped: the robot by its odometry."""
    return _transform(stamp_ns, f"{robot}/odom", f"{robot}/base_link", Pose2D(*pose[1:]))


def map_transform(robot: str, pose: Pose, odometry: Pose, stamp_ns: int) -> Fields:
    """geometry_msgs/TransformStamped: the frame of a robot's odometry on the map, from its ``pose``
    there and its ``odometry`` of the same instant."""
    back = motion_to(Pose2D(*odometry[1:]), Pose2D(0.0, 0.0, 0.0))
    return _transform(stamp_ns, MAP, f"{robot}/odom", moved(Pose2D(*pose[1:]), back))


def occupancy_grid(spec: GridSpec, cells: np.ndarray, stamp_ns: int) -> Fields:
    """nav_msgs/OccupancyGrid of ``cells``, int8 [height, width]: 0 free, 100 occupied, -1 unknown.
    """
    return {"header": _header(stamp_ns, MAP),
            "info": {"map_load_time": stamp_ns, "resolution": spec.resolution_m,
                     "width": spec.width, "height": spec.height,
                     "origin": _pose(spec.x_m, spec.y_m, 0.0)},
            "data": cells.ravel().tolist()}


def _transform(stamp_ns: int, parent: str, child: str, place: Pose2D) -> Fields:
    return {"header": _header(stamp_ns, parent), "child_frame_id": child,
            "transform": {"translation": {"x": place.x_m, "y": place.y_m},
                          "rotation": _turned(place.yaw_rad)}}


def _header(stamp_ns: int, frame: str) -> Fields:
    return {"stamp": stamp_ns, "frame_id": frame}


def _pose(x_m: float, y_m: float, yaw_rad: float) -> Fields:
    return {"position": {"x": x_m, "y": y_m}, "orientation": _turned(yaw_rad)}


def _turned(yaw_rad: float) -> Fields:
    """The quaternion of a turn around the vertical."""
    return {"z": math.sin(yaw_rad / 2), "w": math.cos(yaw_rad / 2)}

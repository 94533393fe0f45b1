"""Synthetic logs for tests of SLAM: a building of straight walls, a path, and known noise."""

from typing import NamedTuple

import numpy as np

from desim.imports.slam_logs.laser_log import LaserLog
from desim.ports.localization import LaserGeometry
from desim.robot.transforms import compose, motion_between


class Laser(NamedTuple):
    """A laser of so many beams over a field of view, and its noise."""

    beams: int = 181
    field_deg: float = 180.0
    longest_m: float = 30.0
    noise_m: float = 0.01

    @property
    def geometry(self) -> LaserGeometry:
        field = np.radians(self.field_deg)
        return LaserGeometry(-0.5 * field, field / (self.beams - 1), longest_m=self.longest_m)


SICK = Laser()


def box(x0, y0, x1, y1):
    """The four walls of a rectangle, [4, 4]: x, y of both ends."""
    corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)]
    return [(*a, *b) for a, b in zip(corners[:-1], corners[1:], strict=True)]


def ring(width=30.0, height=20.0, corridor=2.5, seed=5):
    """Walls of a corridor around a block, with niches, pillars and doors that are not regular."""
    draw = np.random.default_rng(seed)
    walls = box(0, 0, width, height) + box(corridor, corridor, width - corridor, height - corridor)
    for side in range(4):
        length = width if side % 2 == 0 else height
        at = corridor + 1.0
        while at < length - corridor - 1.5:
            deep, wide = draw.uniform(0.1, 0.5), draw.uniform(0.3, 1.2)
            a, b = at, at + wide
            walls += {0: box(a, 0, b, deep), 1: box(width - deep, a, width, b),
                      2: box(a, height - deep, b, height), 3: box(0, a, deep, b)}[side]
            at = b + draw.uniform(0.8, 4.0)
    return np.array(walls)


def way(corners, step_m=0.1, turn_rad=0.1):
    """Poses [n, 3] from corner to corner, turning on the spot."""
    poses, yaw = [], None
    for (x0, y0), (x1, y1) in zip(corners[:-1], corners[1:], strict=True):
        heading = np.arctan2(y1 - y0, x1 - x0)
        if yaw is not None:
            turn = (heading - yaw + np.pi) % (2 * np.pi) - np.pi
            count = int(abs(turn) / turn_rad)
            poses += [(x0, y0, yaw + turn * (k + 1) / (count + 1)) for k in range(count)]
        yaw = heading
        length = np.hypot(x1 - x0, y1 - y0)
        count = max(int(length / step_m), 1)
        poses += [(x0 + (x1 - x0) * k / count, y0 + (y1 - y0) * k / count, heading)
                  for k in range(count)]
    return np.array(poses)


def scan(pose, walls, laser, draw):
    """Ranges [beams] from a pose: the nearest wall, with noise; ``longest_m`` where there is none.
    """
    angles = pose[2] + laser.geometry.angle_min_rad + np.arange(laser.beams) * (
        laser.geometry.increment_rad)
    ux, uy = np.cos(angles)[:, None], np.sin(angles)[:, None]
    ax, ay = walls[:, 0] - pose[0], walls[:, 1] - pose[1]
    wx, wy = walls[:, 2] - walls[:, 0], walls[:, 3] - walls[:, 1]
    across = ux * wy - uy * wx
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (ax * wy - ay * wx) / across
        part = (ax * uy - ay * ux) / across
    along[~((part >= 0.0) & (part <= 1.0) & (along > 0.0))] = np.inf
    found = along.min(1) + draw.normal(0.0, laser.noise_m, laser.beams)
    return np.where(found < laser.longest_m, found, laser.longest_m)


def made_log(walls, poses, laser=SICK, seed=1, scale=0.03, drift=0.02, jitter=0.05):
    """A log of true ``poses`` [n, 3]: odometry that is off by ``scale`` in length, that turns by
    ``drift`` rad a metre, and ``jitter`` of each motion at random."""
    draw = np.random.default_rng(seed)
    ranges = np.array([scan(pose, walls, laser, draw) for pose in poses])
    odometry = np.zeros_like(poses)
    for k, true in enumerate(motion_between(poses[:-1], poses[1:])):
        length = np.hypot(true[0], true[1])
        motion = true * (1.0 + scale) + draw.normal(0.0, 1.0, 3) * jitter * np.array(
            (length, length, abs(true[2]) + 0.2 * length))
        motion[2] += drift * length
        odometry[k + 1] = compose(odometry[k], motion)
    return LaserLog(np.arange(len(poses)) * 0.2, odometry, ranges, laser.geometry)


def carmen_text(log):
    """The log as CARMEN writes it."""
    lines = []
    for time_s, pose, ranges in zip(log.times_s, log.odometry, log.ranges, strict=True):
        place = " ".join(f"{value:.6f}" for value in pose)
        lines.append(f"ODOM {place} 0 0 0 {time_s:.6f} robot {time_s:.6f}")
        lines.append(f"FLASER {len(ranges)} {' '.join(f'{value:.2f}' for value in ranges)} {place} "
                     f"{place} {time_s:.6f} robot {time_s:.6f}")
    return "\n".join(lines) + "\n"

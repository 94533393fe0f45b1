"""Scan matching: SLAM with one hypothesis."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from desim import ports
from desim.ports import Pose2D
from desim.ports.localization import (
    LocalizationContext,
    LocalizationTraits,
    OdometryErrors,
    ScanWithOdometry,
)
from desim.robot.slam.kinds import scan_matching
from desim.robot.slam.settings import OdometryNoise, SlamSettings
from desim.robot.transforms import compose, motion_to, moved
from desim.units import Pace


class ScanMatching:
    """SLAM with the laser and the odometry: each scan goes where it fits best on the map so far
    (Olson 2009). The pose is that of the last processed scan, moved on by the odometry since.

    Without a known start (after a restart) the first reading of the odometer is taken as the pose.
    """

    traits = LocalizationTraits(draws_map=True)
    new_filter = staticmethod(scan_matching)

    class Params(ports.Params):
        """Parameters of ``scan_matching``."""

        redraw_every_ns: Pace = Field("5 s", description=(
            "for the map to be drawn anew, where a better path was found (gmapping "
            "map_update_interval)"))

    def __init__(self, params: Params) -> None:
        self._redraw_every_ns = params.redraw_every_ns
        self._start: Pose2D | None = None
        self._readings = 0  # of the odometer, since the last ``scan``
        # The odometry of the last processed scan, and its most likely pose.
        self._processed: tuple[Pose2D, Pose2D] | None = None
        self._counted = 0, 0  # scans, and the patches of their maps

    def start(self, context: LocalizationContext) -> None:
        """Make the filter."""
        self._start = context.start
        self.filter = self.new_filter(self._settings(context), context.key("particles"))
        context.every(self._redraw_every_ns, self._redraw)

    def on_odometry(self, context: LocalizationContext, odometry: Pose2D,
                    scan: ScanWithOdometry | None) -> Pose2D:
        """The pose of the last processed scan, which may be this one, moved on by the odometry."""
        self._readings += 1
        if self._start is None:
            self._start = odometry
        if scan is not None:
            is_due = self.filter.advance(scan.odometry, self._readings)
            self._readings = 0
            if is_due:
                particles = len(self.filter.poses)
                context.worked(scans=1, particles=particles, beams=particles * len(scan.ranges))
                pose = self._process(context, scan)
                self._processed = scan.odometry, pose
                context.draw(scan, pose)
        if self._processed is None:
            return odometry
        before, pose = self._processed
        return moved(pose, motion_to(before, odometry))

    def _settings(self, context: LocalizationContext) -> SlamSettings:
        """Those of the filter."""
        return settings_of(context)

    def _process(self, context: LocalizationContext, scan: ScanWithOdometry) -> Pose2D:
        """Process a scan that is due. Returns its pose."""
        self.filter.process(scan.ranges)
        return Pose2D(*self._in_map(self.filter.pose).tolist())

    def kept(self) -> dict[str, int]:
        """See ``Keeps``: the particles' maps, and all scans."""
        scans = len(self.filter.history)
        if scans != self._counted[0]:
            self._counted = scans, self.filter.maps.patches()
        return {"patches": self._counted[1], "scans": scans}

    def _in_map(self, poses: np.ndarray) -> np.ndarray:
        """``poses``, which are relative to the start, in the map's frame."""
        return compose(np.array(self._start), poses)

    def _redraw(self, context: LocalizationContext) -> None:
        if self.filter.history:
            context.redraw(self._in_map(self.filter.path()))


def settings_of(context: LocalizationContext) -> SlamSettings:
    """The settings of a filter for a robot's laser, odometry and map."""
    laser, mapping = context.laser, context.map
    return SlamSettings(
        resolution_m=mapping.resolution_m,
        linear_update_m=mapping.linear_update_m, angular_update_rad=mapping.angular_update_rad,
        noise=_noise(context.odometry_errors),
        laser=laser._replace(longest_m=min(laser.longest_m, mapping.usable_range_m)),
        bodies_m=context.bodies_m)


def _noise(errors: OdometryErrors | None) -> OdometryNoise:
    """The noise between two scans: gmapping's where the errors are not known."""
    if errors is None:
        return OdometryNoise()
    if errors.drifts:  # the noise of each reading since the last processed scan adds up
        return OdometryNoise(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, errors.position_m, errors.heading_rad,
                             strayed=math.inf)
    # The noise of two readings; drawn in full (spread=1), it would become a drift.
    both = math.sqrt(2.0)
    return OdometryNoise(0.0, 0.0, 0.0, 0.0, both * errors.position_m, both * errors.heading_rad,
                         strayed=math.inf, spread=0.3)

"""Bodies of a fleet of which some move as a recording says."""

from __future__ import annotations

import numpy as np

from desim.world.bodies import PlaneBodies
from desim.world.fleet import RobotSpec
from desim.world.recorded_motion import RecordedMotion
from desim.world.terrain import Terrain


class LedBodies(PlaneBodies):
    """Bodies of which some have a path: nothing holds these. Others are pushed out of their way,
    and contacts count, at each tick where they are then."""

    def __init__(self, specs: list[RobotSpec], terrain: Terrain, tick_s: float) -> None:
        super().__init__(specs, terrain, tick_s)
        self._led = np.array([i for i, spec in enumerate(specs) if spec.path is not None])
        self._motion = RecordedMotion([spec.path for spec in specs if spec.path is not None])
        self._now_ns = 0

    def ahead(self, after_ns: int) -> np.ndarray:
        poses = super().ahead(after_ns)
        poses[self._led] = self._motion.at(self._now_ns + after_ns)[0]
        return poses

    def advance(self, now_ns: int, dt_s: float) -> list[tuple[int, int]]:
        self._now_ns = now_ns
        self._motion.go_on(now_ns)
        poses, ways_m, velocities = self._motion.at(now_ns)
        self.poses[self._led], self.velocities[self._led] = poses, 0.0
        began = super().advance(now_ns, dt_s)
        self.poses[self._led], self.velocities[self._led] = poses, velocities
        self.travelled_m[self._led] = ways_m
        return began

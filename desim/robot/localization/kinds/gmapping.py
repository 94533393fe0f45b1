"""gmapping: SLAM by a particle filter."""

from __future__ import annotations

from dataclasses import replace

from pydantic import Field

from desim.ports.localization import LocalizationContext
from desim.robot.localization.kinds.scan_matching import ScanMatching, settings_of
from desim.robot.slam.kinds import gmapping
from desim.robot.slam.settings import SlamSettings


class Gmapping(ScanMatching):
    """SLAM with the laser and the odometry by a Rao-Blackwellized particle filter (Grisetti,
    Stachniss and Burgard 2007): ``desim/robot/slam/particle_filter.py``."""

    new_filter = staticmethod(gmapping)

    class Params(ScanMatching.Params):
        """Parameters of ``gmapping``."""

        particles: int = Field(30, ge=1, le=10_000, description=(
            "hypotheses at most (gmapping's default)"))
        least_particles: int = Field(8, ge=1, le=10_000, description=(
            "hypotheses where they agree on the pose; more where they do not, by KLD sampling (Fox "
            "2003). As many as particles, or more: always particles, as in gmapping"))

    def __init__(self, params: Params) -> None:
        super().__init__(params)
        self._params = params

    def _settings(self, context: LocalizationContext) -> SlamSettings:
        return replace(settings_of(context), particles=self._params.particles,
                       least_particles=self._params.least_particles)

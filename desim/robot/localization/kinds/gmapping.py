"""gmapping: SLAM by a particle filter."""

from __future__ import annotations

from pydantic import Field

from desim.robot.localization.kinds.scan_matching import ScanMatching
from desim.robot.slam.kinds import gmapping


class Gmapping(ScanMatching):
    """SLAM with the laser and the odometry by a Rao-Blackwellized particle filter (Grisetti,
    Stachniss and Burgard 2007): ``desim/robot/slam/particle_filter.py``."""

    new_filter = staticmethod(gmapping)

    class Params(ScanMatching.Params):
        """Parameters of ``gmapping``."""

        particles: int = Field(30, ge=1, le=10_000, description="hypotheses (gmapping's default)")

    def __init__(self, params: Params) -> None:
        super().__init__(params)
        self.particles = params.particles

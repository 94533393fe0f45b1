"""Dead reckoning: the odometry is the pose."""

from __future__ import annotations

from desim import ports
from desim.ports import Pose2D
from desim.ports.localization import LocalizationContext, ScanWithOdometry


class DeadReckoning:
    """The odometry is published as the pose, as it is (dead reckoning)."""

    class Params(ports.Params):
        """None."""

    def __init__(self, params: Params) -> None:
        """``params`` are empty."""

    def start(self, context: LocalizationContext) -> None:
        """There is nothing to prepare."""

    def on_odometry(self, context: LocalizationContext, odometry: Pose2D,
                    scan: ScanWithOdometry | None) -> Pose2D:
        """The reading as it is."""
        return odometry

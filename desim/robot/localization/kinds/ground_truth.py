"""Ground truth: a sensor of the true pose."""

from __future__ import annotations

from desim import ports
from desim.errors import ModelError
from desim.ports import Pose2D
from desim.ports.localization import LocalizationContext, ScanWithOdometry


class GroundTruth:
    """A sensor that publishes the true pose (MORSE's pose sensor without noise). No other kind of
    localization reads the truth; this one reads no odometry.

    The node ``SensorPose`` (``desim/robot/localization/sensor_pose.py``) publishes its readings.
    """

    class Params(ports.Params):
        """None."""

    def __init__(self, params: Params) -> None:
        """``params`` are empty."""

    def start(self, context: LocalizationContext) -> None:
        """There is nothing to prepare."""

    def on_odometry(self, context: LocalizationContext, odometry: Pose2D,
                    scan: ScanWithOdometry | None) -> Pose2D:
        """Raises ``ModelError``: odometry is not the true pose."""
        raise ModelError("ground_truth has no pose of odometry")

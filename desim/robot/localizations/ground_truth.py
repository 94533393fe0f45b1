"""A sensor of the true pose."""

from __future__ import annotations

from desim import ports
from desim.errors import ModelError
from desim.ports import Pose2D
from desim.ports.localization import LocalizationContext, Sighting


class GroundTruth:
    """A sensor that publishes the true pose. Its readings are passed on; it is the only kind that
    reads the truth, and no odometry (MORSE's pose sensor without noise)."""

    class Params(ports.Params):
        """It has none."""

    def __init__(self, params: Params) -> None:
        """``params`` are empty."""

    def start(self, context: LocalizationContext) -> None:
        """There is nothing to prepare."""

    def on_odometry(self, context: LocalizationContext, odometry: Pose2D,
                    sighting: Sighting | None) -> Pose2D:
        """Raises ``ModelError``: odometry does not have the truth."""
        raise ModelError("ground_truth has no pose of odometry")

"""Follow: robots move as somebody has recorded it, as in a mobility trace."""

from desim import ports


class Follow:
    """The robot moves as a recording says, on straight lines from pose to pose.

    It chooses nothing, and no wall, robot or fault holds it. ``file`` is poses.csv or robots.csv of
    ``desim export RUN --csv FOLDER``, also of a recording of real robots (``desim import``), or any
    CSV with the columns time_s, robot, x_m, y_m and perhaps yaw_rad; without that a robot faces
    ahead. A robot stands at its first pose before it, and at its last one after it; ``fleet.start``
    places others alone.
    """

    class Params(ports.RecordedPaths):
        pass

    def __init__(self, params: Params) -> None:
        self.params = params

    def choose(self, context: ports.StrategyContext) -> None:
        """The robot has nowhere to go by itself."""

"""Follow: robots move as somebody has recorded it, as in a mobility trace."""

from collections.abc import Iterator

from desim import ports
from desim.scenario.schema.fleet import StartList
from desim.scenario.schema.scenario import Scenario


class Follow:
    """The robot moves as a recording says, on straight lines from pose to pose.

    It chooses nothing, and no wall, robot or fault holds it. ``file`` is poses.csv or robots.csv of
    ``desim export RUN --csv FOLDER``, also of a recording of real robots (``desim import``), or any
    CSV with the columns time_s, robot, x_m, y_m and perhaps yaw_rad; without that a robot faces
    ahead. A robot stands at its first pose before it, and at its last one after it; ``fleet.start``
    places others alone.
    """

    class Params(ports.RecordedPaths):
        def without_effect(self, scenario: Scenario) -> Iterator[ports.UnusedKeys]:
            """See ``ports.KnowsUnusedKeys``."""
            start, kinds = scenario.fleet.start, scenario.fleet.types.values()
            if (isinstance(start, StartList) and not all(pose.name for pose in start.poses)
                    and scenario.coordination.params is self
                    and not any(kind.strategy for kind in kinds)):
                yield ports.UnusedKeys(["fleet.start.poses"],
                                       "robots start where the recording begins")

    def __init__(self, params: Params) -> None:
        self.params = params

    def choose(self, context: ports.StrategyContext) -> None:
        """The robot has nowhere to go by itself."""

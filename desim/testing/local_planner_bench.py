"""A robot that drives without a simulator: the ``LocalContext`` that runs have, for a test."""

from __future__ import annotations

import numpy as np

from desim.engine.streams import Streams
from desim.ports.arguments import check_work
from desim.ports.local_planners import LocalPlanner
from desim.robot.navigation.global_costmap import GlobalCostmap
from desim.robot.navigation.moving_bodies import MovingBodies
from desim.robot.navigation.situation import Situation
from desim.scenario.schema.fleet import BodyType
from desim.scenario.schema.navigation import Navigation


class _Robot:
    """As much of a node as a ``Situation`` needs."""

    namespace = "robot_1"
    now_ns = 0

    def worked(self, **quantities: int) -> None:
        check_work(self.namespace, quantities)

    def stream(self, *name: str | int) -> np.random.Generator:
        return Streams(0)(self.namespace, *name)


class LocalPlannerBench(Situation):
    """A robot with ``planner`` on a costmap, which goes where a test puts it: ``follow`` a path,
    ``costmap.observe`` scans, ``steer``. ``is_blocked``: as of the last ``steer``."""

    def __init__(self, planner: LocalPlanner, navigation: Navigation, body: BodyType,
                 around: GlobalCostmap, moving: MovingBodies | None = None) -> None:
        super().__init__(_Robot(), navigation, body, around, moving)
        self.planner, self.is_blocked = planner, False
        planner.start(self)

    def follow(self, path: np.ndarray) -> None:
        super().follow(path)
        self.planner.on_path(self)

    def steer(self, *position: float) -> tuple[float, float, float]:
        """The next speed and turn rate, and the rest of the path, at this position."""
        x_m, y_m, yaw_rad = position
        self.position = x_m, y_m, yaw_rad
        speed_mps, turn_radps, togo_m, self.is_blocked = self.planner.steer(self)
        return speed_mps, turn_radps, togo_m

"""Connectivity: no robot goes where it would break the network (Rooker and Birk 2007)."""

import math
from collections.abc import Sequence

import numpy as np
from pydantic import Field

from desim import ports
from desim.robot.coordination.contact import Contact
from desim.robot.coordination.strategies.nearest_frontier import nearest
from desim.units import Duration, Length, Period

_STEP_M = 3.0  # between places that a robot may advance to; a door is 2 m wide and more
_BETTER_M = 2.0  # that an advance is worth the drive


class Connectivity:
    """Choose the nearest frontier at which the team stays connected. Without one, advance towards
    the nearest frontier as far as the team stays connected; if that is nowhere, stand
    (communicative exploration: Rooker and Birk 2007).

    Two robots are connected within ``range``. A team is connected if there is a chain of connected
    robots between any two. A robot that drives counts as being at its goal. Every ``period`` robots
    publish the places and goals of all robots that they know of, so that teammates out of reach are
    known through others. Places along the paths are not checked, and two robots that decide at the
    same time do not know of each other's choice. A team that could explore on only if it split up
    stands for good.

    Failsafe: a robot that hears nobody for ``failsafe_after`` drives back to the last place where
    it heard a teammate. After as long again it goes on alone as ``nearest_frontier``.
    """

    class Params(ports.Params):
        range_m: Length = Field("150 m", gt=0, description=(
            "within which robots count as connected (three quarters of the paper's 200 m)"))
        period_ns: Period = Field("1 s", description="of what robots tell (as the team's state)")
        failsafe_after_ns: Duration = Field("15 s", description=(
            "without hearing anybody: drive back (15 periods); go on alone (after twice that)"))

    def __init__(self, params: Params) -> None:
        self._params, self._contact = params, Contact()
        self._known: dict[str, tuple[int, ports.Place]] = {}  # when and where each robot ends

    def on_start(self, robot: ports.StrategyContext) -> None:
        robot.advertise("places")
        robot.subscribe("places", self._on_places)
        robot.every(self._params.period_ns, self._keep_together)

    def choose(self, robot: ports.StrategyContext) -> ports.Frontier | ports.Place | None:
        silent_ns = self._contact.silent_ns(robot)
        if silent_ns >= 2 * self._params.failsafe_after_ns:
            return nearest(robot)
        if silent_ns >= self._params.failsafe_after_ns:
            return None
        frontiers = robot.frontiers()
        robot.show("way", (ports.Mark(*one[:2], f"way {one.path_m:.0f} m"
                                      + ("" if self._keeps(one) else ", out of range"))
                           for one in frontiers))
        for frontier in frontiers:
            if self._keeps(frontier):
                return frontier
        return self._advance(robot, frontiers[0]) if frontiers else None

    def _keep_together(self, robot: ports.StrategyContext) -> None:
        """Publish all known places. Drive back if nobody is heard. A robot that stands chooses
        again, since others have moved."""
        if robot.pose is None:
            return
        end = robot.goal or ports.Place(*robot.pose[:2])
        robot.publish("places", {**self._known, robot.name: (robot.now_ns, end)})
        silent_ns, place = self._contact.silent_ns(robot), self._contact.place
        if self._params.failsafe_after_ns <= silent_ns < 2 * self._params.failsafe_after_ns:
            if place is not None and math.dist(robot.pose[:2], place) > _BETTER_M:
                robot.go(place)
        elif robot.goal is None:
            chosen = self.choose(robot)
            if chosen is not None:
                robot.go(chosen)

    def _on_places(self, robot: ports.StrategyContext, message: ports.StrategyMessage) -> None:
        for name, (time_ns, place) in message.content.items():
            if name != robot.name and time_ns > self._known.get(name, (-1,))[0]:
                self._known[name] = time_ns, ports.Place(*place)

    def _keeps(self, place: Sequence[float]) -> bool:
        """Whether the team is connected if the robot is at ``place``."""
        return connected([place[:2], *(end for _, end in self._known.values())],
                         self._params.range_m)

    def _advance(self, robot: ports.StrategyContext, frontier: ports.Frontier
                 ) -> ports.Place | None:
        """The free place with the shortest path to ``frontier`` at which the team is connected."""
        grid, pitch = robot.grid, max(1, round(_STEP_M / robot.grid.resolution_m))
        rows, columns = np.nonzero(robot.costmap()[::pitch, ::pitch] == 0)
        places = [ports.Place(grid.x_m + (column + 0.5) * grid.resolution_m,
                              grid.y_m + (row + 0.5) * grid.resolution_m)
                  for row, column in zip((rows * pitch).tolist(), (columns * pitch).tolist(),
                                         strict=True)]
        ways_m = robot.path_lengths_m(places, ports.Place(*frontier[:2]))
        for k in np.argsort(ways_m, kind="stable").tolist():
            if ways_m[k] > frontier.path_m - _BETTER_M:
                return None
            if self._keeps(places[k]):
                return places[k]
        return None


def connected(places: Sequence[Sequence[float]], range_m: float) -> bool:
    """Whether all ``places`` are joined by steps of at most ``range_m``."""
    left, reached = list(places[1:]), [places[0]]
    while reached and left:
        place = reached.pop()
        near = [other for other in left if math.dist(place, other) <= range_m]
        reached += near
        left = [other for other in left if other not in near]
    return not left

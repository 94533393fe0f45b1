"""Cyclic patrol: all robots on one closed tour, one behind the other (Chevaleyre 2004)."""

import numpy as np

from desim import ports
from desim.ports import natural_key
from desim.ports.tasks import Patrol
from desim.robot.coordination.strategies.nearest_frontier import nearest


class CyclicPatrol:
    """Drive along one tour through all places, on which the team keeps equal distances.

    The tour goes from the first place to the nearest of the others, and so on; it is then shortened
    by reversing parts of it (2-opt, Croes 1958). Robots with the same map find the same tour, so
    that they need no messages. The k-th of n robots begins at the place nearest to k/n of the
    tour's length. If a drive to a place fails, the robot leaves the place out in this round. A
    place to which there is no path although nothing is left to explore is not on the tour, until
    there is a path.
    """

    class Params(ports.Params):
        """None."""

    traits = ports.StrategyTraits(needs=Patrol)

    def __init__(self, params: Params) -> None:
        self._tour: list[ports.Place] = []
        self._next = 0

    def on_goal(self, robot: ports.StrategyContext, place: ports.Place, end: ports.GoalEnd) -> None:
        if end in (ports.GoalEnd.REACHED, ports.GoalEnd.FAILED) and place in self._tour:
            self._next = (self._tour.index(place) + 1) % len(self._tour)

    def choose(self, robot: ports.StrategyContext) -> ports.Frontier | ports.Place | None:
        places = robot.task.places
        if len(self._tour) < len(places):
            reached = [place for place, length_m in zip(places, robot.path_lengths_m(places),
                                                        strict=True) if np.isfinite(length_m)]
            if len(reached) < len(places):
                unknown = nearest(robot)
                if unknown is not None:
                    return unknown  # not all paths are known yet
            if len(reached) > len(self._tour):
                self._plan(robot, reached)
        for k in range(len(self._tour)):
            place = self._tour[(self._next + k) % len(self._tour)]
            if np.isfinite(robot.path_lengths_m([place])[0]):
                return place
        return nearest(robot)

    def _plan(self, robot: ports.StrategyContext, places: list[ports.Place]) -> None:
        """Plan a tour through ``places``, to all of which there is a path."""
        lengths_m = np.array([robot.path_lengths_m(places, place) for place in places])
        order = tour(lengths_m)
        self._tour = [places[i] for i in order]
        names = sorted((robot.name, *robot.team), key=natural_key)
        steps_m = lengths_m[order, np.roll(order, -1)]
        begins_m = np.cumsum(steps_m) - steps_m  # of each place on the tour
        own_m = names.index(robot.name) / len(names) * steps_m.sum()
        self._next = int(np.abs(begins_m - own_m).argmin())


def tour(lengths_m: np.ndarray) -> list[int]:
    """A short closed tour through all places, of ``lengths_m`` [n, n] from each to each."""
    order, left = [0], list(range(1, len(lengths_m)))
    while left:
        order.append(min(left, key=lambda place: (lengths_m[order[-1], place], place)))
        left.remove(order[-1])
    count, is_shorter = len(order), True
    while is_shorter:
        is_shorter = False
        for i in range(count - 2):
            for j in range(i + 2, count - (i == 0)):
                a, b, c, d = order[i], order[i + 1], order[j], order[(j + 1) % count]
                if lengths_m[a, c] + lengths_m[b, d] < lengths_m[a, b] + lengths_m[c, d] - 1e-9:
                    order[i + 1:j + 1] = order[i + 1:j + 1][::-1]
                    is_shorter = True
    return order

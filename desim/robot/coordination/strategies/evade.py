"""Evade: drive where pursuers are far away."""

import math

import numpy as np

from desim import ports
from desim.ports.pursuit import Pursuit, RobotSeen
from desim.robot.coordination.random_places import random_places
from desim.units import NS_PER_S

_MEMORY_NS = 5 * NS_PER_S  # age with which a pursuer is forgotten
_CANDIDATES = 12  # random places to compare


class Evade:
    """An evader that sees pursuers drives to that of some random places which it reaches before
    them with the greatest lead; with none in sight it roams. It tells nobody anything."""

    class Params(ports.Params):
        """None."""

    traits = ports.StrategyTraits(needs=Pursuit)

    def __init__(self, params: Params) -> None:
        self._pursuers: dict[str, tuple[int, ports.Place]] = {}

    def on_start(self, robot: ports.StrategyContext) -> None:
        self._draws = robot.stream("places")

    def on_task(self, robot: ports.StrategyContext, content: object) -> None:
        if isinstance(content, RobotSeen):
            self._pursuers[content.name] = robot.now_ns, content.place
            refuge = self._refuge(robot)
            if refuge is not None:
                robot.go(refuge)

    def choose(self, robot: ports.StrategyContext) -> ports.Place | None:
        return self._refuge(robot) or next(iter(self._some(robot)), None)

    def _some(self, robot: ports.StrategyContext) -> list[ports.Place]:
        return random_places(robot, self._draws, _CANDIDATES)

    def _refuge(self, robot: ports.StrategyContext) -> ports.Place | None:
        oldest_ns = robot.now_ns - _MEMORY_NS
        known = [place for seen_ns, place in self._pursuers.values() if seen_ns >= oldest_ns]
        if not known or robot.pose is None:
            return None
        places = [*filter(None, [robot.goal]), *self._some(robot)]
        if not places:
            return None
        theirs_m = np.min([[math.dist(one, place) for place in places] for one in known], axis=0)
        lead_m = theirs_m - robot.path_lengths_m(places)
        return places[int(lead_m.argmax())]

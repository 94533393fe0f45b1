"""Pursue: drive to where an evader was last seen, by oneself or by a teammate."""

import math

from desim import ports
from desim.ports.pursuit import Caught, Pursuit, RobotSeen
from desim.robot.coordination.random_places import random_places
from desim.units import NS_PER_S

_MEMORY_NS = 10 * NS_PER_S  # age with which a report is forgotten
_TRIES = 16  # random places, of which the first with a path is taken


class Pursue:
    """Pursuers drive to the evader that was seen last nearest to them, and tell each other where
    they see any; those that know of none patrol random places (the greedy policy of Vidal,
    Shakernia, Kim, Shim, Sastry 2002, without its map of probabilities).

    A place is forgotten after 10 s, and when nobody is there.
    """

    class Params(ports.Params):
        """None."""

    traits = ports.StrategyTraits(needs=Pursuit)

    def __init__(self, params: Params) -> None:
        self._seen: dict[str, tuple[int, ports.Place]] = {}  # by evader: when, where
        self._caught: set[str] = set()

    def on_start(self, robot: ports.StrategyContext) -> None:
        self._draws = robot.stream("places")
        robot.advertise("seen")
        robot.subscribe("seen", self._on_report)

    def on_task(self, robot: ports.StrategyContext, content: object) -> None:
        if isinstance(content, RobotSeen):
            self._note(robot, content.name, robot.now_ns, content.place)
            robot.publish("seen", [content.name, robot.now_ns, *content.place])
        elif isinstance(content, Caught):
            self._caught.add(content.name)
            self._seen.pop(content.name, None)

    def on_goal(self, robot: ports.StrategyContext, place: ports.Place, end: ports.GoalEnd) -> None:
        if end in (ports.GoalEnd.REACHED, ports.GoalEnd.FAILED):
            self._seen = {name: seen for name, seen in self._seen.items() if seen[1] != place}

    def choose(self, robot: ports.StrategyContext) -> ports.Place | None:
        return self._nearest_seen(robot) or next(
            iter(random_places(robot, self._draws, _TRIES)), None)

    def _on_report(self, robot: ports.StrategyContext, message: ports.StrategyMessage) -> None:
        name, seen_ns, x_m, y_m = message.content
        self._note(robot, name, seen_ns, ports.Place(x_m, y_m))

    def _note(self, robot: ports.StrategyContext, name: str, seen_ns: int, place: ports.Place
              ) -> None:
        if name in self._caught or seen_ns <= self._seen.get(name, (0, None))[0]:
            return
        self._seen[name] = seen_ns, place
        nearest = self._nearest_seen(robot)
        if nearest is not None:
            robot.go(nearest)

    def _nearest_seen(self, robot: ports.StrategyContext) -> ports.Place | None:
        oldest_ns = robot.now_ns - _MEMORY_NS
        self._seen = {name: seen for name, seen in self._seen.items() if seen[0] >= oldest_ns}
        if not self._seen or robot.pose is None:
            return None
        places = [place for _, place in self._seen.values()]
        lengths_m = robot.path_lengths_m(places)
        nearest = int(lengths_m.argmin())
        return places[nearest] if lengths_m[nearest] < math.inf else None

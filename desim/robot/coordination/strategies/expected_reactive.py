"""Expected reactive patrol: robots announce where they will be (Yan and Zhang 2016)."""

import math

from pydantic import Field

from desim import ports
from desim.ports.tasks import Patrol
from desim.robot.coordination.strategies.nearest_frontier import nearest
from desim.units import Speed


class ExpectedReactive:
    """Drive to the place whose idleness at arrival is largest per second of driving.

    Each robot publishes the place that it drives to, and when it expects to be there. Teammates
    count the place as visited at that time, unless the robot is lost. A robot that hears nobody
    counts its own visits. If no path to a place is known it explores as ``nearest_frontier``.
    """

    class Params(ports.Params):
        speed_mps: Speed = Field("0.8 m/s", gt=0, description=(
            "that robots expect of themselves (a Pioneer 3-DX at 1.2 m/s that starts and turns)"))

    traits = ports.StrategyTraits(needs=Patrol)

    def __init__(self, params: Params) -> None:
        self._speed_mps = params.speed_mps
        self._visited_ns: dict[int, int] = {}  # by anybody, as far as is known
        self._here: int | None = None  # the last place
        self._awaited: dict[str, tuple[int, int]] = {}  # teammates: place, time of arrival in ns

    def on_start(self, robot: ports.StrategyContext) -> None:
        robot.advertise("intention")
        robot.subscribe("intention", self._on_intention)

    def on_teammate(self, robot: ports.StrategyContext, name: str, heard: bool) -> None:
        if not heard:
            self._awaited.pop(name, None)

    def on_goal(self, robot: ports.StrategyContext, place: ports.Place, end: ports.GoalEnd) -> None:
        if end in (ports.GoalEnd.REACHED, ports.GoalEnd.FAILED) and place in robot.task.places:
            self._here = robot.task.places.index(place)
            self._visited_ns[self._here] = robot.now_ns

    def choose(self, robot: ports.StrategyContext) -> ports.Frontier | ports.Place | None:
        places = robot.task.places
        gains = {i: self._gain(i, length_m, robot.now_ns)
                 for i, length_m in enumerate(robot.path_lengths_m(places).tolist())
                 if length_m < math.inf and i != self._here}
        if not gains:
            return nearest(robot)
        best, (_, arrival_ns) = max(gains.items(), key=lambda one: (one[1][0], -one[0]))
        robot.publish("intention", [best, arrival_ns])
        return places[best]

    def _gain(self, place: int, length_m: float, now_ns: int) -> tuple[float, int]:
        """The idleness at arrival per time of driving, and the time of arrival."""
        way_ns = int(length_m / self._speed_mps * 1e9) + 1
        arrival_ns = now_ns + way_ns
        before_ns = max(self._visited_ns.get(place, 0), *(
            awaited_ns for other, awaited_ns in self._awaited.values() if other == place), 0)
        return (arrival_ns - before_ns) / way_ns, arrival_ns

    def _on_intention(self, robot: ports.StrategyContext, message: ports.StrategyMessage) -> None:
        place, arrival_ns = message.content
        before = self._awaited.get(message.source)
        if before is not None:  # it sets out anew: it has been there
            self._visited_ns[before[0]] = max(self._visited_ns.get(before[0], 0),
                                              min(before[1], message.sent_ns))
        self._awaited[message.source] = place, arrival_ns

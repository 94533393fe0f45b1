"""Search and report: explore, and carry what was found to the base if the network does not."""

from pydantic import Field

from desim import ports
from desim.ports.search import KnowVictim, Victim, VictimSearch
from desim.robot.coordination.looked_at import LookedAt
from desim.robot.coordination.strategies.nearest_frontier import nearest
from desim.units import NS_PER_S, Duration

_PERIOD_NS = NS_PER_S  # of reports and confirmations (as the team's state)


class SearchAndReport:
    """Robots explore as ``nearest_frontier``, then look at the squares of the map that nobody whom
    they heard of came near to. They tell each other and the base of these squares and of all
    victims that they know, so that teammates carry reports on.

    The same class runs on the robots and on a host without a body, the base, which confirms what
    it knows. Failsafe: a robot that for ``patience`` knows of a victim that the base has not
    confirmed drives back to where it started, then goes on, and comes again as long as it is not.
    """

    class Params(ports.Params):
        patience_ns: Duration | None = Field("60 s", description=(
            "time without a confirmation before a robot goes back (null: it never does)"))

    traits = ports.StrategyTraits(needs=VictimSearch, needs_coordinator=True)

    def __init__(self, params: Params) -> None:
        self._params = params
        self._known: dict[int, ports.Place] = {}
        self._confirmed: set[int] = set()
        self._since_ns: int | None = None  # it knows of a victim that is not confirmed
        self._home: ports.Place | None = None

    def on_start(self, host: ports.StrategyContext) -> None:
        self._looked = LookedAt(host.task.sees_m)
        host.advertise("known" if host.has_body else "confirmed")
        host.subscribe("known", self._on_known)
        if host.has_body:
            host.subscribe("confirmed", self._on_confirmed)
        host.every(_PERIOD_NS, self._announce)

    def on_task(self, robot: ports.StrategyContext, content: object) -> None:
        if isinstance(content, Victim):
            self._learn(robot, content.number, content.place)

    def on_goal(self, robot: ports.StrategyContext, place: ports.Place, end: ports.GoalEnd) -> None:
        if place == self._home:
            if end is ports.GoalEnd.REACHED and self._since_ns is not None:
                self._since_ns = robot.now_ns  # to search on, and to come again
        elif end is ports.GoalEnd.FAILED:
            self._looked.give_up(place)

    def choose(self, robot: ports.StrategyContext) -> ports.Frontier | ports.Place | None:
        if self._goes_home(robot):
            return self._home
        return nearest(robot) or self._looked.nearest_left(robot)

    def _learn(self, host: ports.StrategyContext, number: int, place: ports.Place) -> None:
        if number in self._known:
            return
        self._known[number] = place
        host.show("victims", (ports.Mark(*at, f"victim {k}") for k, at in self._known.items()))
        if not host.has_body:
            self._confirmed.add(number)
            host.act(KnowVictim(number))
        elif self._since_ns is None and number not in self._confirmed:
            self._since_ns = host.now_ns

    def _on_known(self, host: ports.StrategyContext, message: ports.StrategyMessage) -> None:
        self._looked.squares.update((column, row) for column, row in message.content["looked"])
        for number, x_m, y_m in message.content["victims"]:
            self._learn(host, number, ports.Place(x_m, y_m))

    def _on_confirmed(self, robot: ports.StrategyContext, message: ports.StrategyMessage) -> None:
        self._confirmed.update(message.content)
        if self._since_ns is not None and self._known.keys() <= self._confirmed:
            went, self._since_ns = self._goes_home(robot), None
            on = (nearest(robot) or self._looked.nearest_left(robot)) if went else None
            if on is not None:
                robot.go(on)

    def _announce(self, host: ports.StrategyContext) -> None:
        if not host.has_body:
            host.publish("confirmed", sorted(self._confirmed))
            return
        if host.pose is None:
            return
        place = ports.Place(*host.pose[:2])
        self._looked.visit(place)
        self._home = self._home or place
        host.publish("known", {"victims": [[number, *at] for number, at in self._known.items()
                                           if number not in self._confirmed],
                               "looked": sorted(self._looked.squares)})
        if self._goes_home(host) and host.goal != self._home:
            host.go(self._home)

    def _goes_home(self, robot: ports.StrategyContext) -> bool:
        patience_ns = self._params.patience_ns
        return (patience_ns is not None and self._since_ns is not None
                and robot.now_ns - self._since_ns >= patience_ns)

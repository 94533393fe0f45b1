"""Checks of strategies: does a class keep its contract?"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count

from desim import ports
from desim.ports.arguments import check_choice
from desim.ports.delivery import Charge, Delivery, Served, ServiceEnd, Station, TransportOrder
from desim.ports.pursuit import Caught, Pursuit, RobotSeen
from desim.ports.search import Victim, VictimSearch
from desim.ports.tasks import Formation, Journeys, Patrol, SweepingTool
from desim.robot.coordination.strategy_events import StrategyEvents
from desim.robot.team import Team
from desim.testing.advice import PluginClass, check_form, made, need
from desim.testing.checks import own_streams
from desim.testing.shared_state import own_state
from desim.testing.strategy_bench import StrategyBench
from desim.units import NS_PER_S

_LOST_AFTER_NS = 5 * NS_PER_S
_ROUNDS = 10  # of a second each
_PATROL = Patrol((ports.Place(4.0, 0.0), ports.Place(-8.0, 3.0), ports.Place(2.0, 12.0)))
_STATIONS = Delivery((Station("shelf", "pick", ports.Place(4.0, 0.0)),
                      Station("dock", "drop", ports.Place(-8.0, 3.0)),
                      Station("plug", "charge", ports.Place(0.5, 0.0))), 2.0)
_JOURNEYS = Journeys({"robot_1": _PATROL.places[:2], "robot_2": _PATROL.places[1:]}, 1.0)
_FORMATION = Formation("robot_2", _PATROL.places, {"robot_1": (-2.0, 2.0)}, 0.5)
_BRIEFINGS: dict[type, object] = {
    Patrol: _PATROL, Delivery: _STATIONS, Journeys: _JOURNEYS, SweepingTool: SweepingTool(1.0),
    VictimSearch: VictimSearch(3.0), Formation: _FORMATION,
    Pursuit: Pursuit(("robot_2",), 8.0, 1.5)}
_NEWS: dict[type, tuple[object, ...]] = {  # of tasks, what happens on the spot
    VictimSearch: (Victim(3, ports.Place(4.0, 0.0)), Victim(0, ports.Place(-8.0, 3.0))),
    Pursuit: (RobotSeen("robot_2", ports.Place(4.0, 0.0)),
              RobotSeen("robot_10", ports.Place(-8.0, 3.0)), Caught("robot_2"))}
_EARLY = [ports.Frontier(4.0, 0.0, 4.0, 12), ports.Frontier(0.0, 9.0, 11.0, 80),
          ports.Frontier(-30.0, 2.0, 45.0, 7)]
_LATE = [ports.Frontier(5.0, 1.0, 5.5, 30), *_EARLY[1:]]  # somebody has explored the nearest


def check_strategy(cls: PluginClass[ports.Strategy], briefing: object = None,
                   **params: object) -> None:
    """Check a ``ports.Strategy``: it takes one of the frontiers that it is shown, a ``Place`` where
    the robot can be or None, also where the map comes late and changes, takes the same ones in the
    same situation, keeps its state in ``self``, and goes on when every message is lost, when
    messages come late or twice, when teammates are lost and come back, when they answer at once,
    and when there is no frontier left. ``briefing`` of its task; where a ``Patrol`` is needed, one
    of three places, where a ``Delivery`` is, one of three stations, whose services end in every
    way; and likewise for the briefings of all tasks that come with desim. What a run would refuse
    raises the ``ModelError`` of the run."""
    check_form("strategy", cls, params)
    needs = ports.StrategyTraits.of(cls).needs
    if briefing is None:
        briefing = _BRIEFINGS.get(needs)
    need(isinstance(briefing, needs), cls,
         f"be checked with the briefing that it needs: check_strategy(..., briefing={needs}(...))")
    with own_streams(cls), own_state(cls):
        choices = [_Play(cls, params, briefing).played() for _ in range(2)]
        with _situation("two robots receive each other's messages at once"):
            _talk([_Play(cls, params, briefing, name) for name in ("robot_1", "robot_2")])
    need(choices[0] == choices[1], cls, f"choose alike in like situations, got {choices}")


@contextmanager
def _situation(words: str) -> Iterator[None]:
    """Add the situation to an error that is raised in it."""
    try:
        yield
    except Exception as error:
        error.add_note(f"in check_strategy: {words}")
        raise


class _Play:
    """A robot and its team: what happens to them, one thing after the other."""

    def __init__(self, cls: PluginClass[ports.Strategy], params: dict[str, object],
                 briefing: object, name: str = "robot_1") -> None:
        self._cls, self._strategy = cls, made(cls, params)
        others = tuple(other for other in ("robot_1", "robot_2", "robot_10", "base")
                       if other != name)
        self._bench = StrategyBench([], name, others,
                                    team_state=ports.StrategyTraits.of(cls).reads_team_state)
        self._bench.task = briefing
        self._team = Team(others, _LOST_AFTER_NS)
        self._events = StrategyEvents(self._strategy, self._bench, self._team)
        self._said = 0  # messages that ``news`` has given
        self._choices: list[object] = []
        self._version = 0  # of the map

    def played(self) -> list[object]:
        """All choices, and all goals that the strategy set by itself."""
        bench, pose = self._bench, self._bench.pose
        bench.pose, bench.peers, bench.heard = None, {}, {}  # there is no map and no pose yet
        with _situation("there is no map and no pose yet"):
            self._events.started()
            for _ in range(3):
                bench.now_ns += NS_PER_S
                bench.run_timers()
        bench.pose = pose
        with _situation("there is a map, and every message is lost"):
            self._map(_EARLY)
            self._go_on(_ROUNDS)
        sent = list(bench.published)
        self._map(_LATE)
        with _situation("messages come late and twice, as if robot_2 had sent them"):
            for message in sent * 2:
                self._team.spoke("robot_2", bench.now_ns)
                bench.hear("robot_2")
                bench.deliver(message._replace(source="robot_2"))
                self._go_on(1)
        for seconds, what in ((_ROUNDS, "is lost"), (1, "comes back")):
            with _situation(f"robot_2 {what}"):
                bench.hear("robot_2")
                self._team.spoke("robot_2", bench.now_ns)
                self._go_on(seconds)
        for end in ports.GoalEnd:
            with _situation(f"a drive has ended: {end}"):
                self._events.goal_ended(ports.Place(4.0, 0.0), end)
                self._go_on(1)
        for content in _NEWS.get(type(bench.task), ()):
            with _situation(f"the task says {content}"):
                self._events.notified(content)
                self._go_on(2)
        if self._bench.task is _STATIONS:
            self._be_served()
        with _situation("no frontier is left"):
            self._map([])
            self._go_on(2)
        return [*self._choices, *bench.goals]

    def _be_served(self) -> None:
        """Orders arrive, the robot gets to each station, and is served or not."""
        bench = self._bench
        for number in range(3):
            self._events.notified(TransportOrder(number, "shelf", "dock"))
            self._go_on(1)
        for share in (0.5, 0.1, 1.0):
            with _situation(f"{share:.0%} of the battery are left"):
                self._events.notified(Charge(share))
                self._go_on(1)
        for outcome in ServiceEnd:
            for station in _STATIONS.stations:
                with _situation(f"a service at {station.name} has ended: {outcome}"):
                    bench.pose = ports.Pose2D(*station.place, 0.0)
                    self._go_on(2)
                    self._events.notified(Served(station.name, 1, outcome))
        self._choices.append(list(bench.acts))

    # ------------------------------------------------------------------------- with a second robot

    def start(self) -> None:
        """It begins, and sees a map."""
        self._bench.peers, self._bench.heard = {}, {}
        self._events.started()
        self._map(_EARLY)

    def second(self, other: str) -> None:
        """A second goes by, in which the ``other`` robot is heard."""
        self._bench.hear(other)
        self._team.spoke(other, self._bench.now_ns)
        self._go_on(1)

    def news(self) -> list[ports.StrategyMessage]:
        """The messages that it has published since the last call."""
        found = self._bench.published[self._said:]
        self._said += len(found)
        return found

    def hear(self, messages: list[ports.StrategyMessage], answers: int) -> None:
        """Messages arrive, at the end of so many ``answers``."""
        self._bench.answers = answers
        for message in messages:
            self._bench.deliver(message)
        self._bench.answers = 0

    # ------------------------------------------------------------------------------------------

    def _map(self, frontiers: list[ports.Frontier]) -> None:
        """The map has changed."""
        self._bench.known = frontiers
        self._version += 1

    def _go_on(self, seconds: int) -> None:
        bench = self._bench
        for _ in range(seconds):
            bench.now_ns += NS_PER_S
            bench.run_timers()
            self._events.tick(bench.now_ns, self._version)
            try:
                chosen = self._strategy.choose(bench)
            except (IndexError, ValueError) as error:
                need(bench.known, self._cls, "return None when there is no frontier; choose raised "
                                             f"{type(error).__name__}: {error}")
                raise
            need(not isinstance(chosen, ports.Frontier) or chosen in bench.known, self._cls,
                 f"return one of frontiers(), a Place or None, not {chosen!r}")
            check_choice(self._strategy, chosen, bench.known, bench.is_free)
            self._choices.append(chosen)


def _talk(robots: list[_Play]) -> None:
    """Two robots hear each other at once. They have all said what they have to say when the next
    second begins."""
    one, other = robots
    for robot in robots:
        robot.start()
    for _ in range(_ROUNDS):
        one.second("robot_2")
        other.second("robot_1")
        for answers in count():
            said, answered = one.news(), other.news()
            if not said and not answered:
                break
            other.hear(said, answers)
            one.hear(answered, answers)

"""Checks of strategies: does a class keep its contract?"""

from __future__ import annotations

from desim import ports
from desim.ports.tasks import Patrol
from desim.robot.coordination.strategy_events import StrategyEvents
from desim.robot.team import Team
from desim.testing.advice import PluginClass, check_form, made, need
from desim.testing.checks import own_streams
from desim.testing.strategy_bench import StrategyBench
from desim.units import NS_PER_S

_LOST_AFTER_NS = 5 * NS_PER_S
_ROUNDS = 10  # of a second each
_PATROL = Patrol((ports.Place(4.0, 0.0), ports.Place(-8.0, 3.0), ports.Place(2.0, 12.0)))


def check_strategy(cls: PluginClass[ports.Strategy], briefing: object = None,
                   **params: object) -> None:
    """Check a ``ports.Strategy``: it takes one of the frontiers that it is shown, or None when
    there is none, takes the same one when asked again, and goes on when every message is lost, when
    messages come late or twice, and when teammates are lost and come back. ``briefing`` of its
    task; a strategy that ``needs`` a ``Patrol`` has one of three places without."""
    check_form("strategy", cls, params)
    needs = getattr(cls, "needs", None)
    if needs is Patrol and briefing is None:
        briefing = _PATROL
    need(needs is None or isinstance(briefing, needs), cls,
         f"be checked with the briefing that it needs: check_strategy(..., briefing={needs}(...))")
    frontiers = [ports.Frontier(4.0, 0.0, 4.0, 12), ports.Frontier(0.0, 9.0, 11.0, 80),
                 ports.Frontier(-30.0, 2.0, 45.0, 7)]
    with own_streams(cls):
        try:
            chosen, raised = _play_strategy(cls, params, [], briefing)[-1], ""
        except (IndexError, ValueError) as error:
            chosen, raised = None, f"; choose raised {type(error).__name__}: {error}"
        need(not raised and (chosen is None or briefing is not None), cls,
             f"return None when there is no frontier{raised}")
        choices = [_play_strategy(cls, params, frontiers, briefing) for _ in range(2)]
    strange = [one for one in choices[0] if not (one is None or one in frontiers
                                                 or isinstance(one, ports.Place))]
    need(not strange, cls, f"return one of frontiers(), a Place or None, not {strange[:1]}")
    need(choices[0] == choices[1], cls, f"choose alike in like situations, got {choices}")


def _play_strategy(cls: PluginClass[ports.Strategy], params: dict[str, object],
                   frontiers: list[ports.Frontier], briefing: object) -> list[object]:
    """All choices of a strategy: at first, while nobody is heard, when what it sent comes back from
    a teammate, late and twice, and when the teammate is lost and comes back."""
    strategy, bench = made(cls, params), StrategyBench(frontiers)
    bench.task = briefing
    team = Team(bench.team, _LOST_AFTER_NS)
    events = StrategyEvents(strategy, bench, team)
    choices: list[object] = []

    def go_on() -> None:
        bench.now_ns += NS_PER_S
        bench.run_timers()
        events.tick(bench.now_ns, bench.now_ns)
        choices.append(strategy.choose(bench))

    events.started()
    choices.append(strategy.choose(bench))
    for _ in range(_ROUNDS):  # every message is lost
        go_on()
    for message in bench.published * 2:  # they come after all, twice, from a teammate
        team.spoke("robot_2", bench.now_ns)
        bench.deliver(message._replace(source="robot_2"))
        go_on()
    for _ in range(_ROUNDS):  # who is lost again
        go_on()
    for end in ports.GoalEnd:
        events.goal_ended(ports.Place(4.0, 0.0), end)
        go_on()
    return [*choices, *bench.goals]

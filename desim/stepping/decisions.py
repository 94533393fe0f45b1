"""The decisions at which a stepped run pauses: goals, or turns at a period."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeVar

from desim import ports
from desim.ports import Frontier, Place, Starts, Strategy, StrategyContext

_EVENTS = "on_goal", "on_map", "on_teammate"


class Decision:
    """A robot is at work, and the run stands still. Through ``context`` it can be seen and made to
    act, as by a strategy."""

    def __init__(self, context: StrategyContext) -> None:
        self.context = context

    @property
    def robot(self) -> str:
        """The robot's name."""
        return self.context.name


class GoalDecision(Decision):
    """A robot needs a goal. Unless somebody chooses one, its own strategy does."""

    def __init__(self, context: StrategyContext, own: Strategy) -> None:
        super().__init__(context)
        self._strategy = own
        self._own: list[Frontier | Place | None] = []  # once it was asked
        self._chosen: list[Frontier | Place | None] = []  # once somebody chose

    def own(self) -> Frontier | Place | None:
        """The choice of the scenario's own strategy, which is asked at the first call, and may
        speak to its team then."""
        if not self._own:
            self._own.append(self._strategy.choose(self.context))
        return self._own[0]

    def choose(self, goal: Frontier | Place | None) -> None:
        """Choose ``goal`` as ``Strategy.choose`` would."""
        self._chosen = [goal]

    def answer(self) -> Frontier | Place | None:
        """The goal that was chosen, or else the strategy's."""
        return self._chosen[0] if self._chosen else self.own()


D_co = TypeVar("D_co", bound=Decision, covariant=True)


class Decisions(Protocol[D_co]):
    """The points of a run at which it pauses."""

    def strategy(self, own: Strategy, pause: Callable[[D_co], object]) -> Strategy:
        """A strategy that calls ``pause`` at each decision. ``own``: that of the scenario."""


class Accompanied:
    """A strategy in whose place another one is called, for the same events."""

    Params = ports.Params

    def __init__(self, own: Strategy) -> None:
        self._own = own
        for name in _EVENTS:
            if hasattr(own, name):
                setattr(self, name, getattr(own, name))

    def on_start(self, context: StrategyContext) -> None:
        if isinstance(self._own, Starts):
            self._own.on_start(context)

    def choose(self, context: StrategyContext) -> Frontier | Place | None:
        return self._own.choose(context)


class Goals:
    """Pauses whenever a robot's strategy is asked for a goal."""

    def strategy(self, own: Strategy, pause: Callable[[GoalDecision], object]) -> Strategy:
        return _AskedForGoals(own, pause)


class _AskedForGoals(Accompanied):
    def __init__(self, own: Strategy, pause: Callable[[GoalDecision], object]) -> None:
        super().__init__(own)
        self._pause = pause

    def choose(self, context: StrategyContext) -> Frontier | Place | None:
        decision = GoalDecision(context, self._own)
        self._pause(decision)
        return decision.answer()


class Turns:
    """Pauses every ``period_ns`` of each robot, whose phase is its own, drawn by name. Beside that
    the scenario's own strategy goes on."""

    def __init__(self, period_ns: int) -> None:
        self.period_ns = period_ns

    def strategy(self, own: Strategy, pause: Callable[[Decision], object]) -> Strategy:
        return _TakesTurns(own, self.period_ns, pause)


class _TakesTurns(Accompanied):
    def __init__(self, own: Strategy, period_ns: int, pause: Callable[[Decision], object]) -> None:
        super().__init__(own)
        self._period_ns, self._pause = period_ns, pause

    def on_start(self, context: StrategyContext) -> None:
        super().on_start(context)
        context.every(self._period_ns, self.turn)

    def turn(self, context: StrategyContext) -> None:
        """It is the robot's turn."""
        self._pause(Decision(context))


class ControlPeriods(Turns):
    """Pauses as ``Turns``. No strategy sets goals: robots ``drive`` as they are commanded."""

    def strategy(self, own: Strategy, pause: Callable[[Decision], object]) -> Strategy:
        return _TakesTurns(Undecided(), self.period_ns, pause)


class Undecided:
    """A strategy without goals."""

    Params = ports.Params

    def choose(self, context: StrategyContext) -> None:
        """There is nothing to do."""

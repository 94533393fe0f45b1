"""A run that a program takes step by step: to a time, or to a robot's next decision."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Generic, Self, TypeVar

from desim.api import loaded, located
from desim.blame import blame
from desim.engine.garbage import rare_collections
from desim.errors import InputError, ModelError
from desim.ports import Strategy, StrategyContext
from desim.scenario.load import Loaded
from desim.scenario.schema.scenario import Scenario
from desim.simulation.simulation import Outcome, Simulation
from desim.stepping.baton import Baton
from desim.stepping.decisions import Accompanied, Decision, Decisions, Goals
from desim.units import NS_PER_S

D = TypeVar("D", bound=Decision)

_GOALS = Goals()
_AT_ONCE_NS = NS_PER_S  # what the kernel runs before it looks whether it shall hurry


class Stepper(Generic[D]):
    """The ordinary run of ``scenario`` (loaded, or a file with ``overrides`` and ``seed`` as
    ``desim.load`` takes them), which pauses where its caller wants.

    It may pause at ``decisions`` of robots: ``Goals()``, ``Turns(period_ns)`` or
    ``ControlPeriods(period_ns)``. A run that is only looked at, and whose decisions are those of
    its own strategies, has the digest of the run without steps. (A context's searches are no mere
    look: frontiers, lengths of paths, gains and the costmap bring the robot's costmap up to date,
    by which it also drives.) No folder of results is kept. Raises as ``desim.run``; an error of
    the run ends it. Close it, or use it as a context manager.
    """

    def __init__(self, scenario: Loaded | Scenario | str | Path,
                 # mypy has no default for D, which is a GoalDecision then.
                 decisions: Decisions[D] = _GOALS, *,  # type: ignore[assignment]
                 overrides: Sequence[str] = (), seed: int | None = None) -> None:
        place, scenario = loaded(scenario, overrides, seed)
        self._decisions, self._contexts = decisions, dict[str, StrategyContext]()
        self._decision: D | None = None  # at which it pauses
        self._pauses = False  # at the next one
        self._until_ns = 0
        self._baton = Baton(self._live, self._hurry)
        with located(place):
            self.simulation = Simulation(scenario, pilot=self._piloted)
            self.simulation.graph.start()
        self._limit_ns = scenario.stop.elapsed_ns

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def now_ns(self) -> int:
        """The time."""
        return self.simulation.kernel.now_ns

    @property
    def is_over(self) -> bool:
        """Whether a stop condition of the scenario was met, or the run was closed or failed."""
        return (self.simulation.monitor.stop_reason is not None or self._limit_ns < 0
                or self.now_ns >= self._limit_ns)

    @property
    def robots(self) -> Mapping[str, StrategyContext]:
        """The robots by name, with what each of them knows, and its actions. A robot whose host
        stopped keeps its last one."""
        return MappingProxyType(self._contexts)

    def step_to(self, time_ns: int) -> None:
        """Go on to ``time_ns``, complete with all that happens then, or to the end of the run.
        Where robots decide on the way, nobody is asked. Raises ``InputError`` for a time in the
        past."""
        self._pauses = False
        self._step(time_ns)

    def next_decision(self, until_ns: int | None = None) -> D | None:
        """Go on to the next decision and return it; it is taken at the next step. None: there is
        none up to ``until_ns`` or the end of the run, where it pauses then."""
        self._pauses = True
        self._step(max(self._limit_ns, self.now_ns) if until_ns is None else until_ns)
        return self._decision

    def finish(self) -> Outcome:
        """Close the run as it is now. Its last decision is taken first."""
        self.step_to(self.now_ns)
        outcome = self.simulation.outcome()
        self.close()
        return outcome

    def close(self) -> None:
        """End the run where it is. A second call changes nothing."""
        self._limit_ns, self._decision = -1, None
        self._baton.drop()

    def _step(self, until_ns: int) -> None:
        if type(until_ns) is not int or until_ns < self.now_ns:
            raise InputError(f"a step goes to an int of ns, {self.now_ns} or later, not to "
                             f"{until_ns!r}")
        if self.is_over and self._decision is None:
            return
        self._until_ns = min(until_ns, self._limit_ns)
        try:
            with rare_collections():
                self._baton.lend()
        except (Exception, SystemExit) as error:
            self.close()
            if isinstance(error, SystemExit):
                error = ModelError("sys.exit() was called").with_traceback(error.__traceback__)
            error.add_note(blame(error).line)
            raise error

    def _live(self) -> None:
        """The second thread runs this."""
        kernel = self.simulation.kernel
        while True:
            while kernel.now_ns < self._until_ns and not self.is_over:
                kernel.run(min(self._until_ns, kernel.now_ns + _AT_ONCE_NS))
            self._baton.give()

    def _hurry(self) -> None:
        self._until_ns = 0

    def _piloted(self, robot: str, own: Strategy) -> Strategy:
        return _Introduced(self._decisions.strategy(own, self._pause), self._contexts)

    def _pause(self, decision: D) -> None:
        if self._pauses:
            self.simulation.kernel.stop()  # when this instant is complete
            self._decision = decision
            self._baton.give()
            self._decision = None


class _Introduced(Accompanied):
    """A strategy that enters its context in ``contexts`` when it starts."""

    def __init__(self, own: Strategy, contexts: dict[str, StrategyContext]) -> None:
        super().__init__(own)
        self._contexts = contexts

    def on_start(self, context: StrategyContext) -> None:
        self._contexts[context.name] = context
        super().on_start(context)

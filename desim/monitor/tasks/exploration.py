"""Exploration: the terrain is to be known (Yan, Fabresse, Laval, Bouraqadi 2017, section 3.3)."""

from __future__ import annotations

from desim import ports
from desim.monitor.coverage import EXPLORED, Reached
from desim.ports.tasks import TaskContext
from desim.units import NS_PER_S

DONE = "explored"  # the reason of a run's end


class Exploration:
    """Learn the terrain: done when ``stop.explored`` of its free cells are known to ``stop.by``,
    and never with ``stop.by: none``."""

    class Params(ports.Params):
        """None."""

    leads = ("exploration_time_s",)

    def __init__(self, params: Params) -> None:
        self.params = params

    def start(self, context: TaskContext) -> None:
        knowledge = context.knowledge
        self._context = context
        reached = {share: Reached(knowledge.cells_for(share), len(context.explorers))
                   for share in (EXPLORED, context.stop_explored)}
        self._explored, self._enough = reached[EXPLORED], reached[context.stop_explored]
        self._reached = tuple(reached.values())  # the two, or the one that is both

    def on_knowledge(self, context: TaskContext, explorer: int) -> None:
        known, union_known = context.knowledge.known[explorer], context.knowledge.union_known
        now_ns = context.now_ns
        for reached in self._reached:
            reached.update(explorer, known, union_known, now_ns)
        if self._enough.first_ns.get(context.stop_by) is not None:
            context.end(DONE)

    def judged(self) -> int | None:
        """The first to know 99 %."""
        return self._explored.first_robot

    def metrics(self) -> dict[str, object]:
        """Times count from when the first robot's software started (3.3.1). They are None where the
        instant was not reached: the run is censored."""
        context = self._context
        first_s = {name: None if instant_ns is None else
                   (instant_ns - context.started_ns) / NS_PER_S
                   for name, instant_ns in self._explored.first_ns.items()}
        return {"censored": first_s["any"] is None,
                "exploration_time_s": first_s["any"],
                "union_time_s": first_s["union"],
                "fleet_time_s": first_s["all"]}

"""Journeys: each robot has to get to places of its own (multi-agent path finding)."""

from __future__ import annotations

import math
from itertools import chain

from pydantic import Field

from desim import ports
from desim.errors import InputError
from desim.monitor.moving_ai_goals import goals_of
from desim.monitor.places import drawn, free_cells
from desim.ports.tasks import Journeys, TaskContext, TaskTraits
from desim.units import LENGTH, NS_PER_S

_SAMPLE_NS = NS_PER_S // 10
_WITHIN_M, _CLEARANCE_M = 1.0, 0.8  # as of a patrol


class ManyJourneys:
    """Get to places in turn, each robot to its own; done when all robots have been at all of
    theirs. Robots know the map of the terrain."""

    class Params(ports.Params):
        goals: int = Field(1, ge=1, le=10_000, description=(
            "of each robot; where no file has them, drawn from the free space, those of all robots "
            "that have the same number far apart"))
        file: ports.File | None = Field(None, description=(
            "a scenario of the MovingAI benchmarks (.scen): the k-th line has the goal of the k-th "
            "robot, in cells of 1 m; with more goals, the next lines have the next ones"))

    leads = ("goals_reached", "makespan_s")
    traits = TaskTraits(gives=Journeys, quantities=("goals_reached",))

    def __init__(self, params: Params) -> None:
        self._params = params

    def start(self, context: TaskContext) -> None:
        self._context, names = context, context.explorers
        self._robots = [context.robots.index(name) for name in names]
        count = len(names) * self._params.goals
        starts_m = context.poses()[self._robots, :2]
        if self._params.file:
            places = goals_of(self._params.file, count, context.ground)
        else:
            cells_m = free_cells(context.ground, starts_m, _CLEARANCE_M)
            if len(cells_m) < len(names):
                raise InputError(f".goals: there are {len(cells_m)} places that are "
                                 f"{LENGTH.format(_CLEARANCE_M)} away from walls, not {len(names)}")
            stream = context.stream("goals")
            places = tuple(chain.from_iterable(drawn(cells_m, len(names), stream)
                                               for _ in range(self._params.goals)))
        self._journeys = Journeys({name: places[k::len(names)] for k, name in enumerate(names)},
                                  _WITHIN_M)
        self._reached_ns: dict[str, list[int]] = {name: [] for name in names}
        context.every(_SAMPLE_NS, self._sample)

    def briefing(self) -> Journeys:
        return self._journeys

    def gives_map(self) -> bool:
        """Robots know the terrain."""
        return True

    def measure(self) -> dict[str, float]:
        return {"goals_reached": sum(map(len, self._reached_ns.values()))}

    def metrics(self) -> dict[str, object]:
        """``makespan_s`` is None until all goals are reached; ``sum_of_costs_s``: the sum over
        robots of the times of their last goals."""
        whole = [times_ns[-1] for times_ns in self._reached_ns.values()
                 if len(times_ns) == self._params.goals]
        is_done = len(whole) == len(self._robots)
        reached = sum(map(len, self._reached_ns.values()))
        return {"goals": len(self._robots) * self._params.goals, "goals_reached": reached,
                "goals_per_hour": reached * 3600 * NS_PER_S / max(self._context.now_ns, 1),
                "makespan_s": max(whole) / NS_PER_S if is_done and whole else None,
                "sum_of_costs_s": sum(whole) / NS_PER_S if is_done and whole else None}

    def _sample(self, context: TaskContext) -> None:
        poses = context.poses()[self._robots, :2].tolist()
        for name, at_m in zip(context.explorers, poses, strict=True):
            reached_ns, goals = self._reached_ns[name], self._journeys.goals[name]
            if len(reached_ns) < len(goals) and \
                    math.dist(at_m, goals[len(reached_ns)]) <= _WITHIN_M:
                context.record("arrived", name, len(reached_ns))
                reached_ns.append(context.now_ns)
        if all(len(times_ns) == self._params.goals for times_ns in self._reached_ns.values()):
            context.end("arrived")

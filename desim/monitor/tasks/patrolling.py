"""Patrolling: places are to be visited again and again.

The idleness of a place is the time since anybody was last there; at the start it is 0 everywhere.
Measures: Machado, Ramalho, Zucker, Drogoul 2002 (mean over places and time, worst ever); Portugal
and Rocha 2013 (mean interval between the visits of a place).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import numpy as np
from pydantic import Field

from desim import plugins, ports
from desim.monitor.places import drawn, free_cells, given
from desim.ports.tasks import Patrol, TaskContext, TaskTraits
from desim.scenario.schema.scenario import Scenario
from desim.units import NS_PER_S, Length, Position

_SAMPLE_NS = NS_PER_S // 10


class Patrolling:
    """Visit places so that none is unvisited for long. A robot visits a place by coming near."""

    class Params(ports.Params):
        places: tuple[tuple[Position, Position], ...] | None = Field(
            None, min_length=1, description="x, y of each (null: drawn from the free space)")
        drawn: int = Field(8, ge=1, le=10_000, description="so many are drawn where none are given")
        within_m: Length = Field("1 m", gt=0, description=(
            "a robot that is so near to a place visits it (a robot and its surroundings)"))
        clearance_m: Length = Field("0.8 m", description=(
            "of places that are drawn, and of a way there, from walls (the inflation radius of "
            "costmap_2d, 0.55 m, and some)"))
        map: Literal["known", "unknown"] = Field("known", description=(
            "known: every robot has the map of the terrain from the start, as the literature has "
            "it; unknown: robots find their ways"))
        rounds: int | None = Field(None, ge=1, description=(
            "done when each place was visited so often (null: when stop says so)"))

        def without_effect(self, scenario: Scenario) -> Iterator[ports.UnusedKeys]:
            """See ``ports.KnowsUnusedKeys``."""
            if self.places:
                yield ports.UnusedKeys(ports.changed_keys(self, "drawn", "clearance_m"),
                                       "task.places are given, and none is drawn")
            yield ports.UnusedKeys(
                [f"stop{key}" for key in ports.changed_keys(scenario.stop, "explored", "by")],
                "they end the task exploration, and the task is "
                f"{plugins.bare(scenario.task.model)}")

    leads = ("idleness_mean_s", "idleness_worst_s")
    traits = TaskTraits(gives=Patrol, quantities=("idleness_s", "idleness_worst_s", "visits"))

    def __init__(self, params: Params) -> None:
        self._params = params

    def start(self, context: TaskContext) -> None:
        self._context, params = context, self._params
        self._patrol = Patrol(given(context.ground, params.places) if params.places else drawn(
            free_cells(context.ground, context.poses()[:, :2], params.clearance_m),
            params.drawn, context.stream("places")))
        count = len(self._patrol.places)
        self._at_m = np.array(self._patrol.places)
        self._robots = [context.robots.index(name) for name in context.explorers]
        self._last_ns = [0] * count  # somebody was there
        self._visited = [False] * count  # by somebody who is still there
        self._visits, self._visits_of = [0] * count, [0] * len(self._robots)
        self._alone_ns = [0] * count  # the sum of the intervals that a visit ended
        self._area_ns2, self._worst_ns = 0, 0  # of these: integral of idleness, the longest
        context.every(_SAMPLE_NS, self._sample)

    def briefing(self) -> Patrol:
        return self._patrol

    def gives_map(self) -> bool:
        return self._params.map == "known"

    def unvisited(self) -> list[int]:
        """The indices of the places that nobody has visited."""
        return [place for place, visits in enumerate(self._visits) if not visits]

    def measure(self) -> dict[str, float]:
        """``idleness_s`` is the present mean over places."""
        idle_ns = self._idle_ns()
        return {"idleness_s": sum(idle_ns) / len(idle_ns) / NS_PER_S,
                "idleness_worst_s": max(self._worst_ns, *idle_ns) / NS_PER_S,
                "visits": sum(self._visits)}

    def metrics(self) -> dict[str, object]:
        count, area_ns2 = len(self._visits), self._area_ns2 + sum(map(_area_ns2, self._idle_ns()))
        of_place_ns = [alone_ns / visits for alone_ns, visits in
                       zip(self._alone_ns, self._visits, strict=True) if visits]
        return {"idleness_mean_s": area_ns2 / count / max(self._context.now_ns, 1) / NS_PER_S,
                "idleness_worst_s": self.measure()["idleness_worst_s"],
                "interval_mean_s": (sum(of_place_ns) / len(of_place_ns) / NS_PER_S
                                    if of_place_ns else None),
                "places": count, "visits": sum(self._visits), "rounds": min(self._visits),
                "visits_by_place": list(self._visits), "visits_by_robot": list(self._visits_of)}

    def _sample(self, context: TaskContext) -> None:
        away_m = context.poses()[self._robots, None, :2] - self._at_m
        near = np.hypot(away_m[..., 0], away_m[..., 1]) <= self._params.within_m
        before, self._visited = self._visited, near.any(axis=0).tolist()
        for place in np.flatnonzero(self._visited).tolist():
            idle_ns = context.now_ns - self._last_ns[place]
            self._last_ns[place] = context.now_ns
            if not before[place]:
                visitor = int(near[:, place].argmax())
                context.record("visit", context.explorers[visitor], place, idle_ns)
                self._visits[place] += 1
                self._visits_of[visitor] += 1
                self._alone_ns[place] += idle_ns
                self._area_ns2 += _area_ns2(idle_ns)
                self._worst_ns = max(self._worst_ns, idle_ns)
        if self._params.rounds is not None and min(self._visits) >= self._params.rounds:
            context.end("patrolled")

    def _idle_ns(self) -> list[int]:
        return [self._context.now_ns - last_ns for last_ns in self._last_ns]


def _area_ns2(idle_ns: int) -> int:
    """The integral of an idleness that grew from 0 as time does."""
    return idle_ns * idle_ns // 2

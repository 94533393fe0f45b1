"""Search: victims are to be found, and to be reported to a base."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from desim import ports
from desim.errors import ModelError
from desim.monitor.places import drawn, free_cells, given, unobstructed
from desim.monitor.times import mean_s
from desim.ports.search import KnowVictim, Victim, VictimSearch
from desim.ports.tasks import TaskContext, TaskTraits
from desim.units import NS_PER_S, Length, Position

_SAMPLE_NS = NS_PER_S // 5
_DRAWN = 5


class Searching:
    """Find victims and report them: done when the base, a host without a body that runs a strategy,
    knows of all; without one, when all are seen. A robot sees a victim that is near and behind no
    wall."""

    class Params(ports.Params):
        places: tuple[tuple[Position, Position], ...] | None = Field(
            None, min_length=1, description="x, y of each (null: five, drawn from the free space)")
        sees_m: Length = Field("3 m", gt=0, description=(
            "a robot sees a victim up to so far (a camera that recognises a person)"))

    leads = ("victims_reported", "report_worst_s")
    traits = TaskTraits(gives=VictimSearch, quantities=("victims_seen", "victims_reported"))

    def __init__(self, params: Params) -> None:
        self._params = params

    def start(self, context: TaskContext) -> None:
        self._context, params = context, self._params
        self._victims = given(context.ground, params.places) if params.places else drawn(
            free_cells(context.ground, context.poses()[:, :2], context.radius_m), _DRAWN,
            context.stream("victims"))
        self._robots = [context.robots.index(name) for name in context.explorers]
        self._sees = np.zeros((len(self._robots), len(self._victims)), bool)  # so far
        self._seen_ns: dict[int, int] = {}
        self._reported_ns: dict[int, int] = {}
        context.every(_SAMPLE_NS, self._sample)

    def briefing(self) -> VictimSearch:
        return VictimSearch(self._params.sees_m)

    def on_act(self, context: TaskContext, host: str, content: object) -> None:
        if not isinstance(content, KnowVictim) or host not in context.desks:
            raise ModelError(f"{host} cannot do {content!r}; allowed: KnowVictim, by hosts without "
                             "a body")
        if content.number not in self._seen_ns:
            raise ModelError(f"{host} knows of victim {content.number}, whom no robot has seen")
        self._report(content.number)

    def _report(self, number: int) -> None:
        """The base knows of this victim."""
        if number not in self._reported_ns:
            self._reported_ns[number] = self._context.now_ns
            self._context.record("victim_reported", None, number)
        if len(self._reported_ns) == len(self._victims):
            self._context.end("found")

    def measure(self) -> dict[str, float]:
        return {"victims_seen": len(self._seen_ns), "victims_reported": len(self._reported_ns)}

    def metrics(self) -> dict[str, object]:
        """Times count from when the first robot's software started; ``report_worst_s`` is None
        until all are reported, ``report_delay_s`` the mean from sight to report."""
        began_ns, reported_ns = self._context.started_ns, self._reported_ns
        delays_ns = [time_ns - self._seen_ns[number] for number, time_ns in reported_ns.items()]
        whole = len(reported_ns) == len(self._victims)
        return {"victims": len(self._victims), **self.measure(),
                "seen_mean_s": mean_s([t - began_ns for t in self._seen_ns.values()]),
                "report_delay_s": mean_s(delays_ns),
                "report_worst_s": (max(reported_ns.values()) - began_ns) / NS_PER_S
                if whole else None}

    def _sample(self, context: TaskContext) -> None:
        at_m, victims_m = context.poses()[self._robots, :2], np.array(self._victims)
        away_m = np.hypot(*(at_m[:, None] - victims_m).transpose(2, 0, 1))
        near = (away_m <= self._params.sees_m) & ~self._sees
        for robot, number in np.argwhere(near).tolist():
            if unobstructed(context.ground, at_m[robot], victims_m[number]):
                self._sees[robot, number] = True
                name = context.explorers[robot]
                if number not in self._seen_ns:
                    self._seen_ns[number] = context.now_ns
                    context.record("victim_seen", name, number)
                context.notify(name, Victim(number, self._victims[number]))
                if not context.desks:
                    self._report(number)

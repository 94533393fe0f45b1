"""Formation: robots keep their places beside a leader that drives to places."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from desim import ports
from desim.errors import InputError, did_you_mean
from desim.monitor.places import drawn, free_cells, given
from desim.ports.tasks import Formation, TaskContext, TaskTraits
from desim.units import NS_PER_S, Position

_SAMPLE_NS = NS_PER_S // 10
_WITHIN_M = 0.5  # of a place the leader has been there, of its own a follower is in formation
_DRAWN, _CLEARANCE_M = 4, 2.0  # places, and their distance from walls
_SPACING_M = 2.0  # of a wedge: each pair is so far behind and beside the one before


class KeepFormation:
    """Keep a formation while the leader drives to ``places`` in turn; done when it has been at the
    last. The leader is the first robot. Robots know the map."""

    class Params(ports.Params):
        places: tuple[tuple[Position, Position], ...] | None = Field(
            None, min_length=1, description="x, y of each (null: four, drawn from the free space)")
        offsets: dict[str, tuple[Position, Position]] | None = Field(None, description=(
            "robot to its place, ahead of the leader and to its left (null: a wedge of 2 m)"))

    leads = ("formation_error_m", "formation_time_s")
    traits = TaskTraits(gives=Formation, quantities=("formation_error_m",))

    def __init__(self, params: Params) -> None:
        self._params = params

    def start(self, context: TaskContext) -> None:
        self._context, params = context, self._params
        leader, *followers = context.explorers
        offsets = wedge(followers) if params.offsets is None else params.offsets
        for name in offsets:
            if name not in followers:
                raise InputError(f".offsets.{name}: no robot behind {leader} has this name"
                                 f"{did_you_mean(name, followers)}; allowed: "
                                 f"{', '.join(followers)}")
        places = given(context.ground, params.places) if params.places else drawn(
            free_cells(context.ground, context.poses()[:1, :2], _CLEARANCE_M), _DRAWN,
            context.stream("places"))
        self._formation = Formation(leader, places, offsets, _WITHIN_M)
        self._robots = [context.robots.index(name) for name in (leader, *offsets)]
        self._reached, self._samples, self._in_place = 0, 0, 0
        self._sum_m, self._worst_m = 0.0, 0.0
        self._done_ns: int | None = None
        context.every(_SAMPLE_NS, self._sample)

    def briefing(self) -> Formation:
        return self._formation

    def gives_map(self) -> bool:
        """Robots know the terrain."""
        return True

    def measure(self) -> dict[str, float]:
        """The present mean over followers."""
        errors_m = self._errors_m()
        return {"formation_error_m": float(errors_m.mean()) if len(errors_m) else 0.0}

    def metrics(self) -> dict[str, object]:
        """``formation_error_m``: distance of a follower from its place, mean over followers and
        time; ``in_formation``: the share of both within 0.5 m."""
        count = self._samples * (len(self._robots) - 1)
        return {"formation_error_m": self._sum_m / count if count else None,
                "formation_error_worst_m": self._worst_m if count else None,
                "in_formation": self._in_place / count if count else None,
                "places": len(self._formation.places), "places_reached": self._reached,
                "formation_time_s": None if self._done_ns is None else
                (self._done_ns - self._context.started_ns) / NS_PER_S}

    def _errors_m(self) -> np.ndarray:
        """[followers] m, from where each should be."""
        (x_m, y_m, yaw), *others = self._context.poses()[self._robots].tolist()
        forward, left = (math.cos(yaw), math.sin(yaw)), (-math.sin(yaw), math.cos(yaw))
        return np.array([math.hypot(x_m + ahead * forward[0] + aside * left[0] - at[0],
                                    y_m + ahead * forward[1] + aside * left[1] - at[1])
                         for (ahead, aside), at in zip(self._formation.offsets.values(), others,
                                                       strict=True)])

    def _sample(self, context: TaskContext) -> None:
        errors_m, places = self._errors_m(), self._formation.places
        self._samples += 1
        self._in_place += int((errors_m <= _WITHIN_M).sum())
        self._sum_m += float(errors_m.sum())
        self._worst_m = max(self._worst_m, *errors_m.tolist(), 0.0)
        leader_m = context.poses()[self._robots[0], :2]
        if self._reached < len(places) and \
                np.hypot(*(leader_m - places[self._reached])) <= _WITHIN_M:
            context.record("place_reached", self._formation.leader, self._reached)
            self._reached += 1
            if self._reached == len(places):
                self._done_ns = context.now_ns
                context.end("arrived")


def wedge(followers: list[str]) -> dict[str, tuple[float, float]]:
    """Places behind the leader, in turn on its left and its right."""
    return {name: (-_SPACING_M * (k // 2 + 1), _SPACING_M * (k // 2 + 1) * (-1) ** k)
            for k, name in enumerate(followers)}

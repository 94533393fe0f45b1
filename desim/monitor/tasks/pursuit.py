"""Pursuit: robots catch others, which flee."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from desim import ports
from desim.errors import InputError, did_you_mean
from desim.monitor.places import unobstructed
from desim.ports.pursuit import Caught, Pursuit, RobotSeen
from desim.ports.tasks import TaskContext, TaskTraits
from desim.units import NS_PER_S, Length

_SAMPLE_NS = NS_PER_S // 2


class Chase:
    """Catch the evaders: done when all are caught. Robots know the map."""

    class Params(ports.Params):
        evaders: tuple[str, ...] = Field((), description=(
            "names of robots that flee (none given: the last robot)"))
        sees_m: Length = Field("8 m", gt=0, description=(
            "robots recognise each other up to so far (an example)"))
        reach_m: Length = Field("1.5 m", gt=0, description=(
            "an evader that a pursuer sees so near is caught (an example)"))

    leads = ("caught", "capture_time_s")
    traits = TaskTraits(gives=Pursuit, quantities=("caught",))

    def __init__(self, params: Params) -> None:
        self._params = params

    def start(self, context: TaskContext) -> None:
        self._context, params = context, self._params
        evaders = params.evaders or context.explorers[-1:]
        for i, name in enumerate(evaders):
            if name not in context.explorers:
                raise InputError(f".evaders.{i}: no robot has the name {name!r}"
                                 f"{did_you_mean(name, context.explorers)}; allowed: "
                                 f"{', '.join(context.explorers)}")
        if len(set(evaders)) == len(context.explorers):
            raise InputError(".evaders: nobody is left to pursue; allowed: some robots, not all")
        self._evaders = tuple(dict.fromkeys(evaders))
        self._pursuers = [name for name in context.explorers if name not in self._evaders]
        self._caught_ns: dict[str, int] = {}
        context.every(_SAMPLE_NS, self._sample)

    def briefing(self) -> Pursuit:
        return Pursuit(self._evaders, self._params.sees_m, self._params.reach_m)

    def gives_map(self) -> bool:
        """Robots know the terrain."""
        return True

    def measure(self) -> dict[str, float]:
        return {"caught": len(self._caught_ns)}

    def metrics(self) -> dict[str, object]:
        """``capture_time_s``: until the last was caught, None before; ``capture_times_s`` of each.
        """
        times_s = {name: (time_ns - self._context.started_ns) / NS_PER_S
                   for name, time_ns in self._caught_ns.items()}
        whole = len(times_s) == len(self._evaders)
        return {"evaders": len(self._evaders), "caught": len(times_s),
                "capture_time_s": max(times_s.values()) if whole else None,
                "capture_times_s": times_s}

    def _sample(self, context: TaskContext) -> None:
        at = dict(zip(context.robots, context.poses()[:, :2], strict=True))
        for evader in self._evaders:
            if evader in self._caught_ns:
                context.hold(evader)
                continue
            for pursuer in self._pursuers:
                away_m = float(np.hypot(*(at[evader] - at[pursuer])))
                if away_m <= self._params.sees_m and \
                        unobstructed(context.ground, at[evader], at[pursuer]):
                    self._see(context, pursuer, evader, at)
                    if away_m <= self._params.reach_m:
                        self._catch(context, evader, pursuer)
                        break
        if len(self._caught_ns) == len(self._evaders):
            context.end("caught")

    def _see(self, context: TaskContext, pursuer: str, evader: str, at: dict[str, np.ndarray]
             ) -> None:
        for host, other in ((pursuer, evader), (evader, pursuer)):
            context.notify(host, RobotSeen(other, ports.Place(*at[other].tolist())))

    def _catch(self, context: TaskContext, evader: str, pursuer: str) -> None:
        self._caught_ns[evader] = context.now_ns
        context.record("caught", pursuer, context.robots.index(evader))
        context.hold(evader)
        for host in context.explorers:
            context.notify(host, Caught(evader))

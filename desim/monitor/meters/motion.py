"""The motion of robots: their poses as rows of the trace, and the way that they have driven."""

from __future__ import annotations

import math

import numpy as np

from desim.engine.trace import pack
from desim.monitor.meters.meter import Meter, Second
from desim.monitor.samples import Sample
from desim.monitor.truth import Truth

MOVING_M = 0.05  # a robot that came farther than this within the last second is moving


class Motion(Meter):
    """The motion of all robots."""

    def __init__(self, truth: Truth) -> None:
        names = truth.trace.names
        self._truth, self._kind = truth, names.id("pose")
        self._entities = [names.id(name) for name in truth.robots]
        self._before_m = truth.travelled_m().copy()
        self._moving = 0

    def each_second(self, second: Second) -> None:
        trace, now_ns, kind = self._truth.trace, second.now_ns, self._kind
        as_bits = second.poses.view(np.int64).tolist()
        for entity, (x, y, yaw) in zip(self._entities, as_bits, strict=True):
            trace.put(pack(now_ns, kind, entity, x, y, yaw))
        trace.flush_if_full()
        self._moving = int(np.count_nonzero(second.travelled_m - self._before_m > MOVING_M))
        self._before_m = second.travelled_m

    def quantities(self, now_ns: int) -> Sample:
        return {"distance_m": math.fsum(self._truth.travelled_m().tolist()),
                "robots_moving": self._moving}

    def track(self, second: Second) -> Sample:
        return {"distance_m": second.travelled_m}

    def by_host(self, now_ns: int) -> dict[str, Sample]:
        travelled_m = self._truth.travelled_m().tolist()
        return {name: {"distance_m": way_m} for name, way_m
                in zip(self._truth.robots, travelled_m, strict=True)}

"""The age of what robots know of each other's maps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from desim.middleware.graph import Graph
from desim.monitor.meters.meter import Due, Meter
from desim.monitor.samples import Sample, mean_over
from desim.robot.mapping.robot_map import RobotMap
from desim.units import NS_PER_S


class MapAge(Meter):
    """The age of ``maps`` by explorer, of those that are up. ``samples`` are all of the run."""

    def __init__(self, graph: Graph, maps: Mapping[str, RobotMap | None],
                 samples: Sequence[Sample]) -> None:
        self._graph, self._maps, self._samples = graph, maps, samples

    def sample(self, now_ns: int, due: Due) -> Sample:
        return {"map_age_s": map_age_s(self._maps, now_ns, {
            host.name: host.clock.ahead_ns(now_ns)
            for host in self._graph.hosts if host.clock is not None})}

    def summary(self, now_ns: int) -> Sample:
        return {"map_age_s": mean_over(self._samples, "map_age_s")}


def map_age_s(maps: Mapping[str, RobotMap | None], now_ns: int, ahead_ns: Mapping[str, int] = {}
              ) -> float | None:
    """The age of the newest map update that one robot holds from another, as a mean over ordered
    pairs of robots that are up; as old as the run where it never got one. None without pairs.
    Updates have the stamps of their senders; ``ahead_ns``: of the clocks that are wrong."""
    up = {name: robot_map for name, robot_map in maps.items() if robot_map is not None}
    pairs = len(up) * (len(up) - 1)
    if not pairs:
        return None
    heard_ns = sum([max(layer.newest - ahead_ns.get(name, 0), 0) for own, robot_map in up.items()
                    for name, layer in robot_map.received.items() if name in up and name != own])
    return (now_ns - heard_ns / pairs) / NS_PER_S

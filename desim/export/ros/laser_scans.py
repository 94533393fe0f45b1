"""The scans of a recording, cast again at the recorded poses by the sensors of the run's world."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from desim import plugins
from desim.engine.streams import Streams
from desim.ports import Snapshot
from desim.results.recording import Recording
from desim.results.source import ReplaySource
from desim.results.status import is_imported
from desim.scenario.robot_types import equipment_of
from desim.scenario.schema.robot import Laser
from desim.scenario.schema.scenario import Scenario
from desim.units import MM_PER_M, NS_PER_S
from desim.world.plane import Plane

_STEPS_PER_M = 1024  # ranges keep 1 mm, and files half of their bytes


class Scanner:
    """The lasers of all robots of ``scenario``, by the topics of their scans, among the walls,
    doors and moving obstacles of a recording. Raises ``InputError`` where the terrain's file has
    gone."""

    def __init__(self, scenario: Scenario) -> None:
        self.lasers: tuple[dict[str, Laser], ...] = tuple(
            own.lasers_by_topic for own in equipment_of(scenario))
        self._world = plugins.load("world", scenario.physics.model).build(
            scenario, Streams(scenario.seed))
        self._start: Snapshot = self._world.snapshot()
        self._doors = [_corners(door.start_m, door.end_m) for door in scenario.environment.doors]

    def ranges_m(self, recording: ReplaySource, k: int, which: Sequence[tuple[int, int]]
                 ) -> list[np.ndarray]:
        """Of each of ``which``, a robot and the number of its laser, [beams] float32 m, to a
        millimetre, at the poses of recorded instant ``k``; infinite where a beam meets nothing."""
        of = recording.poses
        time_ns = int(of.times_ns[k])
        poses = np.ascontiguousarray(of.of_instant(k))
        snapshot = self._start._replace(time_ns=time_ns, poses=poses)
        if isinstance(self._world, Plane):
            snapshot = self._world.with_scenery(snapshot, poses, self._closed(recording, time_ns),
                                                recording.moving_obstacles[k] / MM_PER_M)
        return [self._ranges_m(snapshot, robot, number) for robot, number in which]

    def _ranges_m(self, snapshot: Snapshot, robot: int, number: int) -> np.ndarray:
        laser = tuple(self.lasers[robot].values())[number]
        tick = int(snapshot.time_ns * laser.rate_hz // NS_PER_S)
        ranges = self._world.scan(snapshot, np.array([robot]), tick, number)[0]
        beyond = ranges >= np.float32(laser.max_range_m)
        ranges = np.round(ranges * _STEPS_PER_M) / np.float32(_STEPS_PER_M)
        ranges[beyond] = np.inf
        return ranges

    def _closed(self, recording: ReplaySource, time_ns: int) -> np.ndarray:
        """[doors] bool: which of them are closed at an instant."""
        if not self._doors:
            return np.zeros(0, bool)
        standing = {(wall.x1_mm, wall.y1_mm, wall.x2_mm, wall.y2_mm) for wall in recording.walls
                    if wall.from_ns <= time_ns < wall.until_ns}
        return np.array([corners in standing for corners in self._doors])


def scan_topics(recording: Recording, number: int) -> list[str]:
    """The topics of the lasers of a robot of a recording; none of one that was imported."""
    if is_imported(recording.run.manifest):
        return []
    own = equipment_of(recording.run.scenario)[number]
    return [f"/{recording.robots[number]}/{topic}" for topic in own.lasers_by_topic]


def _corners(start_m: tuple[float, float], end_m: tuple[float, float]
             ) -> tuple[int, int, int, int]:
    x1, y1, x2, y2 = (round(place * MM_PER_M) for place in (*start_m, *end_m))
    return x1, y1, x2, y2

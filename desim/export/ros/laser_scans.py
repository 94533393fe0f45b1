"""The scans and sonar readings of a recording, cast again by the sensors of the run's world."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from desim.engine.streams import Streams
from desim.ports import Snapshot
from desim.results.recording import Recording
from desim.results.source import ReplaySource
from desim.results.status import is_imported
from desim.scenario.robot_types import equipment_of
from desim.scenario.schema.robot import Laser, Sonar
from desim.scenario.schema.scenario import Scenario
from desim.units import MM_PER_M, NS_PER_S
from desim.world.physics import world_of
from desim.world.plane import Plane

_STEPS_PER_M = 1024  # ranges keep 1 mm, and files half of their bytes


class Scanner:
    """The sensors of all robots of ``scenario`` (``lasers`` by the topics of their scans,
    ``sonars``, ``bumpers``: who has one), among the walls, doors and moving obstacles of a
    recording. Raises ``InputError`` where the terrain's file has gone."""

    def __init__(self, scenario: Scenario) -> None:
        equipment = equipment_of(scenario)
        self.lasers: tuple[dict[str, Laser], ...] = tuple(own.lasers_by_topic for own in equipment)
        self.sonars: tuple[Sonar | None, ...] = tuple(own.sonar for own in equipment)
        self.bumpers: tuple[bool, ...] = tuple(own.bumper for own in equipment)
        self._world = world_of(scenario, Streams(scenario.seed))
        self._start: Snapshot = self._world.snapshot()
        self._doors = [_corners(door.start_m, door.end_m) for door in scenario.environment.doors]

    def ranges_m(self, recording: ReplaySource, k: int, which: Sequence[tuple[int, int]]
                 ) -> list[np.ndarray]:
        """Of each of ``which``, a robot and the number of its laser, [beams] float32 m, to a
        millimetre, at the poses of recorded instant ``k``; infinite where a beam meets nothing."""
        snapshot = self._snapshot(recording, k)
        lasers = [tuple(own.values()) for own in self.lasers]
        return [self._ranges_m(snapshot, robot, number, lasers[robot][number])
                for robot, number in which]

    def sonar_m(self, recording: ReplaySource, k: int, robots: Sequence[int]
                ) -> list[np.ndarray]:
        """Of each of ``robots``, which have sonars, [transducers] float32 m, else as ``ranges_m``.
        """
        snapshot = self._snapshot(recording, k)
        return [self._nearest_m(snapshot, robot) for robot in robots]

    def _nearest_m(self, snapshot: Snapshot, robot: int) -> np.ndarray:
        """As ``Driver`` reads a sonar."""
        sonar, first = self.sonars[robot], len(self.lasers[robot])
        assert sonar is not None
        nearest = [self._ranges_m(snapshot, robot, number, cone).min()
                   for number, cone in enumerate(sonar.cones, start=first)]
        return np.maximum(np.array(nearest, np.float32), np.float32(sonar.min_range_m))

    def _snapshot(self, recording: ReplaySource, k: int) -> Snapshot:
        of = recording.poses
        time_ns = int(of.times_ns[k])
        poses = np.ascontiguousarray(of.of_instant(k))
        snapshot = self._start._replace(time_ns=time_ns, poses=poses)
        if isinstance(self._world, Plane):
            snapshot = self._world.with_scenery(snapshot, poses, self._closed(recording, time_ns),
                                                recording.moving_obstacles[k] / MM_PER_M)
        return snapshot

    def _ranges_m(self, snapshot: Snapshot, robot: int, number: int, laser: Laser) -> np.ndarray:
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


def sonar_size(recording: Recording, number: int) -> int:
    """The transducers of a robot of a recording; none of one that was imported."""
    if is_imported(recording.run.manifest):
        return 0
    sonar = equipment_of(recording.run.scenario)[number].sonar
    return 0 if sonar is None else len(sonar.transducers)


def _corners(start_m: tuple[float, float], end_m: tuple[float, float]
             ) -> tuple[int, int, int, int]:
    x1, y1, x2, y2 = (round(place * MM_PER_M) for place in (*start_m, *end_m))
    return x1, y1, x2, y2

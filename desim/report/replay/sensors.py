"""The sensors of a run's robots for its replay: the page casts lasers and sonars itself."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from desim.report.replay.columns import Columns
from desim.results.contacts import contacts
from desim.results.source import ReplaySource
from desim.results.status import is_imported
from desim.scenario.robot_types import equipment_of, types_of
from desim.scenario.schema.robot import Laser, Sonar

Sensors = dict[str, list[Any] | None]  # of each robot, by kind


def sensors_of(recording: ReplaySource) -> Sensors:
    """The ``lasers``, the ``sonars`` (None: no sonar) and the ``bumpers`` (bool) of all robots;
    nothing is known of imported ones. Heights are above the ground."""
    if is_imported(recording.run.manifest):
        return {"lasers": None, "sonars": None, "bumpers": None}
    scenario = recording.run.scenario
    carried = [(own, body.altitude_m) for own, body in
               zip(equipment_of(scenario), types_of(scenario.fleet), strict=True)]
    return {"lasers": [[_laser(laser, altitude_m) for laser in own.lasers_by_topic.values()]
                       for own, altitude_m in carried],
            "sonars": [None if own.sonar is None else _sonar(own.sonar, altitude_m)
                       for own, altitude_m in carried],
            "bumpers": [own.bumper for own, _ in carried]}


def _laser(laser: Laser, altitude_m: float) -> dict[str, object]:
    return {"beams": laser.beams, "field_of_view_rad": laser.field_of_view_rad,
            "range_m": laser.max_range_m, "height_m": altitude_m + laser.height_m,
            "mount": [laser.x_m, laser.y_m, laser.yaw_rad]}


def _sonar(sonar: Sonar, altitude_m: float) -> dict[str, object]:
    return {"rays": sonar.rays, "cone_rad": sonar.cone_rad, "least_m": sonar.min_range_m,
            "range_m": sonar.max_range_m, "height_m": altitude_m + sonar.height_m,
            "mounts": [list(mount) for mount in sonar.transducers]}


def add_bumps(columns: Columns, recording: ReplaySource, bumpers: Sequence[bool]) -> None:
    """Add the contacts that ``bumpers`` have felt, by robot."""
    place = {name: i for i, (name, has) in enumerate(zip(recording.robots, bumpers, strict=False))
             if has}
    rows = np.array([(time_ns, place[robot]) for time_ns, robot in contacts(recording)
                     if robot in place], np.int64).reshape(-1, 2)
    for name, values in zip(("ns", "robot"), rows.T, strict=True):
        columns.add(f"bump.{name}", values)

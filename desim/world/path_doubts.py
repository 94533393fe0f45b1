"""Doubts about recorded paths."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np

from desim.errors import InputError
from desim.units import DURATION, NS_PER_S
from desim.world.fleet import RobotSpec
from desim.world.recorded_paths import RecordedPath
from desim.world.terrain import Terrain

_AT_ONCE = 1024  # places that are tested in one go
# A step is a jump if it is so many times faster than the robot, and longer than its radius: what
# localization corrects in one go is mostly shorter. (Our choice.)
_TIMES_FASTER = 3.0


class _Doubt(NamedTuple):
    """A doubt about a row of a robot's path; a file gets one sentence for each ``kind``."""

    kind: str
    robot: str
    path: RecordedPath
    row: int
    text: str


def path_doubts(specs: Sequence[RobotSpec], terrain: Terrain) -> tuple[str, ...]:
    """Sentences on what is likely to be wrong with the paths, each with the line of the first of
    several cases. Raises ``InputError`` for a place off the terrain."""
    found = [doubt for spec in specs if spec.path is not None
             for doubt in _doubts(spec, spec.path, terrain)]
    passed_over = {spec.path.file: spec.path.passed_over for spec in specs if spec.path is not None}
    said = [f"{file}: nobody follows {', '.join(names)}" for file, names in passed_over.items()
            if names]
    for _, same in groupby(sorted(found, key=_alike), key=_alike):
        first, *others = same
        more = f" and {len(others)} more" if others else ""
        said.append(f"{first.path.file}:{first.path.lines[first.row]}: {first.robot}{more}: "
                    f"{first.text}")
    return tuple(said)


def _alike(doubt: _Doubt) -> tuple[str, str]:
    return doubt.kind, doubt.path.file


def _doubts(spec: RobotSpec, path: RecordedPath, terrain: Terrain) -> Iterator[_Doubt]:
    _refuse_outside(spec.name, path, terrain.bounds)
    name, body, times_ns = spec.name, spec.body, path.times_ns
    matter = terrain.above(body.passes_m)
    clear_m = np.concatenate([
        matter.clearance(places, body.inscribed_radius_m) for places in np.split(
            path.poses[:, :2], range(_AT_ONCE, len(times_ns), _AT_ONCE))])
    hits = np.flatnonzero(clear_m < body.inscribed_radius_m / 2)  # less is an error of the map
    if len(hits):
        yield _Doubt("wall", name, path, hits[0], (
            f"in a wall, in {len(hits)} of {len(times_ns)} poses; is the map in the frame of the "
            "recording?"))
    step_m, step_s = np.hypot(*path.steps()[:, :2].T), np.diff(times_ns) / NS_PER_S
    jumps = np.flatnonzero((step_m > body.radius_m)
                           & (step_m > _TIMES_FASTER * body.max_speed_mps * step_s))
    if len(jumps):
        row = jumps[0]
        yield _Doubt("jump", name, path, row + 1, (
            f"a jump of {step_m[row]:.2f} m within {step_s[row]:.3g} s, the first of {len(jumps)}; "
            f"max_speed is {body.max_speed_mps:g} m/s"))
    until = f"the run ends at {DURATION.format(path.until_ns)} (stop.elapsed)"
    first_ns = times_ns[path.lines == path.lines[0]][-1]  # until then it stands there
    if first_ns >= path.until_ns:
        yield _Doubt("late", name, path, 0, (
            f"it stands until {DURATION.format(int(first_ns))}, but {until}; begin says at "
            "which moment of the recording the run begins"))
    elif times_ns[-1] < path.until_ns:
        yield _Doubt("end", name, path, -1, (
            f"it stands from {DURATION.format(int(times_ns[-1]))} on, when the recording ends; "
            f"{until}"))


def _refuse_outside(name: str, path: RecordedPath, bounds: tuple[float, float, float, float]
                    ) -> None:
    x0, y0, x1, y1 = bounds
    x, y = path.poses[:, 0], path.poses[:, 1]
    outside = np.flatnonzero(~((x0 < x) & (x < x1) & (y0 < y) & (y < y1)))
    if len(outside):
        row = outside[0]
        raise InputError(f"{path.file}:{path.lines[row]}: {name} is at ({x[row]:g}, {y[row]:g}) m, "
                         f"outside the terrain; allowed: x between {x0:g} and {x1:g} m, y between "
                         f"{y0:g} and {y1:g} m, the edges themselves left out")

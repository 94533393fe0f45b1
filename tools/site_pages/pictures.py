"""Pictures and replays of scenarios, of a short run each; cached until a source file changes."""

from __future__ import annotations

import hashlib
import shutil
import tempfile
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import NamedTuple

from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

import desim
from desim.api import recording_of
from desim.engine.streams import Streams
from desim.report.replay.page import write
from desim.report.run_figure import png
from desim.scenario.shipped import Shipped, folder
from desim.world.plane import Plane

_ROBOT_SECONDS = 600  # of a run: 20 s of thirty robots
_LONGEST_S, _DPI = 60, 80
_STANDING = 100  # robots, from which on there is no run, but the terrain and the start


class Drawn(NamedTuple):
    """Names of files: of the picture, and of the replay where there is one."""

    picture: str
    replay: str | None
    caption: str


def fleet(one: Shipped) -> int:
    """The number of robots of a scenario."""
    return desim.load(folder() / f"{one.name}.yaml").scenario.fleet.size


def drawn(one: Shipped, pictures: Path, replays: Path, kept: Path) -> Drawn:
    """A scenario's picture in ``pictures`` and its replay in ``replays``, taken from ``kept`` where
    they have been made before."""
    robots, stem = fleet(one), one.name.replace("/", "_")
    until_s = max(min(_ROBOT_SECONDS // robots, _LONGEST_S), 1)
    picture, replay = (kept / f"{stem}-{_sources()}.{ending}" for ending in ("png", "html"))
    kept.mkdir(parents=True, exist_ok=True)
    if not picture.is_file():
        if robots >= _STANDING:
            picture.write_bytes(_standing(one))
        else:
            with tempfile.TemporaryDirectory() as out:
                run = desim.run(desim.load(folder() / f"{one.name}.yaml", [
                    f"stop.elapsed={until_s} s"]), out=out)
                write([recording_of(run)], replay)
                picture.write_bytes(png(run, _DPI))
    for file, place in ((picture, pictures), (replay, replays)):
        if file.is_file():
            place.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(file, place / f"{stem}{file.suffix}")
    return Drawn(f"{stem}.png", f"{stem}.html" if replay.is_file() else None,
                 f"{robots} robots at the start." if robots >= _STANDING else
                 f"The first {until_s} s of {robots} robots.")


@cache
def _sources() -> str:
    """A digest of the scenarios and of all of desim."""
    digest, package = hashlib.sha256(), Path(desim.__file__).parent
    for top in (package, package.parent / "netmodels", folder()):
        for file in sorted(top.rglob("*")):
            if file.suffix in (".py", ".js", ".css", ".html", ".yaml"):
                digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def _standing(one: Shipped) -> bytes:
    """The terrain and the robots at the start, as a PNG."""
    scenario = desim.load(folder() / f"{one.name}.yaml").scenario
    world = Plane.build(scenario, Streams(scenario.seed))
    figure = Figure(figsize=(11, 7.5), layout="constrained")
    axes = figure.subplots()
    axes.add_collection(LineCollection(world.obstacles().segments.reshape(-1, 2, 2),
                                       colors="#2b2f36", linewidths=0.8))
    poses = world.snapshot().poses
    axes.scatter(poses[:, 0], poses[:, 1], s=3, color="#1f77b4")
    axes.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
    file = BytesIO()
    figure.savefig(file, format="png", dpi=_DPI)
    return file.getvalue()

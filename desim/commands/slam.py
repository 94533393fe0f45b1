"""The command that maps a real robot's log."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from desim.commands import completion
from desim.commands.compiling import compiling
from desim.commands.exit_codes import exit_codes
from desim.commands.output import say, say_json
from desim.commands.targets import writing_to
from desim.errors import InputError, ModelError, extra
from desim.files import writing

if TYPE_CHECKING:
    from desim.imports.slam_logs.laser_log import LaserLog
    from desim.imports.slam_logs.slam_trial import SlamTrial
    from desim.robot.slam.settings import SlamSettings

_WARM_UP = 30  # scans: all kernels are compiled by then


def slam(log: Annotated[Path, typer.Argument(metavar="LOG", show_default=False, help=(
             "a log of CARMEN (FLASER, ROBOTLASER1 or RAWLASER1 lines), plain or .gz; a recording "
             "of ROS with LaserScan and odometry, as desim import reads it"))],
         localization: Annotated[str, typer.Option(
             metavar="NAME", autocompletion=completion.localization_names,
             help="gmapping, scan_matching, or a plug-in: odometry, 'package.module:Class'")
         ] = "gmapping",
         settings: Annotated[list[str], typer.Option(
             "--set", metavar="KEY=VALUE", show_default=False,
             help="a parameter of the plug-in")] = [],  # noqa: B006
         relations: Annotated[Path | None, typer.Option(
             metavar="FILE", show_default=False, help="true relative poses to compare with, lines "
                                                      "of t1 t2 x y z roll pitch yaw")] = None,
         topic: Annotated[str | None, typer.Option(
             metavar="TOPIC", show_default=False, help="of the laser scans, where a recording has "
                                                       "several")] = None,
         particles: Annotated[int | None, typer.Option(
             min=1, max=1000, show_default="30", help="of gmapping, at most")] = None,
         least_particles: Annotated[int | None, typer.Option(
             min=1, max=1000, show_default="8", help="where they agree; 1000: no fewer than at most"
         )] = None,
         resolution: Annotated[float, typer.Option(min=0.02, max=2.0,
                                                   help="width of a cell in m")] = 0.05,
         seed: Annotated[int, typer.Option(min=0, help="seed of all random numbers")] = 1,
         as_json: Annotated[bool, typer.Option("--json", help="one JSON object")] = False,
         to: Annotated[Path | None, typer.Option(
             help="picture to write, png, pdf or svg (default: results/slam/<log>.png)",
             show_default=False)] = None) -> None:
    """Map a real robot's log by SLAM, and compare its path with true relations."""
    with exit_codes():
        from desim.commands.views.bars import counting
        from desim.commands.views.slam import outcome, text, title
        from desim.commands.views.terminal import Terminal
        from desim.imports.slam_logs.map_memory import check_memory
        from desim.imports.slam_logs.relations import errors_of, read_relations
        from desim.plugins import bare
        from desim.report.picture_file import check_ending
        from desim.report.slam_figure import draw_slam
        from desim.robot.slam.settings import SlamSettings

        default = Path("results") / "slam" / f"{log.name.split('.')[0] or 'log'}.png"
        check_ending(to or default)
        true = None if relations is None else read_relations(relations)
        found = _read(log, topic)
        if true is not None:  # a wrong file is refused before the work
            errors_of(found.times_s, found.odometry, true)
        chosen = SlamSettings(resolution_m=resolution, laser=found.laser)
        for option, number in ("--particles", particles), ("--least-particles", least_particles):
            if number is not None and localization != "gmapping":
                raise InputError(f"{option} {number}: {localization} has none; allowed with "
                                 "gmapping")
        chosen = replace(chosen, particles=particles or chosen.particles,
                         least_particles=least_particles or chosen.least_particles)
        play = _player(localization, settings, chosen, seed)
        for warning in found.warnings:
            say(f"warning: {warning}", err=True)
        check_memory(log, found, resolution,
                     chosen.particles if localization == "gmapping" else 1)
        with compiling(as_json):  # and of the CPU time, no part is a compiler's
            play(found.first(_WARM_UP), _unseen)
        with counting(Terminal(stderr=True), "scans") as done:
            trial = play(found, done)
        if not trial.processed.any():
            raise ModelError(f"{localization} drew none of {len(trial.processed)} scans; wanted: "
                             "some, as its traits say draws_map")
        facts = outcome(found, trial, true)
        heading = {"log": log.name, "localization": bare(localization),
                   "particles": trial.particles, "seed": seed, "resolution_m": resolution}
        with writing_to(to, default) as target:
            if to is None:
                with writing(target.parent, "--to"):
                    target.parent.mkdir(parents=True, exist_ok=True)
            draw_slam(trial, title(heading), target)
        if as_json:
            say_json({**heading, **facts, "picture": str(target)})
        else:
            say(f"{title(heading)}\n{text(facts)}\n{target}")


def _read(path: Path, topic: str | None) -> LaserLog:
    """A recording of ROS, or else a log of CARMEN."""
    from desim.imports.bag_folder import METADATA
    from desim.imports.slam_logs.carmen import read_carmen
    from desim.scenario import file_kinds

    with suppress(OSError):  # what is not there, the reader of CARMEN names
        kind = None if path.is_dir() else file_kinds.kind_of(path)
        if (path / METADATA).is_file() or kind and kind.command == file_kinds.RECORDING:
            with extra("recordings", "slam"):
                from desim.imports.slam_logs.ros_scans import read_scans

            return read_scans(path, topic)
    if topic is not None:
        raise InputError(f"--topic {topic}: a log of CARMEN has none")
    return read_carmen(path)


def _player(name: str, given: list[str], settings: SlamSettings, seed: int
            ) -> Callable[[LaserLog, Callable[[int, int], object]], SlamTrial]:
    """The player of a log. Our SLAM needs no contract of a plug-in, and places the scans between
    those that it processed. Raises ``InputError``."""
    from desim.engine.streams import Streams
    from desim.imports.slam_logs import localization_trial, slam_trial
    from desim.robot.slam.kinds import SLAM
    from desim.scenario import yaml12

    streams = Streams(seed)
    if name in SLAM:
        if given:
            raise InputError(f"--set {given[0]}: is for plug-ins; {name} has --particles and "
                             "--resolution")
        return lambda log, done: slam_trial.play(SLAM[name](settings, streams.key("slam")), log,
                                                 time.process_time, done)
    values = {}
    for text in given:
        key, equals, value = text.partition("=")
        if not equals or not key.strip():
            raise InputError(f"--set {text}: must look like key=value")
        values[key.strip()] = yaml12.parse_value(value, f"--set {text}")
    new = localization_trial.localization_for_logs(name, values)
    return lambda log, done: localization_trial.play_localization(
        new(), log, settings, Streams(seed), time.process_time, done)


def _unseen(part: int, whole: int) -> None:
    """Nobody watches the warm-up."""

"""The command that maps a real robot's log."""

from __future__ import annotations

import time
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from desim.commands.compiling import compiling
from desim.commands.exit_codes import exit_codes
from desim.commands.output import say, say_json
from desim.commands.targets import writing_to
from desim.files import writing

_WARM_UP = 30  # scans: all kernels are compiled by then


class SlamKind(StrEnum):
    """The kinds of SLAM."""

    GMAPPING = "gmapping"
    SCAN_MATCHING = "scan_matching"


def slam(log: Annotated[Path, typer.Argument(metavar="LOG", show_default=False, help=(
             "a log of CARMEN (FLASER, ROBOTLASER1 or RAWLASER1 lines), plain or .gz"))],
         localization: Annotated[SlamKind, typer.Option(help="kind of SLAM")] = SlamKind.GMAPPING,
         relations: Annotated[Path | None, typer.Option(
             metavar="FILE", show_default=False, help="true relative poses to compare with, lines "
                                                      "of t1 t2 x y z roll pitch yaw")] = None,
         particles: Annotated[int, typer.Option(min=1, max=1000, help="of gmapping")] = 30,
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
        from desim.engine.streams import Streams
        from desim.imports.slam_logs.carmen import read_carmen
        from desim.imports.slam_logs.relations import errors_of, read_relations
        from desim.imports.slam_logs.slam_trial import play
        from desim.report.picture_file import check_ending
        from desim.report.slam_figure import draw_slam
        from desim.robot.slam.kinds import SLAM
        from desim.robot.slam.settings import SlamSettings

        default = Path("results") / "slam" / f"{log.name.split('.')[0]}.png"
        check_ending(to or default)
        true = None if relations is None else read_relations(relations)
        found = read_carmen(log)
        if true is not None:  # a wrong file is refused before the work
            errors_of(found.times_s, found.odometry, true)
        settings = SlamSettings(particles=particles, resolution_m=resolution,
                                scanner=found.scanner)
        new = partial(SLAM[localization.value], settings, Streams(seed).key("slam"))
        with compiling(as_json):  # and of the CPU time, no part is a compiler's
            play(new(), found.first(_WARM_UP), time.process_time)
        with counting(Terminal(stderr=True), "scans") as done:
            trial = play(new(), found, time.process_time, done)
        facts = outcome(found, trial, true)
        heading = {"log": log.name, "localization": localization.value,
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

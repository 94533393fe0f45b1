"""The commands of real programs: a run with them, and the guest kernel that they run on."""

from __future__ import annotations

import os
import shlex
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from desim.commands.arguments import Overrides, Quiet, ScenarioPath, Until
from desim.commands.compiling import compiling, compiling_inside
from desim.commands.exit_codes import command_line, exit_codes, terminable
from desim.commands.output import say
from desim.commands.usage import Commands
from desim.errors import InputError
from desim.loop.order import MEMORY_MB

if TYPE_CHECKING:
    from desim.results.run import Run


class _WithDefault(Commands):
    """The commands below ``desim loop``; what is none of them is a scenario for ``run``."""

    def resolve_command(self, ctx, args):
        return super().resolve_command(ctx, args if args[0] in self.commands else ["run", *args])


app = typer.Typer(cls=_WithDefault, no_args_is_help=True, help=(
    "Run real programs on the networks of a scenario, in simulated time: desim loop SCENARIO."))


class LoopClock(StrEnum):
    """The clock of real programs."""

    VIRTUAL = "virtual"
    WALL = "wall"


@app.command("run")
def loop(scenario: ScenarioPath,
        seed: Annotated[int | None, typer.Option(help="a seed, not the scenario's")] = None,
        overrides: Overrides = [],  # noqa: B006
        until: Until = None,
        out: Annotated[Path, typer.Option(help="folder for results")] = Path("results"),
        clock: Annotated[LoopClock, typer.Option(
            help="simulated time, or real time, which no run repeats")] = LoopClock.VIRTUAL,
        pcap: Annotated[bool, typer.Option(
            "--pcap", help="keep the programs' frames, for Wireshark: MEDIUM.pcap")] = False,
        memory: Annotated[int, typer.Option(
            min=512, metavar="MB", help="of the guest")] = MEMORY_MB,
        quiet: Quiet = False) -> None:
    """Run a scenario whose hosts run real programs (the default: desim loop SCENARIO)."""
    with exit_codes(), terminable():
        from desim.api import located
        from desim.commands.views.bars import counting
        from desim.commands.views.terminal import Terminal
        from desim.loop.bridges import refuse_without_bridges
        from desim.loop.doctor import refuse_other_systems
        from desim.loop.guest_kernel import guest_kernel
        from desim.loop.lateness import LATE_NS, MAX_LATE_SHARE
        from desim.loop.order import Order
        from desim.loop.programs import refuse_missing
        from desim.loop.rehearsal import rehearse
        from desim.loop.supervision import Watcher
        from desim.loop.virtual import run_virtually
        from desim.loop.wall import run_on_wall_clock
        from desim.results.status import refuse_imported_scenario
        from desim.scenario.load import load

        refuse_other_systems()
        refuse_imported_scenario(scenario)
        changes = [*overrides, *([f"stop.elapsed={until}"] if until else [])]
        with compiling(quiet):
            loaded = load(scenario, changes, seed)
        order = Order(str(scenario), changes, seed, str(out), command_line(), clock.value, pcap)
        if not loaded.scenario.loop.programs:
            raise InputError(f"{loaded.where('loop.programs')}: there are no real programs; "
                             f"allowed: desim run {shlex.quote(str(scenario))}")
        with located(loaded):
            refuse_without_bridges(loaded.scenario)
            refuse_missing(loaded.scenario.loop.programs)
        kernel = guest_kernel() if clock is LoopClock.VIRTUAL else None
        with compiling_inside(quiet), located(loaded):
            rehearse(loaded.scenario)
        with counting(Terminal(), loaded.scenario.name) as on_progress:
            watcher = Watcher(on_progress, partial(say, err=True))
            finished = (run_on_wall_clock(order, loaded.scenario, watcher) if kernel is None
                        else run_virtually(order, loaded.scenario, kernel, memory, watcher))
        if not quiet:
            _show(finished)
        if not finished.manifest["loop"]["valid"]:
            say(f"invalid: more than {MAX_LATE_SHARE:.0%} of the frames were handed over more than "
                f"{LATE_NS / 1e6:g} ms late: this machine is too busy, or too slow", err=True)
            raise typer.Exit(1)
        if failed := [end for end in finished.manifest["loop"]["programs"] if end["code"]]:
            say(f"{len(failed)} of the programs failed", err=True)
            raise typer.Exit(1)


@app.command()
def build(source: Annotated[Path | None, typer.Option(
              help="an archive or a folder of Linux 6.1 or later (default: Debian's package "
                   "linux-source)", show_default=False)] = None,
          jobs: Annotated[int, typer.Option(min=1, help="processes that compile")] = (
              os.cpu_count() or 1),
          quiet: Quiet = False) -> None:
    """Build the guest kernel, once; it stays in the user's cache."""
    with exit_codes():
        from desim.commands.views.bars import counting
        from desim.commands.views.terminal import Terminal
        from desim.loop import guest_kernel
        from desim.loop.doctor import refuse_other_systems

        refuse_other_systems()
        with counting(Terminal(), "guest kernel") as on_progress:
            kernel = guest_kernel.build(source, jobs, on_progress)
        if not quiet:
            say(f"guest kernel in {kernel}")


@app.command()
def doctor() -> None:
    """Say what is there for real programs, what is missing, and how to get it."""
    with exit_codes():
        from desim.loop.doctor import findings

        found = findings()
        for finding in found:
            say(f"{'ok     ' if finding.remedy is None else 'missing'}  {finding.what}"
                + ("" if finding.remedy is None else f": {finding.remedy}"))
        if any(finding.remedy and finding.needed for finding in found):
            raise typer.Exit(1)


def _show(finished: Run) -> None:
    """Say what a run with real programs has come to."""
    from desim.loop.programs import ProgramEnd

    manifest = finished.manifest
    loop = manifest["loop"]
    say(f"{loop['frames']} frames of real programs in {manifest['simulated_s']:g} s; clock: "
        f"{manifest['clock']}")
    if loop["lateness"] is not None:
        say("handed over late by {p50_us} us (median), {p99_us} us (99 %), at most {max_us} us"
            .format(**loop["lateness"]))
    for program in loop["programs"]:
        say(f"{ProgramEnd(**program)}; {finished.path / program['log']}", err=bool(program["code"]))
    for robot, reasons in loop["refused_goals"].items():
        for why, count in reasons.items():
            say(f"{robot:12} {count} goals were refused: {why}", err=True)
    if manifest.get("reclaimed_pages"):
        say("the guest was short of memory: another run may differ; --memory gives it more",
            err=True)
    if manifest["digest"] is not None:
        say(f"digest {manifest['digest']}")
    say(f"results in {finished.path}")

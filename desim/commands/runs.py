"""The command that runs a scenario."""

from __future__ import annotations

import shlex
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from desim.commands.arguments import Overrides, Quiet, ScenarioPath, Until
from desim.commands.compiling import compiling, compiling_inside
from desim.commands.exit_codes import command_line, exit_codes
from desim.commands.output import say
from desim.errors import InputError, extra

if TYPE_CHECKING:
    from desim.commands.views.terminal import Terminal
    from desim.report.live.watch import Served
    from desim.results.run import Run
    from desim.scenario.load import Loaded


def run(scenario: ScenarioPath,
        seed: Annotated[int | None, typer.Option(help="a seed, not the scenario's")] = None,
        overrides: Overrides = [],  # noqa: B006
        until: Until = None,
        out: Annotated[Path, typer.Option(help="folder for results")] = Path("results"),
        quiet: Quiet = False,
        check: Annotated[bool, typer.Option(
            "--check", help="run twice and name the first trace row that differs")] = False,
        live: Annotated[bool, typer.Option(
            "--live", help="show the running simulation in a browser of this machine")] = False,
        port: Annotated[int, typer.Option(
            min=0, max=65535, help="of the page of --live (0: a free one)")] = 0,
        foxglove: Annotated[bool, typer.Option(
            "--foxglove", help="serve the running simulation to Foxglove")] = False,
        pace: Annotated[float | None, typer.Option(
            min=0.001, show_default=False,
            help="with these two: at most so many simulated seconds a second")] = None,
        ) -> None:
    """Run a scenario; the results are in a folder of their own afterwards."""
    with exit_codes():
        from desim.results.status import refuse_imported_scenario
        from desim.scenario.load import load

        refuse_imported_scenario(scenario)
        changes = [*overrides, *([f"stop.elapsed={until}"] if until else [])]
        with compiling(quiet):
            # Complaints about the scenario come before anything is compiled but its plug-ins.
            loaded = load(scenario, changes, seed)
            loaded.refuse_programs()
            if not quiet:
                _say_doubts(loaded)
            from desim import api
        from desim.commands.views.progress import watching
        from desim.commands.views.terminal import Terminal

        console = Terminal()
        watch = None if quiet else watching(console)
        if not (live or foxglove) and (pace or port):
            raise InputError(f"--{'pace' if pace else 'port'}: it belongs to --live"
                             f"{' and --foxglove' if pace else ''}")
        with ExitStack() as stack:
            if live or foxglove:
                from desim.commands.views.live import shown_live

                watch = stack.enter_context(shown_live(
                    watch, _servers(live, port, foxglove, loaded), pace))
            if check:
                from desim.commands.views.differences import checked

                finished, parted = checked(loaded, out, watch, command_line())
            else:
                with compiling_inside(quiet):
                    finished = api.run(loaded, out=out, watch=watch, command=command_line())
            if not quiet:
                _show(finished, console, loaded)
            if check and parted:
                say(f"the run does not repeat itself:\n{parted}", err=True)
                raise typer.Exit(1)
            if check and not quiet:
                say("run twice: every row of the trace is the same")
            if live:
                say(f"its replay: desim view {shlex.quote(str(finished.path))}")


def _say_doubts(loaded: Loaded) -> None:
    """Say before the run what it need not show."""
    from desim.advice.doubts import media_beside, too_late

    for note in media_beside(loaded.scenario, loaded.places):
        say(f"note: {note}", err=True)
    for warning in loaded.placed(InputError(*too_late(loaded.scenario))).args:
        say(f"warning: {warning}", err=True)


def _servers(live: bool, port: int, foxglove: bool, loaded: Loaded) -> list[Served]:
    from desim.report.live.browser import page_served

    servers: list[Served] = [page_served(port)] if live else []
    if foxglove:
        with extra("live", "--foxglove"):
            from desim.report.live.foxglove import foxglove_served
        servers.append(foxglove_served(loaded.scenario))
    return servers


def _show(finished: Run, console: Terminal, loaded: Loaded) -> None:
    from desim.advice.doubts import too_late
    from desim.commands.views.key_figures import result_table

    manifest = finished.manifest
    console.print(result_table(finished.metrics, manifest, console.is_narrow))
    console.print(f"digest {manifest['digest']}\nresults in {finished.path}", highlight=False,
                  markup=False, soft_wrap=True)
    said = too_late(loaded.scenario)
    for warning in finished.metrics["warnings"]:
        if warning not in said:
            say(f"warning: {warning}", err=True)
    if "healed" in manifest:
        say(f"healed: the earlier folder of this run was damaged ({manifest['healed']}) and is "
            "replaced")
    if "differs_from_earlier" in manifest:
        say("warning: an earlier run of the same scenario, seed and versions had the digest "
            f"{manifest['differs_from_earlier']}; desim run --check tells more", err=True)

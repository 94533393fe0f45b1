"""The commands about single runs."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from desim.commands import completion
from desim.commands.compiling import compiling, compiling_inside
from desim.commands.exit_codes import command_line, exit_codes
from desim.commands.extras import extra
from desim.commands.output import say, say_json
from desim.errors import InputError

if TYPE_CHECKING:
    from rich.console import Console

    from desim.report.live.watch import Served
    from desim.results.run import Run
    from desim.scenario.load import Loaded

RunPath = Annotated[Path, typer.Argument(metavar="RUN", help="a run's folder", show_default=False,
                                         autocompletion=completion.run_folders)]


def run(scenario: Annotated[Path, typer.Argument(metavar="SCENARIO", show_default=False,
                                                 autocompletion=completion.yaml_files,
                                                 help="a scenario's YAML file")],
        seed: Annotated[int | None, typer.Option(help="a seed, not the scenario's")] = None,
        overrides: Annotated[list[str], typer.Option(
            "--set", metavar="A.B.C=VALUE", help="a key's value; can be given again")] = [],  # noqa: B006
        until: Annotated[str | None, typer.Option(
            metavar="DURATION", help="short for --set stop.elapsed=DURATION")] = None,
        out: Annotated[Path, typer.Option(help="folder for results")] = Path("results"),
        quiet: Annotated[bool, typer.Option("--quiet", help="print nothing but errors")] = False,
        check: Annotated[bool, typer.Option(
            "--check", help="run twice and name the first trace row that differs")] = False,
        live: Annotated[bool, typer.Option(
            "--live", help="show the run in a browser of this machine while it goes on")] = False,
        port: Annotated[int, typer.Option(
            min=0, max=65535, help="of the page of --live (0: a free one)")] = 0,
        foxglove: Annotated[bool, typer.Option(
            "--foxglove", help="serve the run to Foxglove while it goes on")] = False,
        pace: Annotated[float | None, typer.Option(
            min=0.001, show_default=False,
            help="with these two: at most so many simulated seconds a second")] = None,
        ) -> None:
    """Run a scenario; the results are in a folder of their own afterwards."""
    with exit_codes():
        from desim.results.status import refuse_imported
        from desim.scenario.load import load

        refuse_imported(scenario)
        changes = [*overrides, *([f"stop.elapsed={until}"] if until else [])]
        with compiling(quiet):
            # Complaints about the scenario come before anything is compiled but its plug-ins.
            loaded = load(scenario, changes, seed)
            from desim import api
        from desim.commands.views.progress import watching
        from desim.commands.views.terminal import Terminal

        console = Terminal()
        watch = None if quiet else watching(console)
        if not (live or foxglove) and (pace or port):
            raise InputError(f"--{'pace' if pace else 'port'}: it belongs to --live"
                             f"{' and --foxglove' if pace else ''}")
        if live or foxglove:
            from desim.commands.views.live import shown_live

            watch = shown_live(watch, _servers(live, port, foxglove, loaded), pace)
        if check:
            from desim.commands.views.differences import checked

            finished, parted = checked(loaded, out, watch, command_line())
        else:
            with compiling_inside(quiet):
                finished = api.run(loaded, out=out, watch=watch, command=command_line())
        if not quiet:
            _show(finished, console)
        if check and parted:
            say(f"the run does not repeat itself:\n{parted}", err=True)
            raise typer.Exit(1)
        if check and not quiet:
            say("run twice: every row of the trace is the same")


def _servers(live: bool, port: int, foxglove: bool, loaded: Loaded) -> list[Served]:
    from desim.report.live.watch import page_served

    servers: list[Served] = [page_served(port)] if live else []
    if foxglove:
        with extra("live", "--foxglove"):
            from desim.report.live.foxglove import foxglove_served
        servers.append(foxglove_served(loaded.scenario))
    return servers


def _show(finished: Run, console: Console) -> None:
    from desim.commands.views.results import result_table

    manifest = finished.manifest
    console.print(result_table(finished.metrics, manifest))
    console.print(f"digest {manifest['digest']}\nresults in {finished.path}", highlight=False,
                  markup=False, soft_wrap=True)
    for warning in finished.metrics["warnings"]:
        say(f"warning: {warning}", err=True)
    if "differs_from_earlier" in manifest:
        say("warning: an earlier run of the same scenario, seed and versions had the digest "
            f"{manifest['differs_from_earlier']}; desim run --check tells more", err=True)


def trace(path: RunPath,
          message: Annotated[int | None, typer.Option(
              min=1, show_default=False,
              help="the number of a message between hosts, from 1")] = None,
          topic: Annotated[str | None, typer.Option(
              show_default=False, help="list messages of this topic; * and ? stand for letters")]
          = None,
          dropped: Annotated[bool, typer.Option("--dropped", help="list what was lost")] = False,
          at: Annotated[str | None, typer.Option(
              metavar="TIME", show_default=False,
              help="list what was under way then, e.g. 63s")] = None,
          ) -> None:
    """The story of one message: every row about it, in order, and where the time went.

    Without a number: a list of messages to choose from.
    """
    with exit_codes():
        at_ns = None if at is None else _instant(at)
        with compiling(False):
            from desim.commands.views.message import message_list, message_story
        say(message_story(path, message) if message is not None
            else message_list(path, topic, dropped, at_ns))


def why(path: RunPath,
        topic: Annotated[str | None, typer.Option(
            show_default=False, help="messages of this topic; * and ? stand for letters")] = None,
        source: Annotated[str | None, typer.Option(
            "--from", metavar="HOST", show_default=False, help="messages of this host")] = None,
        to: Annotated[str | None, typer.Option(
            metavar="HOST", show_default=False, help="messages to this host")] = None,
        message: Annotated[int | None, typer.Option(
            min=1, show_default=False, help="the number of one message between hosts")] = None,
        late: Annotated[int, typer.Option(
            min=0, metavar="N", help="show the N latest messages")] = 10,
        dropped: Annotated[bool, typer.Option(
            "--dropped", help="show messages that were lost")] = False,
        as_json: Annotated[bool, typer.Option("--json", help="all of it, as JSON")] = False,
        ) -> None:
    """The parts of late messages' time: queues, contention, airtime, retransmissions, hops.

    Of lost messages it shows the reason and the place. A run that has not kept its ledger is made
    again, which takes as long as the run.
    """
    with exit_codes():
        with compiling(as_json):
            from desim.commands.views.why import json_object, show
            from desim.results.run import Run
            from desim.results.why import Question, find
        made = Run(path)
        found = find(made.ledger, Question(topic, source, to, message, late, dropped))
        metrics = made.metrics if made.has("summary.json") else {}
        if as_json:
            say_json(json_object(found, metrics))
        else:
            from desim.commands.views.terminal import Terminal

            show(found, metrics, Terminal())


def diff(first: RunPath, second: RunPath) -> None:
    """The first trace row in which two runs differ; exit code 1 if there is one."""
    with exit_codes():
        with compiling(False):
            from desim.commands.views.differences import difference
        text = difference(first, second)
        say(text or "the traces are equal")
        if text:
            raise typer.Exit(1)


def figure(path: RunPath,
           to: Annotated[Path | None, typer.Option(
               help="file to write, png, pdf or svg (default: figure.png in the run's folder)",
               show_default=False)] = None) -> None:
    """A picture of a run: terrain, trajectories, map, explored share and traffic over time."""
    with exit_codes():
        with compiling(False):
            from desim.report.run_figure import draw
            from desim.results.run import Run
        target = to or path / "figure.png"
        draw(Run(path), target)
        say(str(target))


def graph(path: RunPath,
          at: Annotated[str | None, typer.Option(
              metavar="TIME", help="the instant, e.g. 63s (default: the end)",
              show_default=False)] = None,
          topic: Annotated[str | None, typer.Option(
              help="matches of this topic only", show_default=False)] = None,
          to: Annotated[Path | None, typer.Option(
              help="draw it into this file, png, pdf or svg", show_default=False)] = None,
          as_json: Annotated[bool, typer.Option("--json", help="all of it, as JSON")] = False,
          ) -> None:
    """The beliefs of all hosts about each other, beside the truth.

    It shows hosts that are seen online or not, matches of publishers and subscribers that are known
    or missing, and ghosts.
    """
    with exit_codes():
        at_ns = None if at is None else _instant(at)
        with compiling(as_json):
            from desim.commands.views.beliefs import json_object, show
            from desim.results.beliefs import beliefs_at
            from desim.results.run import Run
        if to is not None:
            from desim.report.run_figure import check_ending

            check_ending(to)  # a run may have to be repeated before there is something to draw
        known = beliefs_at(Run(path), at_ns)
        if topic is not None:
            known = known.of(topic)
        if to is not None:
            from desim.report.beliefs_figure import draw

            draw(known, to)
        if as_json:
            say_json(json_object(known))
        elif to is not None:
            say(f"{known.headline}\n{to}")
        else:
            from desim.commands.views.terminal import Terminal

            show(known, Terminal())


def _instant(text: str) -> int:
    """The nanoseconds of ``63s``, ``63 s`` or ``1 min 3 s``."""
    from desim.units import DURATION

    try:
        return sum(map(DURATION.parse, re.split(r"(?<=[a-zµ])\s+(?=[\d.])", text.strip())))
    except ValueError as error:
        raise InputError(f"--at: {error}") from None

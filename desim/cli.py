"""The commands. Heavy imports stand inside them: ``desim --help`` answers at once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from desim.commands import campaigns
from desim.commands.ending import command_line, compiling, exits
from desim.errors import InputError

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False,
                  help="Simulate a fleet of robots and the networks between them, on one clock.")

RunPath = Annotated[Path, typer.Argument(metavar="RUN", help="a run's folder", show_default=False)]


@app.command()
def run(scenario: Annotated[Path, typer.Argument(metavar="SCENARIO", show_default=False,
                                                 help="a scenario's YAML file")],
        seed: Annotated[int | None, typer.Option(help="instead of the scenario's")] = None,
        overrides: Annotated[list[str], typer.Option(
            "--set", metavar="A.B.C=VALUE", help="another value; can be given again")] = [],  # noqa: B006
        until: Annotated[str | None, typer.Option(
            metavar="DURATION", help="short for --set stop.elapsed=DURATION")] = None,
        out: Annotated[Path, typer.Option(help="folder for results")] = Path("results"),
        quiet: Annotated[bool, typer.Option("--quiet", help="print nothing but errors")] = False,
        check: Annotated[bool, typer.Option(
            "--check", help="run twice and name the first trace row that differs")] = False,
        ) -> None:
    """Run a scenario; the results are in a folder of their own afterwards."""
    with exits():
        from desim.scenario.load import load

        changes = [*overrides, *([f"stop.elapsed={until}"] if until else [])]
        with compiling(quiet):
            # Complaints about the scenario come before anything is compiled but its plug-ins.
            loaded = load(scenario, changes, seed)
            from desim import api
        from rich.console import Console

        from desim.report.live import watching

        console = Console()
        watch = None if quiet else watching(console)
        if check:
            from desim.report.checking import checked

            finished, parted = checked(loaded, out, watch, command_line())
        else:
            finished = api.run(loaded, out=out, watch=watch, command=command_line())
        if not quiet:
            _show(finished, console)
        if check and parted:
            typer.echo(f"the run does not repeat itself:\n{parted}", err=True)
            raise typer.Exit(1)
        if check and not quiet:
            typer.echo("run twice: every row of the trace is the same")


def _show(finished: Any, console: Any) -> None:
    from desim.report.resulttable import result_table

    manifest = finished.manifest
    console.print(result_table(finished.metrics, manifest))
    console.print(f"digest {manifest['digest']}\nresults in {finished.path}", highlight=False,
                  soft_wrap=True)
    if "differs_from_earlier" in manifest:
        typer.echo("warning: an earlier run of the same scenario, seed and versions had the "
                   f"digest {manifest['differs_from_earlier']}; desim run --check tells more",
                   err=True)


@app.command()
def describe(plugin: Annotated[str, typer.Argument(
        metavar="PLUGIN", show_default=False,
        help="a name that desim plugins lists, or package.module:Class")]) -> None:
    """What a plug-in does, and its parameters."""
    with exits():
        from desim.report.catalogue import description

        typer.echo(description(plugin))


@app.command()
def plugins() -> None:
    """All plug-ins that are installed, by kind."""
    with exits():
        from desim.report.catalogue import listing

        typer.echo(listing())


@app.command()
def schema() -> None:
    """The JSON Schema of scenario files, for editors."""
    with exits():
        import json

        from desim.scenario.schema import Scenario

        typer.echo(json.dumps(Scenario.model_json_schema(by_alias=True), indent=2))


@app.command()
def trace(path: RunPath,
          message: Annotated[int, typer.Option(
              min=1, help="the number of a message between hosts, from 1 (messages.parquet)")],
          ) -> None:
    """The story of one message: every row about it, in order, and where the time went."""
    with exits():
        with compiling(False):
            from desim.report.following import told
        typer.echo(told(path, message))


@app.command()
def diff(first: RunPath, second: RunPath) -> None:
    """The first trace row in which two runs differ, with the rows around it."""
    with exits():
        with compiling(False):
            from desim.report.checking import difference
        text = difference(first, second)
        typer.echo(text or "the traces are equal")
        if text:
            raise typer.Exit(1)


@app.command()
def figure(path: RunPath,
           to: Annotated[Path | None, typer.Option(
               help="file to write, png, pdf or svg (default: figure.png in the run's folder)",
               show_default=False)] = None) -> None:
    """A picture of a run: terrain, trajectories, map, explored share and traffic over time."""
    with exits():
        with compiling(False):
            from desim.api import Run
            from desim.report.figure import draw
        target = to or path / "figure.png"
        draw(Run(path), target)
        typer.echo(str(target))


@app.command()
def coverage(scenario: Annotated[Path, typer.Argument(metavar="SCENARIO", show_default=False,
                                                      help="a scenario's YAML file")],
             at: Annotated[str | None, typer.Option(
                 metavar="PLACE", help="a host, or a place as '3 m, -2.5 m' (the first host that "
                                       "has a place)", show_default=False)] = None,
             medium: Annotated[str | None, typer.Option(
                 help="the name of a medium (the first)", show_default=False)] = None,
             overrides: Annotated[list[str], typer.Option(
                 "--set", metavar="A.B.C=VALUE", help="another value; can be given again")] = [],  # noqa: B006
             to: Annotated[Path, typer.Option(help="file to write, png, pdf or svg")] = Path(
                 "coverage.png")) -> None:
    """A picture of what a radio reaches in a scenario's terrain, from one place and between the
    hosts at the start."""
    with exits():
        from desim.scenario.load import load

        with compiling(False):
            loaded = load(scenario, overrides)
            from desim.report.coverage import draw
        try:
            said = draw(loaded.scenario, at, medium, to)
        except InputError as error:
            raise loaded.placed(error) from error
        typer.echo(f"{said}\n{to}")


@app.command(context_settings={"allow_extra_args": True, "ignore_unknown_options": True,
                               "help_option_names": []})
def net(context: typer.Context,
        case: Annotated[str | None, typer.Argument(
            metavar="CASE", show_default=False, help="a name that desim net lists")] = None,
        seed: Annotated[int | None, typer.Option(min=0, help="of all luck")] = None,
        as_json: Annotated[bool, typer.Option("--json", help="one JSON object")] = False,
        usage: Annotated[bool, typer.Option("--help", help="the options of the case")] = False,
        ) -> None:
    """Play a standard network case without robots; its options are --key value."""
    with exits():
        from desim.report import cases

        if usage or case is None:
            with compiling(False):
                typer.echo(cases.overview() if case is None else cases.fleet_usage()
                           if case == cases.FLEET else cases.usage(case))
        elif case == cases.FLEET:
            _net_fleet(context.args, seed, as_json)
        else:
            _net_case(case, context.args, 1 if seed is None else seed, as_json)


def _net_case(case: str, words: list[str], seed: int, as_json: bool) -> None:
    from desim import options, plugins
    from desim.report import cases

    with compiling(as_json):
        from desim.experiment.netcase import play
        params = options.parsed(words, plugins.parameters("case", case), ("seed", "json"))
    with options.as_options():
        measures = play(plugins.load("case", case)(params).setup(), seed)
    settings = params.model_dump(mode="json", by_alias=True)
    if as_json:
        _echo_json({"case": case, "seed": seed, "settings": settings, **measures})
        return
    from rich.console import Console

    typer.echo(cases.title(case, seed, settings))
    Console().print(cases.measures_table(measures))


def _net_fleet(words: list[str], seed: int | None, as_json: bool) -> None:
    from desim import options
    from desim.scenario.load import load

    with compiling(as_json):
        from desim.experiment.fleetload import Question, play
        from desim.report import fleetload
    question = options.parsed(words, Question, ("seed", "json"))
    loaded = load(question.scenario, question.overrides, seed)
    try:
        found = play(loaded.scenario, question)
    except InputError as error:
        raise loaded.placed(error) from error
    carries, said = fleetload.verdict(found, question.enough)
    if as_json:
        _echo_json({"scenario": loaded.scenario.name, "seed": loaded.scenario.seed,
                    "settings": question.model_dump(mode="json", by_alias=True), **found,
                    "carries": carries, "verdict": said})
        return
    typer.echo(f"{loaded.scenario.name}, seed {loaded.scenario.seed}: {fleetload.told(found)}")
    typer.echo(said)


@app.command()
def validate(only: Annotated[list[str], typer.Option(
                 metavar="GROUP", help="one that desim plugins lists; can be given again")] = [],  # noqa: B006
             as_json: Annotated[bool, typer.Option("--json", help="one JSON object")] = False,
             ) -> None:
    """Compare the network models with published numbers; exit code 1 if one is off."""
    with exits():
        with compiling(as_json):
            from desim.report import validating
        groups = validating.chosen(only)
        rows = validating.compared(groups, _say_nothing if as_json else typer.echo)
        failed = sum(not row["holds"] for row in rows)
        if as_json:
            _echo_json({"checks": len(rows), "failed": failed, "rows": rows})
        else:
            typer.echo(f"{len(rows) - failed} of {len(rows)} within tolerance")
        if failed:
            raise typer.Exit(1)


def _say_nothing(_: str) -> None:
    pass


def _echo_json(value: Any) -> None:
    import json

    typer.echo(json.dumps(value, indent=2))


campaigns.add_to(app)

if __name__ == "__main__":
    app()

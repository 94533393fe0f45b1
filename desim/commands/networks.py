"""The commands about networks alone."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from desim.commands import completion
from desim.commands.arguments import Overrides, ScenarioPath
from desim.commands.compiling import compiling, compiling_inside
from desim.commands.exit_codes import exit_codes
from desim.commands.output import say, say_json
from desim.commands.targets import writing_to
from desim.errors import InputError
from desim.files import writing

if TYPE_CHECKING:
    from desim.scenario.block_file import PlacedBlock
    from desim.scenario.load import Loaded


def net(context: typer.Context,
        case: Annotated[str | None, typer.Argument(
            metavar="CASE", show_default=False, autocompletion=completion.case_names,
            help="a name that desim net lists")] = None,
        seed: Annotated[int | None, typer.Option(min=0, help="seed of all random numbers")] = None,
        as_json: Annotated[bool, typer.Option("--json", help="one JSON object")] = False,
        usage: Annotated[bool, typer.Option("--help", help="the options of the case")] = False,
        ) -> None:
    """Play a standard network case without robots; its options are --key value."""
    with exit_codes():
        from desim.commands.views import cases

        if usage or case is None:
            with compiling(False):
                say(cases.overview() if case is None else cases.usage(case))
        elif case == cases.FLEET:
            _net_fleet(context.args, seed, as_json)
        else:
            _net_case(case, context.args, 1 if seed is None else seed, as_json)


def _net_case(case: str, words: list[str], seed: int, as_json: bool) -> None:
    from desim import plugins
    from desim.commands import options
    from desim.commands.views import cases
    from desim.commands.views.terminal import Terminal

    with compiling(as_json):
        from desim.netcases.case import play
        from desim.scenario import block_file

        block = plugins.parameters("case", case)
        if case == cases.LAYOUT:
            written = block_file.read(_only_file(words), block)
            params, errors = written.params, _placed(written)
        else:
            params = options.parsed(words, block, ("seed", "json"))
            errors = options.as_options()
    from desim.commands.views.bars import following

    with errors, compiling_inside(as_json), following(Terminal(stderr=True), case) as watch:
        measures = play(plugins.load("case", case)(params).setup(), seed, watch)
    if as_json:
        say_json({"case": case, "seed": seed,
                  "settings": params.model_dump(mode="json", by_alias=True), **measures})
        return
    say(cases.title(case, seed, params))
    Terminal().print(cases.measures_table(measures))


@contextmanager
def _placed(file: Loaded | PlacedBlock) -> Iterator[None]:
    """Add file, line and column to an error about the content of ``file``."""
    try:
        yield
    except InputError as error:
        raise file.placed(error) from error


def _only_file(words: list[str]) -> str:
    """The only word, a file. Raises ``InputError`` for others."""
    if len(words) == 1 and not words[0].startswith("--"):
        return words[0]
    raise InputError("FILE is missing: a layout's YAML file" if not words else
                     f"{' '.join(words)!r} is not one file; wanted: desim net layout FILE "
                     "[--seed N] [--json]")


def _net_fleet(words: list[str], seed: int | None, as_json: bool) -> None:
    from desim.commands import options
    from desim.scenario.load import load

    with compiling(as_json):
        from desim.commands.views import fleet_load
        from desim.netcases.fleet_load import FleetLoad, play
    params = options.parsed(words, FleetLoad, ("seed", "json"))
    loaded = load(params.scenario, params.overrides, seed)
    with _placed(loaded):
        found = play(loaded.scenario, params)
    carries, verdict = fleet_load.verdict(found, params.enough)
    if as_json:
        say_json({"scenario": loaded.scenario.name, "seed": loaded.scenario.seed,
                    "settings": params.model_dump(mode="json", by_alias=True), **found,
                    "carries": carries, "verdict": verdict})
        return
    say(f"{loaded.scenario.name}, seed {loaded.scenario.seed}: {fleet_load.description(found)}")
    say(verdict)


def coverage(scenario: ScenarioPath,
             at: Annotated[str | None, typer.Option(
                 metavar="PLACE", help="a host, or a place as '3 m, -2.5 m' (the first host that "
                                       "has a place)", show_default=False)] = None,
             medium: Annotated[str | None, typer.Option(
                 help="the name of a medium (the first)", show_default=False)] = None,
             overrides: Overrides = [],  # noqa: B006
             to: Annotated[Path | None, typer.Option(
                 help="file to write, png, pdf or svg (default: results/<name>/coverage.png)",
                 show_default=False)] = None) -> None:
    """A picture of what a radio reaches in a scenario's terrain.

    It shows the reach from one place, and the links between the hosts at the start.
    """
    with exit_codes():
        from desim.scenario.load import load

        with compiling(False):
            loaded = load(scenario, overrides)
            from desim.report.reach import draw
        default = Path("results") / loaded.scenario.name / "coverage.png"
        with _placed(loaded), compiling_inside(False), writing_to(to, default) as target:
            if to is None:
                with writing(target.parent, "--to"):
                    target.parent.mkdir(parents=True, exist_ok=True)
            outcome = draw(loaded.scenario, at, medium, target)
        say(f"{outcome}\n{target}")


def validate(only: Annotated[list[str], typer.Option(
                 metavar="GROUP", help="one that desim plugins lists; can be given again")] = [],  # noqa: B006
             real: Annotated[str | None, typer.Option(
                 metavar="NAME", show_default=False,
                 help="our model beside real programs in simulated time: tcp, ros1, ...")] = None,
             seed: Annotated[int, typer.Option(min=0, help="of --real's networks")] = 1,
             out: Annotated[Path | None, typer.Option(
                 help="keep the runs of --real in this folder", show_default=False)] = None,
             as_json: Annotated[bool, typer.Option("--json", help="one JSON object")] = False,
             ) -> None:
    """Compare the network models with published numbers; exit code 1 if one is off.

    With --real our models of middleware and TCP beside the real programs, within 5 %.
    """
    with exit_codes():
        if real is not None:
            from desim.commands import judging

            judging.judge(real, seed, out, as_json)
            return
        with compiling(as_json):
            from desim.commands.views import validation
        groups = validation.chosen(only)
        with compiling_inside(as_json):
            rows = validation.compared(groups, (lambda _: None) if as_json else typer.echo)
        failed = sum(not row["holds"] for row in rows)
        if as_json:
            say_json({"checks": len(rows), "failed": failed, "rows": rows})
        else:
            say(f"{len(rows) - failed} of {len(rows)} within tolerance")
        if failed:
            raise typer.Exit(1)

"""The commands about many runs, and the cluster that the paper's testbed would need for them."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from desim.commands import completion
from desim.commands.arguments import (
    DesignPath,
    Overrides,
    Quiet,
    ScenarioPath,
    Until,
    found_file,
)
from desim.commands.compiling import compiling
from desim.commands.exit_codes import exit_codes, reading, terminable
from desim.commands.output import say, say_json
from desim.commands.targets import writing_to
from desim.errors import InputError
from desim.operating_system.resources import cores

if TYPE_CHECKING:
    from desim.campaign.design.design import LoadedDesign
    from desim.campaign.design.plan import Plan
    from desim.campaign.design.rehearsal import Errand, Made
    from desim.campaign.running.agenda import Agenda
    from desim.campaign.running.cluster_settings import Settings
    from desim.campaign.running.crew import Crew
    from desim.campaign.running.sweep import Sweep
    from desim.commands.views.terminal import Terminal

_MANY = 200  # scenarios, which take a while to check


def sweep(design: Annotated[Path, typer.Argument(
              metavar="DESIGN|SCENARIO", show_default=False, autocompletion=completion.yaml_files,
              callback=found_file, help="a design's YAML file; with --vary that of a scenario")],
          vary: Annotated[list[str], typer.Option(
              metavar="A.B.C=V1,V2,...", help="a key of the scenario and its values; given again: "
                                              "all combinations")] = [],  # noqa: B006
          seeds: Annotated[int | None, typer.Option(
              min=1, help="with --vary: runs of each combination (default: 10)",
              show_default=False)] = None,
          overrides: Annotated[list[str], typer.Option(
              "--set", metavar="A.B.C=VALUE",
              help="with --vary: a key's value in every run")] = [],  # noqa: B006
          until: Until = None,
          out: Annotated[Path | None, typer.Option(
              help="the campaign's folder (default: results/<name>)", show_default=False)] = None,
          jobs: Annotated[int | None, typer.Option(
              min=1, help="worker processes (default: one for each core), or jobs of a batch "
                          "system", show_default=False)] = None,
          cluster: Annotated[str | None, typer.Option(
              metavar="local|slurm|pbs|ADDRESS|FILE", show_default=False,
              help="run on a cluster, by Dask; ADDRESS: of a Dask scheduler, tcp://host:port; "
                   "FILE: YAML about a cluster (docs/cluster.md)")] = None,
          only: Annotated[list[str], typer.Option(
              metavar="PARAMETER=LEVEL", help="vectors with this level; can be given again")] = [],  # noqa: B006
          retry_failed: Annotated[bool, typer.Option(
              "--retry-failed", help="run again what failed")] = False,
          dry_run: Annotated[bool, typer.Option(
              "--dry-run", help="list the runs, and predict their time from the beginnings of some"
              )] = False,
          quiet: Quiet = False,
          ) -> None:
    """Run a design, or with --vary a scenario: all runs that are not done yet.

    If it was stopped, the same command goes on from there. --vary leaves its design in the
    campaign's folder, to be edited and run again. Exit code 1 if runs failed.
    """
    with exit_codes():
        from desim.commands.views import sweep as view

        console = view.console(quiet)
        with compiling(quiet):
            from desim.campaign.design.metrics import Metrics
            from desim.campaign.folder.design_copy import DESIGN
            from desim.campaign.running.cluster_settings import load_settings
            from desim.campaign.running.sweep import Sweep, foreseen, selected

            settings = None if cluster is None else load_settings(cluster, jobs)
            plan = planned(_asked(str(design), vary, seeds, overrides, until), console)
            chosen = selected(plan, tuple(only))
        folder = out or Path("results") / plan.design.name
        with _worker(plan, console) as worker:
            with compiling(quiet):
                metrics = Metrics(plan, worker.made)
            if dry_run:
                if _predict(plan, foreseen(plan, metrics, folder, chosen, retry_failed), jobs,
                            console, worker.made):
                    raise typer.Exit(1)
                return
        failed = _carried_out(
            Sweep(plan, metrics, folder, only=chosen, retry_failed=retry_failed), jobs, settings,
            console)
        if vary and not quiet:
            say(f"its design, to keep or edit: {folder / DESIGN}\n"
                f"its report: desim report {shlex.quote(str(folder))}")
        if failed:
            raise typer.Exit(1)


def _asked(file: str, vary: list[str], seeds: int | None, overrides: list[str],
           until: str | None) -> LoadedDesign:
    """The design in a file, or that of ``vary`` on the scenario in it."""
    if vary:
        from desim.campaign.design.varied import varied_design

        changes = [*overrides, *([f"stop.elapsed={until}"] if until else [])]
        return varied_design(file, vary, seeds or 10, changes)
    from desim.campaign.design.design import load_design

    for option, given, key in (("--seeds", seeds, "iterations"), ("--set", overrides, "set"),
                               ("--until", until, "stop")):
        if given:
            raise InputError(f"{option}: it belongs to --vary; a design has the key {key}")
    return load_design(file)


def planned(loaded: LoadedDesign, console: Terminal) -> Plan:
    """The plan of a design, with a bar on the terminal where that takes a while."""
    from desim.campaign.design.plan import Plan
    from desim.commands.views.bars import counting

    with counting(console, "checking scenarios", least=_MANY) as checked:
        return Plan(loaded, checked)


def _worker(plan: Plan, console: Terminal) -> Crew[Errand]:
    """A process for what is tried before the campaign: no plug-in of a run is made in ours."""
    from desim.campaign.running.crew import Crew
    from desim.commands.views.sweep import slow_line

    return Crew(1, plan.design.limits.wall_ns,
                slow=lambda run_id, seconds: console.print(slow_line(run_id, seconds)))


def _predict(plan: Plan, agenda: Agenda, jobs: int | None, console: Terminal, made: Made) -> bool:
    """List the runs of a campaign, and predict what those cost that are not done. Returns whether
    a level fails."""
    from desim.campaign.running import driver, probes
    from desim.campaign.running.failing import failing
    from desim.commands.views import sweep as view
    from desim.commands.views.bars import counting

    tried: dict[int, str | None] = {}
    view.show_runs(console, agenda)
    done, _, total = agenda.progress
    if done == total:
        return False
    with counting(console, f"probing, {probes.BUDGET_S:.0f} s at most") as probing:
        found = driver.predicted(plan, agenda, probing, tried, made)
    view.show_prediction(console, *found, jobs or cores())
    errors = failing(plan, agenda, tried, made)
    for levels, error in errors.items():
        console.print(f"{levels}: fails: {error}")
    return bool(errors)


def _carried_out(sweep: Sweep, jobs: int | None, settings: Settings | None, console: Terminal,
                 ) -> int:
    """Make the missing runs, and show the progress. Returns the number of failed runs."""
    from desim.campaign.running.driver import CampaignDriver
    from desim.commands.views.sweep import SweepView

    with terminable(), sweep:
        driver = CampaignDriver(sweep, jobs, settings)
        with SweepView(console, sweep, driver.where) as view:
            driver.run(view.run_ended, view.workers_up, view.slow)
        return sweep.agenda.progress[1]


def report(campaign: Annotated[Path, typer.Argument(metavar="CAMPAIGN", show_default=False,
                                                    autocompletion=completion.campaign_folders,
                                                    help="a campaign's folder")],
           design: Annotated[Path | None, typer.Option(
               help="its design, for a folder that has no copy", show_default=False)] = None,
           out: Annotated[Path | None, typer.Option(
               help="folder for the report (default: CAMPAIGN/report)",
               show_default=False)] = None,
           leaderboard: Annotated[Path | None, typer.Option(
               metavar="PAGE", show_default=False,
               help="enter the results of a reference design into this Markdown page, and write no "
                    "report")] = None,
           quiet: Quiet = False) -> None:
    """Write the report of a campaign: a page, figures and tables."""
    with reading():
        from desim.campaign.design.design import read_design
        from desim.campaign.folder.campaign import Campaign

        read = read_design(str(design))[0] if design else Campaign(campaign).design
        if leaderboard is not None:
            from desim.report.campaign.numbers import Study
            from desim.report.leaderboard.page import enter

            if out is not None:
                raise InputError("--out is the folder of a report, and with --leaderboard there is "
                                 "none")
            entered = enter(Study(campaign, read), leaderboard)
            if not quiet:
                say(f"leaderboard: {leaderboard}: {entered}")
            return
        from desim.report.campaign.campaign_report import write

        with writing_to(out, campaign / "report", "--out FOLDER") as folder:
            page = write(campaign, read, folder)
        if not quiet:
            say(f"report: {page}")


def ladder(scenario: ScenarioPath,
           compare: Annotated[str, typer.Option(
               metavar="A.B.C=V1,V2,...", help="a key of the scenario and its values")]
           = "coordination.strategy=nearest_frontier,random_frontier",
           seeds: Annotated[int, typer.Option(min=1, help="runs of each value on each rung")] = 5,
           metric: Annotated[str | None, typer.Option(
               help="the metric by which the values are ranked (default: the first that leads the "
                    "task, of exploration exploration_time_s)", show_default=False)] = None,
           overrides: Overrides = [],  # noqa: B006
           out: Annotated[Path | None, typer.Option(
               help="the campaign's folder (default: results/ladder_...)",
               show_default=False)] = None,
           jobs: Annotated[int | None, typer.Option(
               min=1, help="worker processes (default: one for each core)",
               show_default=False)] = None,
           quiet: Quiet = False,
           ) -> None:
    """Compare settings on every rung of the fidelity ladder: does their ranking hold?

    Exit code 1 if runs failed.
    """
    with exit_codes():
        from desim.commands.views import sweep as view

        console = view.console(quiet)
        with compiling(quiet):
            from desim.campaign.design.ladder import ladder_design
            from desim.campaign.design.metrics import Metrics
            from desim.campaign.running.sweep import Sweep

            plan = planned(ladder_design(str(scenario), compare, seeds, metric, overrides),
                           console)
            with _worker(plan, console) as worker:
                metrics = Metrics(plan, worker.made)
        folder = out or Path("results") / plan.design.name
        failed = _carried_out(Sweep(plan, metrics, folder), jobs, None, console)
        from desim.commands.views.ladder import show
        from desim.report.campaign.campaign_report import write

        page = write(folder, plan.design)
        if not quiet:
            show(folder, plan.design)
            say(f"report: {page}")
        if failed:
            raise typer.Exit(1)


def deploy(design: DesignPath,
           robots_per_node: Annotated[int | None, typer.Option(
               min=1, help="virtual machines on a node (default: the scenario's "
                           "testbed.robots_per_node)", show_default=False)] = None,
           image: Annotated[str, typer.Option(
               metavar="SIZE", help="size of a virtual machine's image")] = "6.8 GB",
           model: Annotated[str, typer.Option(help="network model of the cluster's LAN")] = (
               "switch"),
           rate: Annotated[str, typer.Option(help="rate of the LAN's links")] = "1 Gb/s",
           as_json: Annotated[bool, typer.Option("--json", help="one JSON object")] = False,
           ) -> None:
    """Plan the cluster that the paper's testbed would need for a design.

    It prints the nodes, which robots are on which, how the image of their virtual machines gets
    there, and what the runs would take in real time.
    """
    with exit_codes():
        from desim.commands import options
        from desim.commands.views.sweep import console

        with compiling(as_json):
            from desim.campaign.design.design import load_design
            from desim.commands.views import deployment as view

            chosen = options.checked({"image": image, "model": model, "rate": rate,
                                      "robots_per_node": robots_per_node}, view.TestbedOptions)
            plan = planned(load_design(design), console(as_json))
        deployment = view.deployment_of(plan, chosen)
        if as_json:
            say_json(view.json_object(deployment))
        else:
            view.show(deployment, console(quiet=False))

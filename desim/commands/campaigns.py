"""The commands about many runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from desim.commands.ending import compiling, ended_in_order, exits, say

DesignPath = Annotated[Path, typer.Argument(metavar="DESIGN", show_default=False,
                                            help="a design's YAML file")]


def add_to(app: typer.Typer) -> None:
    """Make them commands of ``app``."""
    app.command()(sweep)
    app.command()(report)
    app.command()(ladder)


def sweep(design: DesignPath,
          out: Annotated[Path | None, typer.Option(
              help="the campaign's folder (default: results/<name>)", show_default=False)] = None,
          jobs: Annotated[int | None, typer.Option(
              min=1, help="worker processes (default: one for each core), or jobs of a batch "
                          "system", show_default=False)] = None,
          cluster: Annotated[str | None, typer.Option(
              metavar="local|slurm|pbs|ADDRESS|FILE", show_default=False,
              help="run there, by Dask; ADDRESS: of a Dask scheduler, tcp://host:port; FILE: YAML "
                   "about a cluster (docs/cluster.md)")] = None,
          only: Annotated[list[str], typer.Option(
              metavar="PARAMETER=LEVEL", help="a part of the vectors; can be given again")] = [],  # noqa: B006
          retry_failed: Annotated[bool, typer.Option(
              "--retry-failed", help="run again what failed")] = False,
          dry_run: Annotated[bool, typer.Option(
              "--dry-run", help="list the runs and predict the time, run nothing")] = False,
          quiet: Annotated[bool, typer.Option("--quiet", help="print nothing but errors")] = False,
          ) -> None:
    """Run a design: all its runs that are not done yet. Stopped at any moment, the same command
    goes on from there. Exit code 1 where runs failed."""
    with exits():
        from desim.commands.views.sweep import Told

        told = Told(quiet)
        with compiling(quiet):
            from desim.campaign.design.design import load_design
            from desim.campaign.running import sweep as campaign
            from desim.campaign.running.cluster_settings import load_settings

            where = None if cluster is None else load_settings(cluster, jobs)
            plan = told.planned(load_design(design))
            chosen = campaign.selected(plan, tuple(only))
            metrics = campaign.Metrics(plan)
        folder = out or campaign.default_folder(plan.loaded)
        if dry_run:
            told.listed(plan, campaign.foreseen(plan, metrics, folder, chosen, retry_failed), jobs)
            return
        with ended_in_order(), campaign.Sweep(plan, metrics, folder, only=chosen,
                                              retry_failed=retry_failed) as work:
            failed = told.carried_out(work, jobs, where)
        if failed:
            raise typer.Exit(1)


def report(campaign: Annotated[Path, typer.Argument(metavar="CAMPAIGN", show_default=False,
                                                    help="a campaign's folder")],
           design: Annotated[Path | None, typer.Option(
               help="its design, for a folder that has no copy", show_default=False)] = None,
           out: Annotated[Path | None, typer.Option(
               help="folder for the report (default: CAMPAIGN/report)",
               show_default=False)] = None,
           quiet: Annotated[bool, typer.Option("--quiet",
                                               help="print nothing but errors")] = False) -> None:
    """Write the report of a campaign: a page, figures and tables."""
    with exits():
        from desim.campaign.design.design import read_design
        from desim.campaign.folder.campaign import Campaign
        from desim.report.campaign.writing import write

        chosen = read_design(str(design))[0] if design else Campaign(campaign).design
        page = write(campaign, chosen, out)
        if not quiet:
            say(f"report: {page}")


def ladder(scenario: Annotated[Path, typer.Argument(metavar="SCENARIO", show_default=False,
                                                    help="a scenario's YAML file")],
           compare: Annotated[str, typer.Option(
               metavar="A.B.C=V1,V2,...", help="a key of the scenario and its values")]
           = "coordination.strategy=nearest_frontier,random_frontier",
           seeds: Annotated[int, typer.Option(min=1, help="runs of each value on each rung")] = 5,
           metric: Annotated[str, typer.Option(help="by which values are ranked")]
           = "exploration_time_s",
           overrides: Annotated[list[str], typer.Option(
               "--set", metavar="A.B.C=VALUE", help="another value; can be given again")] = [],  # noqa: B006
           out: Annotated[Path | None, typer.Option(
               help="the campaign's folder (default: results/ladder_...)",
               show_default=False)] = None,
           jobs: Annotated[int | None, typer.Option(
               min=1, help="worker processes (default: one for each core)",
               show_default=False)] = None,
           quiet: Annotated[bool, typer.Option("--quiet", help="print nothing but errors")] = False,
           ) -> None:
    """Compare settings on every rung of the fidelity ladder: does their ranking hold?"""
    with exits():
        from desim.commands.views.sweep import Told

        told = Told(quiet)
        with compiling(quiet):
            from desim.campaign.design.ladder import ladder as climbed
            from desim.campaign.running import sweep as campaign

            plan = told.planned(climbed(str(scenario), compare, seeds, metric, overrides))
            metrics = campaign.Metrics(plan)
        folder = out or campaign.default_folder(plan.loaded)
        with ended_in_order(), campaign.Sweep(plan, metrics, folder) as work:
            failed = told.carried_out(work, jobs, None)
        from desim.commands.views.ladder import tell
        from desim.report.campaign.writing import write

        page = write(folder, plan.design)
        if not quiet:
            tell(folder, plan.design)
            say(f"report: {page}")
        if failed:
            raise typer.Exit(1)

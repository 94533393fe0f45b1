"""The commands about many runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from desim.commands.ending import compiling, exits

DesignPath = Annotated[Path, typer.Argument(metavar="DESIGN", show_default=False,
                                            help="a design's YAML file")]


def add_to(app: typer.Typer) -> None:
    """Make them commands of ``app``."""
    app.command()(sweep)
    app.command()(deploy)


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
    goes on from there."""
    with exits():
        from desim.report.sweeping import Told

        told = Told(quiet)
        with compiling(quiet):
            from desim.campaign import campaign
            from desim.campaign.clustersettings import load_settings
            from desim.campaign.design import load_design

            where = None if cluster is None else load_settings(cluster, jobs)
            plan = told.planned(load_design(design))
            chosen = campaign.selected(plan, tuple(only))
            metrics = campaign.Metrics(plan)
        folder = out or campaign.default_folder(plan.loaded)
        with campaign.Sweep(plan, metrics, folder, only=chosen,
                            retry_failed=retry_failed) as work:
            if dry_run:
                told.listed(work)
            else:
                told.carried_out(work, jobs, where)


def deploy(design: DesignPath,
           robots_per_node: Annotated[int | None, typer.Option(
               min=1, help="virtual machines on a node (default: the scenario's "
                           "testbed.robots_per_node)", show_default=False)] = None,
           image: Annotated[str, typer.Option(
               metavar="SIZE", help="of a virtual machine's image")] = "4 GB",
           model: Annotated[str, typer.Option(help="a network plug-in, of the cluster's LAN")] = (
               "switch"),
           rate: Annotated[str, typer.Option(help="of the LAN's links")] = "1 Gb/s",
           as_json: Annotated[bool, typer.Option("--json", help="one JSON object")] = False,
           ) -> None:
    """Plan the paper's cluster for a design: nodes, which robots are on which, how the image of
    their virtual machines gets there, and what the runs would take in real time."""
    with exits():
        from desim import options
        from desim.report.sweeping import Told

        with compiling(as_json):
            from desim.campaign.design import load_design
            from desim.report import deploying

            words = [f"--image={image}", f"--model={model}", f"--rate={rate}"]
            if robots_per_node is not None:
                words.append(f"--robots-per-node={robots_per_node}")
            cluster = options.parsed(words, deploying.Cluster)
            plan = Told(as_json).planned(load_design(design))
        deployment = deploying.planned(plan, cluster)
        if as_json:
            import json

            typer.echo(json.dumps(deployment, indent=2))
            return
        deploying.show(deployment)

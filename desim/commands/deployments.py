"""The command about the paper's cluster."""

from __future__ import annotations

from typing import Annotated

import typer

from desim.commands.campaigns import DesignPath, planned
from desim.commands.compiling import compiling
from desim.commands.exit_codes import exit_codes
from desim.commands.output import say_json


def add_to(app: typer.Typer) -> None:
    """Make it a command of ``app``."""
    app.command()(deploy)


def deploy(design: DesignPath,
           robots_per_node: Annotated[int | None, typer.Option(
               min=1, help="virtual machines on a node (default: the scenario's "
                           "testbed.robots_per_node)", show_default=False)] = None,
           image: Annotated[str, typer.Option(
               metavar="SIZE", help="of a virtual machine's image")] = "6.8 GB",
           model: Annotated[str, typer.Option(help="a network plug-in, of the cluster's LAN")] = (
               "switch"),
           rate: Annotated[str, typer.Option(help="of the LAN's links")] = "1 Gb/s",
           as_json: Annotated[bool, typer.Option("--json", help="one JSON object")] = False,
           ) -> None:
    """Plan the paper's cluster for a design: nodes, which robots are on which, how the image of
    their virtual machines gets there, and what the runs would take in real time."""
    with exit_codes():
        from desim.commands import options
        from desim.commands.views.sweep import console

        with compiling(as_json):
            from desim.campaign.design.design import load_design
            from desim.commands.views.deployment import TestbedOptions, deployment_of, show

            chosen = options.checked({"image": image, "model": model, "rate": rate,
                                      "robots_per_node": robots_per_node}, TestbedOptions)
            plan = planned(load_design(design), console(as_json))
        deployment = deployment_of(plan, chosen)
        if as_json:
            say_json(deployment)
            return
        show(deployment)

"""The cluster that the paper's testbed would need for a design: as a table, and as JSON."""

from __future__ import annotations

from typing import NamedTuple

from pydantic import Field
from rich.table import Table
from rich.text import Text

from desim import plugins
from desim.campaign.deploy import testbed
from desim.campaign.deploy.image_copy import round_ends_ns
from desim.campaign.design.plan import Plan
from desim.commands import options
from desim.commands.views.terminal import Terminal
from desim.errors import below
from desim.ports import Params, model_of, natural_key
from desim.units import BIT_RATE, BYTE_SIZE, NS_PER_S, BitRate, ByteSize

_WORDS = {
    "machine_by_machine": "for each virtual machine, in turn",
    "node_by_node": "for each node, in turn",
    "all_at_once": "for each node, all at once",
    "passed_on": "passed on by who has it",
}


class TestbedOptions(Params):
    """Properties of such a cluster that a design does not have."""

    __test__ = False

    robots_per_node: int | None = Field(None, ge=1, description=(
        "virtual machines on a node (the scenario's testbed.robots_per_node)"))
    image_bytes: ByteSize = Field("6.8 GB", ge=1_000_000, description="of a virtual machine "
                                  "(the paper)")
    model: str = Field("switch", description="a network plug-in (the paper: one LAN)")
    rate_bps: BitRate = Field("1 Gb/s", description="of its links (the paper: Gigabit Ethernet)")


class Copying(NamedTuple):
    """One way to copy the image, and the end of each of its rounds."""

    rounds: testbed.Rounds
    round_ends_s: list[float]


class Deployment(NamedTuple):
    """The cluster for a ``design``. ``copying`` is by way."""

    design: str
    chosen: TestbedOptions
    testbed: testbed.Placement
    copying: dict[str, Copying]
    demand: testbed.Demand


def deployment_of(plan: Plan, chosen: TestbedOptions) -> Deployment:
    """The cluster for a design, and the times of copying and of its runs."""
    bed = testbed.smallest_testbed(plan, chosen.robots_per_node)
    return Deployment(plan.design.name, chosen, bed, {
        name: _copied(way(bed), chosen) for name, way in testbed.WAYS.items()},
        testbed.demand(plan))


def _copied(rounds: testbed.Rounds, chosen: TestbedOptions) -> Copying:
    block = plugins.parameters("network", chosen.model)
    rate = BIT_RATE.format(chosen.rate_bps)
    with below(f"--model {chosen.model}"):
        model = model_of(plugins.load("network", chosen.model),
                         options.parsed(["--rate", rate], block))
        ends_ns = round_ends_ns(model, rounds, chosen.image_bytes)
    return Copying(rounds, [end_ns / NS_PER_S for end_ns in ends_ns])


def json_object(deployment: Deployment) -> dict[str, object]:
    """The deployment as an object for ``--json``: ``nodes`` to robots, ``copying`` by way, with
    ``rounds`` of [from, to]; the least and the most ``runs`` and their real time."""
    design, chosen, bed, copying, needs = deployment
    return {
        "design": design,
        "robots_per_node": bed.robots_per_node,
        "virtual_machines": bed.virtual_machines,
        "nodes": bed.nodes,
        "image_bytes": chosen.image_bytes,
        "network": {"model": chosen.model, "rate_bps": chosen.rate_bps},
        "copying": {name: {"seconds": ends_s[-1], "copies": sum(map(len, rounds)),
                           "round_ends_s": ends_s, "rounds": rounds}
                    for name, (rounds, ends_s) in copying.items()},
        "runs": {"least": needs.least_runs, "most": needs.most_runs},
        "real_time_s": {"least": needs.least_s, "most": needs.most_s},
    }


def show(deployment: Deployment, console: Terminal) -> None:
    """Print the deployment."""
    design, chosen, bed, copying, needs = deployment
    nodes, machines = len(bed.nodes), bed.virtual_machines
    console.print(f"{design}: {nodes} node{'s' * (nodes != 1)} for {machines} virtual "
                  f"machine{'s' * (machines != 1)}, up to {bed.robots_per_node} on a node, "
                  "beside the workstation with simulator and monitor")
    console.print(_placement(bed))
    console.print(f"\nCopies of an image of {BYTE_SIZE.format(chosen.image_bytes)} over "
                  f"{chosen.model}, {BIT_RATE.format(chosen.rate_bps)}:")
    console.print(_copying(copying))
    console.print("\nPassed on:")
    console.print(_rounds(copying["passed_on"]))
    console.print(f"\n{_span(needs.least_runs, needs.most_runs, '{:,}')} runs in real time, each "
                  "to its limit at most: "
                  f"{_span(needs.least_s / 3600, needs.most_s / 3600, '{:.1f}')} h, starting and "
                  "stopping left out")


def _span(least: float, most: float, form: str) -> str:
    first, last = form.format(least), form.format(most)
    return first if first == last else f"{first} to {last}"


def _plain(*right: int, columns: tuple[str, ...]) -> Table:
    table = Table(box=None, padding=(0, 2, 0, 0), header_style="dim")
    for number, column in enumerate(columns):
        table.add_column(column, justify="right" if number in right else "left",
                         overflow="fold")
    return table


def _placement(bed: testbed.Placement) -> Table:
    table = _plain(columns=("node", "robots"))
    for node, robots in bed.nodes.items():
        table.add_row(Text(node, "cyan"), Text(", ".join(sorted(robots, key=natural_key))))
    return table


def _copying(ways: dict[str, Copying]) -> Table:
    table = _plain(1, 2, 3, 4, columns=("", "copies", "rounds", "seconds", "against naive"))
    naive_s = ways["machine_by_machine"].round_ends_s[-1]
    for name, (rounds, round_ends_s) in ways.items():
        times = round(naive_s / round_ends_s[-1], 1)
        table.add_row(Text(_WORDS[name], "cyan"), str(sum(map(len, rounds))), str(len(rounds)),
                      f"{round_ends_s[-1]:.1f}", f"{times} x faster" if times > 1.0 else "")
    return table


def _rounds(way: Copying) -> Table:
    table = _plain(1, columns=("round", "over at", "copies"))
    for number, (copies, end_s) in enumerate(zip(*way, strict=True), 1):
        text = ", ".join(f"{source} to {taker}" for source, taker in copies)
        table.add_row(Text(str(number), "cyan"), f"{end_s:.1f} s", Text(text))
    return table

"""The paper's cluster for a design: as a table, and as JSON."""

from __future__ import annotations

from typing import TypedDict

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
from desim.ports import Params, natural_key
from desim.units import BIT_RATE, BYTE_SIZE, NS_PER_S, BitRate, ByteSize

_WORDS = {
    "machine_by_machine": "for each virtual machine, in turn",
    "node_by_node": "for each node, in turn",
    "all_at_once": "for each node, all at once",
    "passed_on": "passed on by who has it",
}


class TestbedOptions(Params):
    """Properties of the paper's cluster that a design does not have."""

    __test__ = False

    robots_per_node: int | None = Field(None, ge=1, description=(
        "virtual machines on a node (the scenario's testbed.robots_per_node)"))
    image_bytes: ByteSize = Field("6.8 GB", ge=1_000_000, description="of a virtual machine "
                                  "(the paper)")
    model: str = Field("switch", description="a network plug-in (the paper: one LAN)")
    rate_bps: BitRate = Field("1 Gb/s", description="of its links (the paper: Gigabit Ethernet)")


class Copying(TypedDict):
    """One way to copy the image: ``rounds`` of [from, to]."""

    seconds: float
    copies: int
    round_ends_s: list[float]
    rounds: list[list[list[str]]]


class Lan(TypedDict):
    """The cluster's network."""

    model: str
    rate_bps: int


class Deployment(TypedDict):
    """The output of ``desim deploy --json``: ``nodes`` to robots, ``copying`` by way, the least and
    the most ``runs`` and their real time."""

    design: str
    robots_per_node: int
    virtual_machines: int
    nodes: dict[str, list[str]]
    image_bytes: int
    network: Lan
    copying: dict[str, Copying]
    runs: dict[str, int]
    real_time_s: dict[str, float]


def deployment_of(plan: Plan, chosen: TestbedOptions) -> Deployment:
    """The cluster for a design, and the times of copying and of its runs."""
    bed = testbed.smallest_testbed(plan, chosen.robots_per_node)
    needs = testbed.demand(plan)
    return {
        "design": plan.design.name,
        "robots_per_node": bed.robots_per_node,
        "virtual_machines": bed.virtual_machines,
        "nodes": {node: list(robots) for node, robots in bed.nodes.items()},
        "image_bytes": chosen.image_bytes,
        "network": {"model": chosen.model, "rate_bps": chosen.rate_bps},
        "copying": {name: _copied(way(bed), chosen) for name, way in testbed.WAYS.items()},
        "runs": {"least": needs.least_runs, "most": needs.most_runs},
        "real_time_s": {"least": needs.least_s, "most": needs.most_s},
    }


def _copied(rounds: testbed.Rounds, chosen: TestbedOptions) -> Copying:
    block = plugins.parameters("network", chosen.model)
    rate = BIT_RATE.format(chosen.rate_bps)
    with below(f"--model {chosen.model}"):
        model = plugins.load("network", chosen.model)(options.parsed(["--rate", rate], block))
        ends_ns = round_ends_ns(model, rounds, chosen.image_bytes)
    ends_s = [end_ns / NS_PER_S for end_ns in ends_ns]
    return {"seconds": ends_s[-1], "copies": sum(map(len, rounds)), "round_ends_s": ends_s,
            "rounds": [[list(copy) for copy in copies] for copies in rounds]}


def show(deployment: Deployment) -> None:
    """Print the deployment."""
    console = Terminal(highlight=False, soft_wrap=True, markup=False, emoji=False)
    nodes = deployment["nodes"]
    machines, per_node = deployment["virtual_machines"], deployment["robots_per_node"]
    console.print(f"{deployment['design']}: {len(nodes)} node{'s' * (len(nodes) != 1)} for "
                  f"{machines} virtual machine{'s' * (machines != 1)}, up to {per_node} on a node, "
                  "beside the workstation with simulator and monitor")
    console.print(_placement(deployment))
    size = BYTE_SIZE.format(deployment["image_bytes"])
    network = deployment["network"]
    console.print(f"\nCopies of an image of {size} over {network['model']}, "
                  f"{BIT_RATE.format(network['rate_bps'])}:")
    console.print(_copying(deployment["copying"]))
    console.print("\nPassed on:")
    console.print(_rounds(deployment["copying"]["passed_on"]))
    runs, real_s = deployment["runs"], deployment["real_time_s"]
    console.print(f"\n{_span(runs['least'], runs['most'], '{:,}')} runs in real time, each to its "
                  f"limit at most: {_span(real_s['least'] / 3600, real_s['most'] / 3600, '{:.1f}')}"
                  " h, starting and stopping left out")


def _span(least: float, most: float, form: str) -> str:
    first, last = form.format(least), form.format(most)
    return first if first == last else f"{first} to {last}"


def _plain(*right: int, columns: tuple[str, ...]) -> Table:
    table = Table(box=None, padding=(0, 2, 0, 0), header_style="dim")
    for number, column in enumerate(columns):
        table.add_column(column, justify="right" if number in right else "left",
                         overflow="fold")
    return table


def _placement(deployment: Deployment) -> Table:
    table = _plain(columns=("node", "robots"))
    for node, robots in deployment["nodes"].items():
        table.add_row(Text(node, "cyan"), Text(", ".join(sorted(robots, key=natural_key))))
    return table


def _copying(ways: dict[str, Copying]) -> Table:
    table = _plain(1, 2, 3, 4, columns=("", "copies", "rounds", "seconds", "against naive"))
    naive_s = ways["machine_by_machine"]["seconds"]
    for name, way in ways.items():
        table.add_row(Text(_WORDS[name], "cyan"), str(way["copies"]), str(len(way["rounds"])),
                      f"{way['seconds']:.1f}", f"{naive_s / way['seconds']:.1f} x faster"
                      if way["seconds"] < naive_s else "")
    return table


def _rounds(way: Copying) -> Table:
    table = _plain(1, columns=("round", "over at", "copies"))
    for number, (copies, end_s) in enumerate(
            zip(way["rounds"], way["round_ends_s"], strict=True), 1):
        text = ", ".join(f"{source} to {taker}" for source, taker in copies)
        table.add_row(Text(str(number), "cyan"), f"{end_s:.1f} s", Text(text))
    return table

"""The cluster that the paper's testbed would need for a design: nodes, virtual machines, images.

Each robot has a virtual machine on one of the nodes; the machines get their image in an order.
Nodes: equation 7 of Yan, Fabresse, Laval and Bouraqadi 2017. Copying: their Algorithm 2 copies the
image to each node once and clones it there. Placement, and the copying to all nodes at once: as the
scripts of their testbed do it (github.com/yzrobot/mrs_testbed, scripts/submit_job.sh,
start_simulation.sh, vm_setup_main.sh). The other ways of copying are for comparison.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from desim.campaign.design.plan import Plan
from desim.scenario.cluster_nodes import by_node
from desim.scenario.names import robot_names

SERVER = "server"  # where the image is at first

Copy = tuple[str, str]  # from, to
Rounds = list[list[Copy]]  # copies at the same time; a round begins when the one before is over


class Placement(NamedTuple):
    """A placement of virtual machines: ``nodes`` by name, in order, with the robots whose machines
    they run."""

    robots_per_node: int
    nodes: Mapping[str, tuple[str, ...]]

    @property
    def virtual_machines(self) -> int:
        """The number of virtual machines: one for each robot that has software."""
        return sum(map(len, self.nodes.values()))


class Demand(NamedTuple):
    """The number of a design's runs, and their real time if each takes its time limit."""

    least_runs: int
    most_runs: int
    least_s: float
    most_s: float


def smallest_testbed(plan: Plan, robots_per_node: int | None = None) -> Placement:
    """The smallest placement with room for every run of the design, with so many robots on a node
    (None: as in the scenarios)."""
    scenarios = (plan.scenario(vector, 0).scenario for vector in plan.vectors)
    return max((placed([name for name in robot_names(scenario)
                        if name not in scenario.robot.passive],
                       robots_per_node or scenario.testbed.robots_per_node)
                for scenario in scenarios),
               key=lambda testbed: (len(testbed.nodes), testbed.virtual_machines))


def placed(robots: Sequence[str], robots_per_node: int) -> Placement:
    """The placement node by node."""
    return Placement(robots_per_node, by_node(robots, robots_per_node))


def demand(plan: Plan) -> Demand:
    """The demand of the whole design."""
    each_s = sum(plan.scenario(vector, 0).scenario.stop.elapsed_ns for vector in plan.vectors) / 1e9
    least, most, vectors = plan.least_iterations, plan.most_iterations, len(plan.vectors)
    return Demand(least * vectors, most * vectors, least * each_s, most * each_s)


def machine_by_machine(testbed: Placement) -> Rounds:
    """An image for each virtual machine, one after the other: the naive way, without cloning."""
    return [[(SERVER, node)] for node, robots in testbed.nodes.items() for _ in robots]


def node_by_node(testbed: Placement) -> Rounds:
    """An image for each node, one after the other."""
    return [[(SERVER, node)] for node in testbed.nodes]


def all_at_once(testbed: Placement) -> Rounds:
    """Every node copies from the server at the same time."""
    return [[(SERVER, node) for node in testbed.nodes]]


def passed_on(testbed: Placement) -> Rounds:
    """Every host that has the image copies it to a node that has not. The number of copies doubles
    each round, so that ceil(log2(nodes + 1)) rounds suffice (a binomial tree)."""
    waiting = list(testbed.nodes)
    have, rounds = [SERVER], []
    while waiting:
        takers, waiting = waiting[:len(have)], waiting[len(have):]
        rounds.append(list(zip(have, takers, strict=False)))
        have += takers
    return rounds


WAYS = {way.__name__: way for way in (machine_by_machine, node_by_node, all_at_once, passed_on)}


def hosts_of(rounds: Iterable[Iterable[Copy]]) -> tuple[str, ...]:
    """All sources and receivers, in the order of the copies."""
    return tuple(dict.fromkeys(host for copies in rounds for copy in copies for host in copy))

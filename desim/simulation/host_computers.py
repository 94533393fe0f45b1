"""The computers of a scenario's hosts, and the cluster's nodes on which virtual machines run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction

from desim import plugins
from desim.computers.cluster_node import ClusterNode
from desim.computers.computer import Computer
from desim.computers.costs.ideal import IdealComputers
from desim.computers.memory import Memory
from desim.computers.processors import Processors
from desim.computers.scheduling import DISCIPLINES
from desim.engine.kernel import Kernel
from desim.engine.trace import Trace
from desim.errors import below
from desim.ports.computers import MemoryModel
from desim.scenario.schema.scenario import Scenario
from desim.simulation.deployment import HostPlan


def computers_of(scenario: Scenario, hosts: Sequence[HostPlan], kernel: Kernel, trace: Trace
                 ) -> dict[str, Computer] | None:
    """The computers of ``hosts`` by name; None where nothing takes time."""
    choice = scenario.computers
    with below("computers"):
        costs = plugins.load(choice.kind, choice.plugin)(choice.params)
    if type(costs) is IdealComputers:  # a plug-in that inherits from it has costs of its own
        return None
    return {host.name: Computer(
        Processors(kernel, trace.names.id(host.name), host.computer.processors,
                   Fraction(str(host.computer.speed)), DISCIPLINES[host.computer.scheduling]()),
        costs, host.computer.priorities,
        Memory(costs, host.computer.memory_bytes)
        if isinstance(costs, MemoryModel) and not host.passive else None)
        for host in hosts}


def cluster_nodes_of(scenario: Scenario, hosts: Sequence[HostPlan], kernel: Kernel,
                     computers: Mapping[str, Computer]) -> dict[str, ClusterNode]:
    """The nodes of testbed's cluster by name, whose processors virtual machines share."""
    machines: dict[str, list[Processors]] = {}
    for host in hosts:
        if host.node is not None:
            machines.setdefault(host.node, []).append(computers[host.name].processors)
    return {node: ClusterNode(kernel, scenario.testbed.processors_per_node, own)
            for node, own in machines.items()}

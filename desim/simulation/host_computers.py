"""The computers of a scenario's hosts, and the cluster's nodes on which virtual machines run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
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
from desim.errors import InputError, below
from desim.ports.computers import MemoryModel
from desim.scenario.robot_types import equipment_by_path
from desim.scenario.schema.computer import ComputerParams
from desim.scenario.schema.scenario import Scenario
from desim.simulation.deployment import HostPlan
from desim.units import BYTE_SIZE


def computers_of(scenario: Scenario, hosts: Sequence[HostPlan], kernel: Kernel, trace: Trace
                 ) -> dict[str, Computer] | None:
    """The computers of ``hosts`` by name; None where nothing takes time. Raises ``InputError`` for
    memory without room beside the system."""
    choice = scenario.computers
    with below("computers"):
        costs = plugins.load(choice.kind, choice.plugin)(choice.params)
    if type(costs) is IdealComputers:  # a plug-in that inherits from it has costs of its own
        return None
    if isinstance(costs, MemoryModel):
        _refuse_small(scenario, costs)
    return {host.name: Computer(
        Processors(kernel, trace.names.id(host.name), host.computer.processors,
                   Fraction(str(host.computer.speed)), DISCIPLINES[host.computer.scheduling]()),
        costs, host.computer.priorities,
        Memory(costs, host.computer.memory_bytes)
        if isinstance(costs, MemoryModel) and not host.passive else None)
        for host in hosts}


def _refuse_small(scenario: Scenario, costs: MemoryModel) -> None:
    limits = {key: computer.memory_bytes for key, computer in _by_key(scenario)
              if computer.memory_bytes is not None}
    system_bytes = Memory(costs, None).system_bytes() if limits else 0
    wanted = (f"must be above {BYTE_SIZE.format(system_bytes)}, which the system takes with "
              f"computers: {plugins.bare(scenario.computers.model)}, got")
    small = [f"{key}.memory: {wanted} {BYTE_SIZE.format(limit_bytes)!r}"
             for key, limit_bytes in limits.items() if limit_bytes <= system_bytes]
    if small:
        raise InputError(*small)


def _by_key(scenario: Scenario) -> Iterator[tuple[str, ComputerParams]]:
    """The computers that a scenario describes, with their keys."""
    fleet = scenario.robot
    for path, own in equipment_by_path(scenario):
        if own is fleet or own.computer != fleet.computer:
            yield f"{'.'.join(map(str, path))}.computer", own.computer
    if scenario.deployment == "testbed":
        yield "testbed.computer", scenario.testbed.computer
    for name, host in scenario.hosts.items():
        yield f"hosts.{name}.computer", host.computer


def cluster_nodes_of(scenario: Scenario, hosts: Sequence[HostPlan], kernel: Kernel,
                     computers: Mapping[str, Computer]) -> dict[str, ClusterNode]:
    """The nodes of testbed's cluster by name, whose processors virtual machines share."""
    machines: dict[str, list[Processors]] = {}
    for host in hosts:
        if host.node is not None:
            machines.setdefault(host.node, []).append(computers[host.name].processors)
    return {node: ClusterNode(kernel, scenario.testbed.processors_per_node, own)
            for node, own in machines.items()}

"""The model's hosts in a cell: each runs one node, which acts as the row says."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from desim.middleware.host import Host
from desim.middleware.node import Node
from desim.simulation.simulation import Simulation
from desim.validation.laboratory import LabNode
from desim.validation.real.cell import Attach, Cell, Heard


def attached(lives: Mapping[str, Callable[[LabNode], object]]) -> Attach:
    """The function that lets the hosts of a cell run these nodes, by their parts."""
    def attach(simulation: Simulation, cell: Cell) -> Callable[[], list[Heard]]:
        nodes: dict[str, LabNode] = {}

        def software(part: str) -> Callable[[Host], list[Node]]:
            def begin(host: Host) -> list[Node]:
                nodes[part] = LabNode(host, lives[part])
                return [nodes[part]]
            return begin

        for part in lives:
            simulation.graph.host(cell.host(part)).software = software(part)
        return lambda: [Heard(part, number, at_s, born_s) for part, node in nodes.items()
                        for at_s, _, number, born_s in node.received]
    return attach

"""The nodes of testbed's cluster, and which robots' virtual machines each of them runs."""

from __future__ import annotations

from collections.abc import Sequence

from desim.scenario.names import robot_names
from desim.scenario.schema.scenario import Scenario


def cluster_nodes(scenario: Scenario) -> dict[str, tuple[str, ...]]:
    """The nodes of testbed's cluster by name, in order, with the robots whose virtual machines they
    run; a robot without software has none."""
    passive = frozenset(scenario.robot.passive)
    return by_node([name for name in robot_names(scenario) if name not in passive],
                   scenario.testbed.robots_per_node)


def by_node(robots: Sequence[str], robots_per_node: int) -> dict[str, tuple[str, ...]]:
    """The nodes with their ``robots``: number i of these is on node floor(i / robots per node)."""
    return {f"node_{node}": tuple(robots[first:first + robots_per_node])
            for node, first in enumerate(range(0, len(robots), robots_per_node))}

"""The truth about a run, which its monitor sees and no robot."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from desim.computers.cluster_node import ClusterNode
from desim.engine.kernel import Kernel
from desim.engine.trace import Trace
from desim.middleware.graph import Graph
from desim.middleware.host import Host
from desim.monitor.meters.meter import Second
from desim.ports.tasks import Ground
from desim.robot.coordination.task_link import TaskLink
from desim.scenario.schema.power import PowerParams
from desim.scenario.schema.scenario import Scenario


@dataclass(frozen=True, eq=False)
class Truth:
    """The truth about one run.

    ``robots`` names in index order, ``explorers`` those of them that carry software; each is the
    name of its host, too. ``poses()`` gives [robots, 3] x m, y m, yaw rad, ``travelled_m()``
    [robots] m. ``nodes`` of the cluster, by name. ``powers`` of the robots; None where energy is
    not measured. ``hold(robot)`` blocks its drive; ``link`` joins task and strategies.
    """

    kernel: Kernel
    trace: Trace
    scenario: Scenario
    robots: tuple[str, ...]
    explorers: tuple[str, ...]
    ground: Ground
    graph: Graph
    poses: Callable[[], np.ndarray]
    travelled_m: Callable[[], np.ndarray]
    nodes: Mapping[str, ClusterNode] = field(default_factory=dict)
    powers: Sequence[PowerParams | None] = ()
    hold: Callable[[str], None] = lambda robot: None
    link: TaskLink = field(default_factory=TaskLink)

    @cached_property
    def hosts(self) -> list[Host]:
        """Those of the robots."""
        return [self.graph.host(name) for name in self.robots]

    @cached_property
    def explorer_hosts(self) -> list[Host]:
        """Those of the explorers."""
        return [host for host in self.hosts if host.name in self.explorers]

    @cached_property
    def loaded(self) -> list[Host]:
        """Those whose loads count in means: of the robots with software, if any has some."""
        return [self.graph.host(name) for name in self.explorers or self.robots]

    @cached_property
    def stationary(self) -> list[Host]:
        """Those without a body: a workstation, a base."""
        return [host for host in self.graph.hosts if host not in self.hosts]

    @cached_property
    def with_software(self) -> list[Host]:
        """All but robots that carry none."""
        return [*self.explorer_hosts, *self.stationary]

    def linked(self) -> np.ndarray | None:
        """[n, n] bool of the explorers that are up: do frames get from one to the other now? None:
        between all."""
        is_up = self.graph.up
        up = [host.index for host in self.explorer_hosts if is_up[host.index]]
        return self.graph.linked(np.array(up, np.int64))

    def second(self) -> Second:
        """The truth of now."""
        return Second(self.kernel.now_ns, self.poses().copy(), self.travelled_m().copy(),
                      self.linked())

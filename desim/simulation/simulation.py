"""The composition root: builds the parts of a run from a scenario, wires them, runs.

The one place that knows every part. Nothing here computes; it says who is connected to whom.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from typing import Any, NamedTuple

import numpy as np

from desim import plugins
from desim.engine.garbage import rare_collections
from desim.engine.kernel import Kernel, Phase
from desim.engine.streams import Streams
from desim.engine.trace import Names, Trace
from desim.middleware.graph import Host, Node
from desim.monitor.coverage import Ground
from desim.monitor.monitor import Monitor
from desim.ports import World
from desim.robot.software import robot_software
from desim.robot.tiles import Belief, TilePool
from desim.scenario.schema.whole import Scenario
from desim.simulation.deployment import HostPlan, plan
from desim.simulation.drivers import Driver
from desim.simulation.monitor_node import MonitorNode
from desim.simulation.wiring import HostPlaces, wired
from desim.simulation.world_clock import WorldClock


class Outcome(NamedTuple):
    """How a run ended: why, when, and the digests of its trace."""

    stop_reason: str
    simulated_ns: int
    events: int
    digest: str
    digest_by_entity: dict[str, str]


class Simulation:
    """One run of ``scenario``, built and ready.

    ``payloads``: when lazy contents are computed (lazy, birth, delivery: no result depends on it).
    ``trace_sink`` gets every trace row in batches, ``on_fate`` each message's fate; see ``Trace``
    and ``Graph``. Raises ``InputError`` for what only shows when the parts meet: a start inside a
    wall, an unreachable terrain.
    """

    def __init__(self, scenario: Scenario, *, payloads: str = "lazy",
                 trace_sink: Callable[[np.ndarray], None] | None = None,
                 on_fate: Callable[..., Any] | None = None) -> None:
        self.scenario = scenario
        self.names = Names()
        self.trace = Trace(self.names, trace_sink)
        self.kernel = Kernel()
        self.streams = Streams(scenario.seed)
        self.world: World = plugins.load("world", scenario.physics.model).build(
            scenario, self.streams)
        self.plan = plan(scenario)
        self.graph = wired(scenario, HostPlaces(self.world, self.plan), self.kernel, self.trace,
                           self.streams, [host.name for host in self.plan], payloads=payloads,
                           on_fate=on_fate)
        self._pool = TilePool()
        self.grid = self.world.grid(scenario.robot.mapping.resolution_m)
        controlled = [host.software for host in self.plan if host.software is not None]
        explorers = tuple(self.world.robots[robot] for robot in controlled)
        seers = controlled or range(len(self.world.robots))
        self.monitor = Monitor(
            self.kernel, self.trace, scenario, robots=self.world.robots, explorers=explorers,
            ground=Ground(self.grid, *self.world.ground(self.grid, seers)), graph=self.graph,
            poses=lambda: self.world.snapshot().poses, travelled_m=self.world.travelled_m)
        self._explorers = explorers
        self._drivers: dict[str, Driver] = {}
        self._clock = WorldClock(self.kernel, self.world, self.trace, scenario,
                                 self._speaking, self.monitor.collided)
        for host_plan in self.plan:
            self._install(host_plan)
        for number, fault in enumerate(scenario.faults):
            self.kernel.process(self._outage(fault), Phase.WORLD,
                                self.names.id(f"fault {number} of {fault.host}"))

    def run(self, until_ns: int | None = None) -> Outcome:
        """Run until a stop condition holds, or ``until_ns``."""
        limit_ns = self.scenario.stop.elapsed_ns
        if until_ns is not None:
            limit_ns = min(limit_ns, until_ns)
        self.graph.start()
        with rare_collections():
            self.kernel.run(limit_ns)
        self.monitor.finish()
        return Outcome(self.monitor.stop_reason, self.kernel.now_ns, self.kernel.events,
                       self.trace.digest(), self.trace.digest_by_entity())

    def interrupt(self) -> None:
        """End the run when the present instant is complete."""
        self.monitor.stop_reason = "interrupted"
        self.kernel.stop()

    def _speaking(self) -> Iterator[Driver]:
        """The drivers of the hosts that are up, in the order of hosts."""
        return (self._drivers[host.name] for host in self.plan if host.name in self._drivers)

    def _install(self, host_plan: HostPlan) -> None:
        """Tell the host what to run whenever it starts."""
        self.graph.host(host_plan.name).software = lambda host: self.nodes(host, host_plan)

    def nodes(self, host: Host, host_plan: HostPlan) -> list[Node]:
        """What the host runs, made afresh and not started."""
        scenario, nodes = self.scenario, []
        if host_plan.drives:
            driver = Driver(host, self.world, host_plan.drives, scenario.robot.scanner)
            self._drivers[host.name] = driver
            nodes.append(driver)
        if host_plan.monitor:
            nodes.append(MonitorNode(host, self._explorers))
        if host_plan.software is not None:
            belief = Belief(self.grid, self._pool)
            self.monitor.watch(host.name, belief)
            nodes += robot_software(host, scenario, self.world.body(host_plan.software), belief,
                                    tuple(n for n in self._explorers if n != host.name),
                                    monitored=any(other.monitor for other in self.plan))
        return nodes

    def _outage(self, fault: Any) -> Generator[int, None, None]:
        host = self.graph.host(fault.host)
        yield fault.at_ns
        host.stop()
        self._drivers.pop(host.name, None)
        if host.name in self._explorers:
            self.monitor.watch(host.name, None)
        if fault.down_for_ns is not None:
            yield fault.down_for_ns
            host.start()

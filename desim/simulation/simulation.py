"""The composition root: it builds the parts of a run from a scenario, connects them, runs them.

The one place that knows every part. Robots meet only through the world (matter) and the graph with
its media (messages); one kernel holds the clock, one trace is the log, and the monitor watches.
Nothing is computed here.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Generator, Sequence
from functools import cached_property, partial
from operator import attrgetter
from typing import NamedTuple

from desim import plugins
from desim.engine.garbage import rare_collections
from desim.engine.kernel import Kernel, Phase
from desim.engine.streams import Streams
from desim.engine.trace import Names, RowSink, Trace
from desim.middleware.fates import OnFate
from desim.middleware.graph_options import GraphOptions
from desim.middleware.host import Host
from desim.middleware.message_ledger import MessageLedger
from desim.middleware.node import Node
from desim.monitor.monitor import Monitor, StopReason
from desim.monitor.recorder import Recorder
from desim.monitor.truth import Truth
from desim.ports import HasDoubts, Pose2D, SwitchesAccessPoints
from desim.ports.sharing import SharingTraits
from desim.ports.tasks import GivesMap, Ground
from desim.robot.declared_traffic import (
    Copied,
    CopyPublisher,
    PassiveListener,
    PeriodicPublisher,
    with_copies,
)
from desim.robot.mapping.fusion import robot_map_of
from desim.robot.mapping.map_server import MapServer, map_of_terrain
from desim.robot.mapping.robot_map import RobotMap
from desim.robot.mapping.tiles import TilePool
from desim.robot.software import Pilot, coordinator_software, remote_slam, robot_software
from desim.robot.team import Team
from desim.robot.transform_broadcaster import TransformBroadcaster, of_odometry
from desim.scenario.names import access_point_names
from desim.scenario.recipients import topics_for
from desim.scenario.robot_types import equipment_of, strategies_of
from desim.scenario.schema.communication import Fault
from desim.scenario.schema.scenario import Scenario
from desim.simulation.deployment import HostPlan, plan
from desim.simulation.drivers import Driver, copied_by_processes
from desim.simulation.host_clocks import set_clocks
from desim.simulation.host_computers import cluster_nodes_of, computers_of
from desim.simulation.link_signals import LinkSignals
from desim.simulation.monitor_node import MonitorNode
from desim.simulation.wiring import HostPlaces, wired
from desim.simulation.world_events import WorldEvents
from desim.world.physics import world_of


class Outcome(NamedTuple):
    """The end of a run: its reason (``StopReason``, or the condition that was met), its instant,
    and the digests of its trace."""

    stop_reason: str
    simulated_ns: int
    events: int
    digest: str
    digest_by_entity: dict[str, str]


class Simulation:
    """One run of ``scenario``, built and ready.

    ``payloads``: when lazy contents are computed (lazy, birth, delivery: no result depends on it).
    ``trace_sink`` gets all trace rows, in batches, and ``on_fate`` each message's fate; see
    ``Trace`` and ``Graph``. ``recorder`` watches the run; it gets trace rows from the sink. A
    ``ledger`` gets the fates and passes them on. ``pilot(robot, strategy)`` returns the strategy
    that is asked in place of the robot's own. Raises ``InputError`` for errors that show only
    when the parts are put together: a start inside a wall, an unreachable terrain.
    """

    def __init__(self, scenario: Scenario, *, payloads: str = "lazy",
                 trace_sink: RowSink | None = None,
                 on_fate: OnFate | None = None, recorder: Recorder | None = None,
                 ledger: MessageLedger | None = None, pilot: Pilot | None = None) -> None:
        self.scenario, self._pilot = scenario, pilot
        # The clock, the random numbers, the log.
        self.kernel, self.streams, self.names = Kernel(), Streams(scenario.seed), Names()
        self.trace = Trace(self.names, trace_sink)
        # Matter: terrain and bodies.
        self.world = world_of(scenario, self.streams)
        self.grid = self.world.grid(scenario.robot.mapping.resolution_m)
        self._equipment, self._strategies = equipment_of(scenario), strategies_of(scenario)
        # Messages: the hosts, their middleware, and the media between them.
        self.plan = plan(scenario)
        places = HostPlaces(self.world, self.plan, scenario.network.others.values())
        busy = computers_of(scenario, self.plan, self.kernel, self.trace)
        self._nodes = cluster_nodes_of(scenario, self.plan, self.kernel, busy) if busy else {}
        self.graph = wired(scenario, places, self.kernel, self.trace, self.streams,
                           [host.name for host in self.plan], GraphOptions(
                               payloads=payloads, on_fate=ledger or on_fate,
                               passages=None if ledger is None else ledger.passages,
                               callbacks=None if ledger is None else ledger.callbacks,
                               computers=busy))
        set_clocks(self.graph, self.plan)
        self._signals = LinkSignals(self.graph, places)
        # The observer, and what drives sensors and motors.
        self._controlled = [host.software for host in self.plan if host.software is not None]
        self._explorers = tuple(self.world.robots[robot] for robot in self._controlled)
        self._publications = [(self.world.robots[robot], publication) for robot in self._controlled
                              for publication in self._equipment[robot].publishes]
        self._stuck: set[int] = set()  # robots whose drive is blocked
        self.monitor = self._new_monitor()
        self._watchers: list[Monitor | Recorder] = [self.monitor]
        if recorder is not None:
            recorder.begin(self.kernel, self.names, self.world, self.grid, self.graph,
                           self.monitor)
            self._watchers.append(recorder)
        self._drivers: list[Driver] = []  # of the hosts that are up, in the order of hosts
        self._world_events = WorldEvents(self.kernel, self.world, self.trace, scenario,
                                         self._drivers, self.monitor.incidents.collided)
        # The software of each host, which starts with it, and the faults that stop hosts.
        self._pool = TilePool()
        task = self.monitor.task
        self._terrain_map = (map_of_terrain(self._pool, self.monitor.truth.ground)
                             if isinstance(task, GivesMap) and task.gives_map() else None)
        for host_plan in self.plan:
            self.graph.host(host_plan.name).software = partial(self.nodes, host_plan=host_plan)
        self._outages: Counter[str] = Counter()  # that keep a host down
        self.graph.listeners["out_of_memory"] = self._out_of_memory
        for number, fault in enumerate(scenario.faults):
            self.kernel.process(self._outage(fault), Phase.WORLD,
                                self.names.id(f"fault {number} of {fault.host}"))

    def _new_monitor(self) -> Monitor:
        explorers = self._controlled or range(len(self.world.robots))
        task = plugins.load("task", self.scenario.task.model)(self.scenario.task.params)
        return Monitor(Truth(
            self.kernel, self.trace, self.scenario, self.world.robots, self._explorers,
            Ground(self.grid, *self.world.ground(self.grid, explorers),
                   self.world.doubts() if isinstance(self.world, HasDoubts) else ()),
            self.graph, lambda: self.world.snapshot().poses, self.world.travelled_m, self._nodes,
            [own.power if robot in self._controlled else None
             for robot, own in enumerate(self._equipment)], hold=self._hold), task, self.streams)

    def run(self, until_ns: int | None = None) -> Outcome:
        """Run until a stop condition holds, or ``until_ns``."""
        limit_ns = self.scenario.stop.elapsed_ns
        if until_ns is not None:
            limit_ns = min(limit_ns, until_ns)
        self.graph.start()
        with rare_collections():
            self.kernel.run(limit_ns)
        return self.outcome()

    def outcome(self) -> Outcome:
        """Close the run as it is now."""
        reason = self.monitor.finish()
        return Outcome(reason, self.kernel.now_ns, self.kernel.events, self.trace.digest(),
                       self.trace.digest_by_entity())

    def interrupt(self) -> None:
        """End the run when the present instant is complete."""
        self.monitor.stop_reason = StopReason.INTERRUPTED
        self.kernel.stop()

    def nodes(self, host: Host, host_plan: HostPlan) -> list[Node]:
        """New nodes of a host's software, not started."""
        scenario = self.scenario
        nodes: list[Node] = []
        robot_map: RobotMap | None = None
        if host_plan.drives:
            driver = Driver(host, self.world, host_plan.drives, self._equipment, self._stuck)
            self._drivers.append(driver)
            self._drivers.sort(key=attrgetter("host.index"))
            nodes.append(driver)
            nodes += self._odometry_transforms(host, host_plan)
            copied = self._copied(host_plan.drives)
            nodes += [CopyPublisher(host, copied)] if copied else []
        if host_plan.monitor:
            nodes.append(MonitorNode(host, self._explorers,
                                     scenario.robot.exploration.publishes_cost))
        nodes += [remote_slam(host, scenario, self.world.robots[robot], self._equipment[robot],
                              self._new_map(), self._peers(robot), self._known_start(robot),
                              self._peers(robot) if self._common_frame else ())
                  for robot in host_plan.slam]
        if host_plan.software is not None:
            robot_map = self._new_map()
            self._watch(host.name, robot_map)
            robot = host_plan.software
            nodes += robot_software(host, scenario, self._equipment[robot],
                                    self._strategies[robot], self.world.body(robot), robot_map,
                                    self._peers(robot), self._team(host.name),
                                    self._known_start(robot),
                                    monitored=any(map(attrgetter("monitor"), self.plan)),
                                    link=self.monitor.truth.link, pilot=self._pilot)
        if host_plan.strategy is not None:
            robot_map = self._new_map()
            nodes += coordinator_software(host, scenario, host_plan.strategy,
                                          robot_map, self._explorers,
                                          self._team(host.name), self.monitor.truth.link)
        if robot_map is not None and self._terrain_map is not None:
            nodes.append(MapServer(host, robot_map, self._terrain_map))
        return [*nodes, *self._declared_traffic(host)]

    def _peers(self, robot: int) -> tuple[str, ...]:
        """The other robots that carry software."""
        return tuple([name for name in self._explorers if name != self.world.robots[robot]])

    def _declared_traffic(self, host: Host) -> list[Node]:
        """The nodes that publish and receive what the scenario declares."""
        own = [PeriodicPublisher(host, publication) for robot, publication in self._publications
               if robot == host.name]
        topics = topics_for(host.name, self.scenario, self._publications)
        driven = [robot for robot in self._controlled if self.world.robots[robot] == host.name]
        topics += [topic for one in self._copied(driven)
                   for topic in with_copies(one.topic, one.processes)[1:]]
        return [*own, PassiveListener(host, topics)] if topics else [*own]

    def _odometry_transforms(self, host: Host, host_plan: HostPlan) -> list[Node]:
        """The node that publishes odometry as tf, if the scenario has that."""
        robot = self.scenario.robot
        if robot.tf == "none":
            return []
        names = [self.world.robots[driven] for driven in host_plan.drives]
        return [TransformBroadcaster(host, "odometry_tf", of_odometry(
            names, robot.odometry.rate_hz, robot.tf), None, self.scenario.tf_processes)]

    def _copied(self, robots: Sequence[int]) -> list[Copied]:
        """The messages of the sensors of ``robots`` that go to several processes over the network.
        """
        scenario, processes = self.scenario, self.scenario.testbed.processes
        if scenario.deployment != "testbed":
            return []
        return [one for robot in robots for one in copied_by_processes(
            f"/{self.world.robots[robot]}", self._equipment[robot], processes)
            if one.processes > 1 and robot in self._controlled]

    def _known_start(self, robot: int) -> Pose2D | None:
        """The pose of ``robot`` at the start of the run, as in its launch file; None later."""
        if self.kernel.now_ns > 0:
            return None
        return Pose2D(*self.world.snapshot().poses[robot].tolist())

    def _new_map(self) -> RobotMap:
        exchange = self.scenario.coordination.exchange
        own = robot_map_of(self.grid, self._pool, None if exchange is None else exchange.fusion)
        own.padding = self.scenario.robot.mapping.padding(self.grid.width * self.grid.height)
        return own

    def _team(self, own: str) -> Team:
        """A new team: the other hosts with a strategy, in natural order."""
        names = tuple([plan.name for plan in self.plan
                       if plan.name != own and (plan.name in self._explorers or plan.strategy)])
        return Team(names, self.scenario.coordination.lost_after_ns,
                    self._signals.at(own), self._common_frame)

    @cached_property
    def _common_frame(self) -> bool:
        """Whether robots know how their frames lie to each other."""
        exchange = self.scenario.coordination.exchange
        return exchange is None or SharingTraits.of(
            plugins.load("sharing", exchange.model)).common_frame

    def _watch(self, robot: str, robot_map: RobotMap | None) -> None:
        for watcher in self._watchers:
            watcher.watch(robot, robot_map)

    def _outage(self, fault: Fault) -> Generator[int, None, None]:
        yield fault.at_ns
        last = {"stop": self._access_point_down if fault.host in access_point_names(self.scenario)
                else self._down, "software": self._without_software, "stuck": self._held}
        yield from last[fault.kind](fault.host, fault.down_for_ns)

    def _held(self, name: str, for_ns: int | None) -> Generator[int, None, None]:
        """Block the drive of a robot: it brakes, and follows no command until it is free."""
        self._hold(name)
        self.trace.row(self.kernel.now_ns, self.names.id("stuck"), self.names.id(name))
        if for_ns is not None:
            yield for_ns
            self._stuck.discard(self.world.robots.index(name))
            self.trace.row(self.kernel.now_ns, self.names.id("freed"), self.names.id(name))

    def _hold(self, name: str) -> None:
        robot = self.world.robots.index(name)
        self._stuck.add(robot)
        self.world.command(robot, 0.0, 0.0, 0.0)

    def _down(self, name: str, for_ns: int | None) -> Generator[int, None, None]:
        """Stop a host, and start it again when the last of its outages has ended."""
        self.graph.host(name).stop()
        yield from self._without_software(name, for_ns)

    def _access_point_down(self, name: str, for_ns: int | None) -> Generator[int, None, None]:
        """Stop an access point, and start it again."""
        (of,) = access_point_names(self.scenario)[name]
        (model,) = [medium.model for medium in self.graph.media if medium.name == of]
        assert isinstance(model, SwitchesAccessPoints)
        model.switch_access_point(name, False)
        self.trace.row(self.kernel.now_ns, self.names.id("access_point_stopped"),
                       self.names.id(name))
        if for_ns is not None:
            yield for_ns
            model.switch_access_point(name, True)
            self.trace.row(self.kernel.now_ns, self.names.id("access_point_started"),
                           self.names.id(name))

    def _without_software(self, name: str, for_ns: int | None) -> Generator[int, None, None]:
        """The same of its software, where its interfaces stay on."""
        host = self.graph.host(name)
        self._outages[name] += 1
        host.stop_software()
        self._drivers[:] = [driver for driver in self._drivers if driver.host is not host]
        if name in self._explorers:
            self._watch(name, None)
        if for_ns is not None:
            yield for_ns
            self._outages[name] -= 1
            if not self._outages[name]:
                host.start()

    def _out_of_memory(self, name: str, *_: int) -> None:
        """A process of the host was killed. All of the host's software stops with it, as with
        ``required="true"`` in a launch file, and starts again later."""
        respawn_delay_ns = next(host.computer.respawn_delay_ns for host in self.plan
                                if host.name == name)
        self.kernel.process(self._down(name, respawn_delay_ns), Phase.WORLD,
                            self.names.id(f"memory of {name}"))

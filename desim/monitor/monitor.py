"""The monitor: it alone sees the truth. It samples, decides when the run is over, and sums up.

It watches out of band, so that no load on the networks can delay its verdict. First instants (99 %
of the terrain known, a condition met at an event) come from events, not from polling. The fleet's
``task`` says what is to be done, and when it is done.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Mapping, Sequence
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from desim.computers.cluster_node import ClusterNode
from desim.engine.kernel import Kernel, Phase
from desim.engine.streams import Streams
from desim.engine.trace import Trace, bits, real
from desim.errors import ModelError, below, class_of
from desim.middleware.graph import Graph
from desim.monitor.belief_metrics import BeliefMetrics
from desim.monitor.bottlenecks import Bottlenecks
from desim.monitor.coverage import Coverage, map_age_s
from desim.monitor.energy_use import EnergyUse
from desim.monitor.interface_rates import InterfaceRates
from desim.monitor.localization_errors import LocalizationErrors
from desim.monitor.memory_use import MemoryUse
from desim.monitor.outdated_goals import MOVING_M, OutdatedGoals
from desim.monitor.overlap import Overlap
from desim.monitor.partitions import Partitions
from desim.monitor.periods import Periods, all_due
from desim.monitor.processor_load import ProcessorLoad
from desim.monitor.reachability import SampledReachability
from desim.monitor.relative_poses import RelativePoses
from desim.monitor.samples import Sample
from desim.monitor.stationary_hosts import StationaryHosts
from desim.monitor.task_view import TaskView
from desim.monitor.traffic import Families, totals
from desim.monitor.triggers import Triggers
from desim.plugins import bare
from desim.ports.tasks import FollowsKnowledge, Ground, JudgesMap, Measures, Task, TaskTraits
from desim.robot.mapping.robot_map import RobotMap
from desim.scenario.expression import condition, number
from desim.scenario.quantities import ROBOTS, ROBOTS_TABLE, quantities
from desim.scenario.schema.experiment import QUANTITIES
from desim.scenario.schema.power import PowerParams
from desim.scenario.schema.scenario import Scenario
from desim.units import NS_PER_S

BYTES = "bytes_per_s"  # of a sample: the bytes by family so far, of which the table makes rates


class StopReason(StrEnum):
    """The reasons of a run's end; beside these, the task's, or the text of a condition that was
    met."""

    ELAPSED = "elapsed"  # the time limit
    INTERRUPTED = "interrupted"


class Track(NamedTuple):
    """The fleet at one instant. By robot: the pose, the number of cells of G that it knows, the way
    driven, bytes received and sent, and ``joules`` as ``EnergyUse.joules``. Where computers get
    busy, by robot with software: the time of processors and the ticks missed so far, the memory in
    use, and the processes killed so far. ``union_known``: cells that some robot has known."""

    time_ns: int
    poses: np.ndarray
    known: tuple[int, ...]
    union_known: int
    distance_m: np.ndarray
    rx_bytes: list[int]
    tx_bytes: list[int]
    busy_ns: list[int]
    missed_ticks: list[int]
    ram_bytes: list[int]
    memory_kills: list[int]
    joules: np.ndarray


class Monitor:
    """Watches one run. Its ``task`` says when it is done.

    ``robots`` names in index order, ``explorers`` those of them that carry software; each is the
    name of its host, too. ``poses()`` gives [robots, 3] x m, y m, yaw rad, ``travelled_m()``
    [robots] m, both true. ``nodes`` of the cluster, by name. ``powers`` of the robots; None where
    energy is not measured. Raises ``InputError`` where the task does not fit the terrain.
    """

    def __init__(self, kernel: Kernel, trace: Trace, scenario: Scenario, task: Task, *,
                 streams: Streams, robots: tuple[str, ...], explorers: tuple[str, ...],
                 ground: Ground, graph: Graph, poses: Callable[[], np.ndarray],
                 travelled_m: Callable[[], np.ndarray],
                 nodes: Mapping[str, ClusterNode] | None = None,
                 powers: Sequence[PowerParams | None] = ()) -> None:
        self.scenario = scenario
        self.robots, self.explorers, self.ground, self.graph = robots, explorers, ground, graph
        self.maps: dict[str, RobotMap | None] = dict.fromkeys(explorers)
        self.families = Families(graph)
        self.hosts = [graph.host(name) for name in robots]
        self.loaded = [graph.host(name) for name in explorers or robots]  # with software, if any
        self.processor_load = ProcessorLoad(self.loaded, nodes or {})
        self.memory_use = MemoryUse(self.loaded)
        self.stationary_hosts = StationaryHosts([host for host in graph.hosts
                                                 if host not in self.hosts])
        self.energy_use = EnergyUse(self.hosts, powers or [None] * len(robots), travelled_m)
        self.bottlenecks = Bottlenecks(graph, nodes or {})
        self._interface_rates = InterfaceRates(self.loaded)
        self._own = [robots.index(name) for name in explorers]
        self.partitions = Partitions()
        self.overlap = Overlap(ground.grid, ground.reachable)
        self.belief_metrics = BeliefMetrics(graph, [host for host in self.hosts
                                           if host.name in self.maps], self._links)
        # Where nobody has to find anything out, nobody will ask.
        self.links = None if graph.context.beliefs is None else SampledReachability(graph)
        self.collisions = 0
        self.collisions_of = [0] * len(robots)
        self.recoveries_of = [0] * len(robots)
        self.stop_reason: str | None = None
        self.samples: list[Sample] = []  # None: it was not due
        self.latest: dict[str, float] = {}  # the quantities at the last of them
        self.tracks: list[Track] = []
        self._second_ns = -1  # the last full second
        self._kernel, self.trace = kernel, trace
        self.poses, self.travelled_m = poses, travelled_m
        self._measured_on = frozenset(scenario.measure.on)
        own_ns = dict(scenario.measure.periods)
        self._tracked_ns = own_ns.pop(ROBOTS_TABLE, NS_PER_S)
        self._periods = Periods(scenario.measure.every_ns, own_ns)
        self.safety_scale = scenario.measure.safety_scale
        self.started_ns = 0  # when the first robot's software started
        self._has_started = False
        self._measures = task if isinstance(task, Measures) else None
        names = quantities(scenario, TaskTraits.of(task).quantities)
        self._condition = (condition(scenario.stop.when, names) if scenario.stop.when else None)
        self._triggers = Triggers(scenario.measure.when, names)
        self._cost = number(scenario.measure.cost, (*names, ROBOTS))
        self._causes: list[str] = []
        self._next_percent = 1
        self._finished = False
        self._moved_m = travelled_m().copy()
        self._moving = 0
        self.coverage = Coverage(ground, explorers, self._learned)
        self.outdated_goals = OutdatedGoals(ground.grid, self.coverage, len(explorers))
        self.localization_errors = LocalizationErrors(robots, poses)
        self.relative_poses = RelativePoses(robots, explorers, trace.names, poses,
                                            lambda: kernel.now_ns)
        graph.listeners |= {"localized": self.localization_errors.localized,
                            "believed": self.localization_errors.believed,
                            "frame_of": self.relative_poses.about,
                            "frame_at": self.relative_poses.placed,
                            "frame_lost": self.relative_poses.lost,
                            "recovery": self._recovered, "goal": self._sets_out,
                            "goal_reached": self._ends, "goal_aborted": self._ends}
        self._name_rows(trace)
        # Entity 0: before the sample of the same instant, whichever was booked first.
        kernel.ticker(1, Phase.OBSERVE, 0, self._each_second)
        kernel.process(self._by_period(), Phase.OBSERVE, self._entity)
        self._begin(task, scenario, streams)

    def _begin(self, task: Task, scenario: Scenario, streams: Streams) -> None:
        self.task, self._view = task, TaskView(self, self._kernel, streams, scenario.stop)
        self.task_name = bare(scenario.task.model)
        self._follows = task if isinstance(task, FollowsKnowledge) else None
        with below("task"):
            task.start(self._view)

    def _name_rows(self, trace: Trace) -> None:
        self._entity = trace.names.id("monitor")
        self._robot_ids = [trace.names.id(name) for name in self.robots]
        self._kind = {kind: trace.names.id(kind) for kind in (
            "sample", "sample_traffic", "sample_motion", "pose", "partition", "stop")}

    # ------------------------------------------------------------------------- what happens

    def watch(self, robot: str, robot_map: RobotMap | None) -> None:
        """``robot`` has a fresh map (its software started), or none (its host stopped)."""
        if robot_map is not None and not self._has_started:
            self._has_started, self.started_ns = True, self._kernel.now_ns
        i = self.explorers.index(robot)
        before = self.maps[robot]
        if before is not None:
            self.overlap.forgets(robot, before)
        self.maps[robot] = robot_map
        self.energy_use.switched(robot, robot_map is not None, self._kernel.now_ns)
        self.coverage.restart(i)
        self.outdated_goals.ends(i)
        if robot_map is not None:
            self.relative_poses.started(robot)
            robot_map.observers.append(self.coverage.observer(i))

    def collided(self, robot: int, other: int) -> None:
        """A collision episode of ``robot`` with robot ``other``, or with a wall (-1), began."""
        self.collisions += 1
        self.collisions_of[robot] += 1
        if other >= 0:
            self.collisions_of[other] += 1
        self._happened("collision")

    def _sets_out(self, robot: str, x_bits: int, y_bits: int, _: int) -> None:
        self.outdated_goals.sets_out(self.explorers.index(robot), real(x_bits), real(y_bits))

    def _ends(self, robot: str, *_: int) -> None:
        self.outdated_goals.ends(self.explorers.index(robot))

    def _recovered(self, robot: str, *_: int) -> None:
        self.recoveries_of[self.robots.index(robot)] += 1
        self._happened("recovery")

    def _learned(self, i: int) -> None:
        coverage = self.coverage
        if self._follows is not None:
            self._follows.on_knowledge(self._view, i)
        known = coverage.known[i]
        if 100 * known >= self._next_percent * coverage.cells > 0:
            percent = 100 * known // coverage.cells
            ten = percent // 10 > (self._next_percent - 1) // 10
            self._next_percent = percent + 1
            self._happened("explored_10pct" if ten else "explored_1pct")

    def _happened(self, event: str) -> None:
        # Sampled or judged once, when the instant's other phases are complete.
        if not self._causes:
            self._kernel.after(0, Phase.OBSERVE, self._entity, self._flush_causes)
        if event not in self._causes:
            self._causes.append(event)

    def _flush_causes(self, _: object) -> None:
        causes, self._causes = self._causes, []
        measured = [cause for cause in causes if cause in self._measured_on]
        if measured:
            self._sample(*measured)
        elif self._condition is not None or self._triggers:
            values = self.quantities()
            met = self._triggers.newly_met(values)
            if met:
                self._keep(values, met)
            self._judge(values)

    # ----------------------------------------------------------------------------- sampling

    def quantities(self) -> dict[str, float]:
        """The present values of ``QUANTITIES``, as expressions see them."""
        self.graph.catch_up()
        coverage, traffic = self.coverage, totals(self.graph)
        return {
            "time_s": self._kernel.now_ns / NS_PER_S,
            "explored": coverage.share(max(coverage.known, default=0)),
            "explored_union": coverage.share(coverage.union_known),
            "explored_all": coverage.share(min(coverage.known, default=0)),
            "collisions": self.collisions,
            "recoveries": sum(self.recoveries_of),
            "messages_sent": traffic.sent,
            "messages_delivered": traffic.delivered,
            "messages_dropped": sum(traffic.dropped.values()),
            "bytes_on_air": traffic.bytes_on_air,
            "distance_m": math.fsum(self.travelled_m().tolist()),
            "partitions": self.partitions.count,
            "robots_moving": self._moving,
            **self.energy_use.quantities(self._kernel.now_ns),
            **self.processor_load.quantities(),
            **self.memory_use.quantities(),
            **self.bottlenecks.quantities(),
            **self._measured(),
        }

    def _measured(self) -> dict[str, float]:
        """The task's own quantities."""
        if self._measures is None:
            return {}
        values, wanted = dict(self._measures.measure()), TaskTraits.of(self.task).quantities
        if sorted(values) != sorted(wanted) or not set(QUANTITIES).isdisjoint(wanted):
            raise ModelError(f"{class_of(self.task)} measured {values}; wanted: its quantities, "
                             f"{wanted}, with other names than those of every run")
        return values

    def judged_robot(self) -> str | None:
        """The robot whose map the metrics are about: the task's, else the one that knows most (the
        first by name among equals); None in a fleet without software."""
        known = self.coverage.known
        if not known:
            return None
        first = self.task.judged() if isinstance(self.task, JudgesMap) else None
        if first is not None and first not in range(len(known)):
            raise ModelError(f"{class_of(self.task)} judged {first!r}; wanted: a place among the "
                             f"{len(known)} explorers, or None")
        # A robot whose host stopped since then has no map left to judge.
        if first is None or self.maps[self.explorers[first]] is None:
            first = known.index(max(known))
        return self.explorers[first]

    def finish(self) -> str:
        """Close the run: take the last sample, end open episodes. A second call changes nothing.
        Returns why the run ended, which is the time limit unless another reason came first."""
        if self.stop_reason is None:
            self.stop_reason = StopReason.ELAPSED
        if self._finished:
            return self.stop_reason
        self._finished = True
        if self._second_ns < self._kernel.now_ns:
            self._each_second(-1)
        if self.tracks[-1].time_ns < self._kernel.now_ns:
            self._track(self.poses().copy(), self.travelled_m().copy(),
                        self.memory_use.used_bytes())
        self.partitions.close(self._kernel.now_ns)
        self._sample("end")
        return self.stop_reason

    def cost(self) -> float | None:
        """The cost of equation 1 at the last sample, by ``measure.cost``; None: it is unknown."""
        return self._cost.evaluate({**self.latest, ROBOTS: len(self.robots)})

    def _by_period(self) -> Generator[int, None, None]:
        while True:
            now_ns = self._kernel.now_ns
            self._sample("period", due=self._periods.due(now_ns))
            yield self._periods.next_ns(now_ns) - now_ns

    def _sample(self, *causes: str, due: Callable[[str], bool] = all_due) -> None:
        values = self.quantities()
        met = self._triggers.newly_met(values)
        self._keep(values, [*causes, *met], all_due if met else due)
        self._judge(values)

    def _keep(self, values: dict[str, float], causes: Sequence[str],
              due: Callable[[str], bool] = all_due) -> None:
        now_ns, row, kind = self._kernel.now_ns, self.trace.row, self._kind
        # The row has what the media were given: what they take is their models' affair.
        refused_bytes = sum(medium.refused_bytes for medium in self.graph.media)
        row(now_ns, kind["sample"], self._entity, bits(values["explored"]),
            bits(values["explored_union"]), bits(values["explored_all"]))
        row(now_ns, kind["sample_traffic"], self._entity, int(values["messages_sent"]),
            int(values["messages_delivered"]), int(values["bytes_on_air"]) + refused_bytes)
        row(now_ns, kind["sample_motion"], self._entity, int(values["collisions"]),
            int(values["recoveries"]), bits(values["distance_m"]))
        self.latest = values
        sample = {**values, "parts": self.partitions.parts,
                  "map_age_s": map_age_s(self.maps, now_ns, {
                      host.name: host.clock.ahead_ns(now_ns)
                      for host in self.graph.hosts if host.clock is not None}),
                  **self.belief_metrics.sample(), **self.processor_load.sample(now_ns, due),
                  **self.memory_use.sample(), **self._interface_rates.sample(now_ns, due),
                  "cause": "+".join(causes), BYTES: self.families.bytes()}
        self.samples.append({name: value if due(name) else None for name, value in sample.items()})

    def _judge(self, values: dict[str, float]) -> None:
        if (self._condition is not None and self.stop_reason is None
                and self._condition.evaluate(values)):
            self.end(f"condition: {self._condition.text}")

    def end(self, reason: str) -> None:
        """The run ends when this instant is complete, unless it has ended before."""
        if self.stop_reason is not None:
            return
        self.stop_reason = reason
        self.trace.row(self._kernel.now_ns, self._kind["stop"], self._entity)
        self._kernel.stop()

    def _each_second(self, _: int) -> None:
        self.graph.catch_up()
        now_ns, row, pose_kind = self._kernel.now_ns, self.trace.row, self._kind["pose"]
        poses, travelled_m = self.poses().copy(), self.travelled_m().copy()
        as_bits = poses.view(np.int64).tolist()
        for entity, (x, y, yaw) in zip(self._robot_ids, as_bits, strict=True):
            row(now_ns, pose_kind, entity, x, y, yaw)
        self._moving = int(np.count_nonzero(travelled_m - self._moved_m > MOVING_M))
        self._moved_m = travelled_m
        self.outdated_goals.each_second(now_ns, travelled_m[self._own], list(self.maps.values()))
        self._second_ns, used_bytes = now_ns, self.memory_use.each_second()
        if now_ns % self._tracked_ns == 0:
            self._track(poses, travelled_m, used_bytes)
        self.stationary_hosts.each_second()
        self.bottlenecks.sample(now_ns)
        if self.links is not None:
            self.links.sample(now_ns)
        links = self._links()
        self.belief_metrics.each_second(links)
        if self.partitions.sample(now_ns, links):
            row(now_ns, self._kind["partition"], self._entity, self.partitions.parts)
            self._happened("partition")

    def _track(self, poses: np.ndarray, travelled_m: np.ndarray, used_bytes: list[int]) -> None:
        self.tracks.append(Track(
            self._kernel.now_ns, poses, tuple(self.coverage.known), self.coverage.union_known,
            travelled_m, [host.rx_bytes for host in self.hosts],
            [host.tx_bytes for host in self.hosts], self.processor_load.busy_ns(),
            self.processor_load.missed_ticks(), used_bytes, self.memory_use.kills(),
            self.energy_use.joules(self._kernel.now_ns)))

    def _links(self) -> np.ndarray | None:
        """[n, n] bool of the explorers that are up: do frames get from one to the other now?"""
        up = [host.index for host in self.hosts if host.up and host.name in self.maps]
        return self.graph.linked(np.array(up, np.int64))

"""The monitor: it alone sees the truth. It samples, decides when the run is over, and sums up.

It watches out of band, so that no load on the networks can delay its verdict. First instants (99 %
of the terrain known, a condition met at an event) come from events, not from polling. The fleet's
``task`` says what is to be done, and when it is done; ``meters`` measure the rest.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from enum import StrEnum
from functools import partial
from typing import NamedTuple

import numpy as np

from desim.engine.kernel import Phase
from desim.engine.streams import Streams
from desim.engine.trace import bits
from desim.errors import ModelError, below, class_of
from desim.monitor.coverage import Coverage
from desim.monitor.meters.belief_metrics import BeliefMetrics
from desim.monitor.meters.bottlenecks import Bottlenecks
from desim.monitor.meters.energy_use import EnergyUse
from desim.monitor.meters.incidents import Incidents
from desim.monitor.meters.interface_rates import InterfaceRates
from desim.monitor.meters.localization_errors import ClosureErrors, LocalizationErrors, WallErrors
from desim.monitor.meters.map_age import MapAge
from desim.monitor.meters.memory_use import MemoryUse
from desim.monitor.meters.message_counts import MessageCounts
from desim.monitor.meters.meter import Due, Meter, Second, both, merged
from desim.monitor.meters.motion import Motion
from desim.monitor.meters.outdated_goals import OutdatedGoals
from desim.monitor.meters.overlap import Overlap
from desim.monitor.meters.partitions import Partitions
from desim.monitor.meters.process_pairs import ProcessPairs
from desim.monitor.meters.processor_load import ProcessorLoad
from desim.monitor.meters.reachability import SampledReachability
from desim.monitor.meters.relative_poses import RelativePoses
from desim.monitor.meters.stood import LongestStands
from desim.monitor.meters.topic_families import TopicFamilies
from desim.monitor.periods import Periods, all_due
from desim.monitor.samples import Sample
from desim.monitor.task_view import TaskView
from desim.monitor.triggers import Triggers
from desim.monitor.truth import Truth
from desim.ports.tasks import (
    Briefs,
    FollowsKnowledge,
    JudgesMap,
    Measures,
    TakesActions,
    Task,
    TaskTraits,
)
from desim.robot.mapping.robot_map import RobotMap
from desim.robot.mapping.tiles import raster
from desim.scenario.expression import condition, number
from desim.scenario.quantities import ROBOTS, ROBOTS_TABLE, quantities
from desim.scenario.schema.experiment import QUANTITIES
from desim.units import NS_PER_S


class StopReason(StrEnum):
    """The reasons of a run's end; beside these, the task's, or the text of a condition that was
    met."""

    ELAPSED = "elapsed"  # the time limit
    INTERRUPTED = "interrupted"


class Track(NamedTuple):
    """The fleet at one instant: the true poses, the number of cells of G that each explorer knows,
    ``union_known``, those that some robot has known, and ``measured`` by meters, see
    ``Meter.track``."""

    time_ns: int
    poses: np.ndarray
    known: tuple[int, ...]
    union_known: int
    measured: Sample


class Monitor:
    """Watches one run, of which it sees the ``truth``. Its ``task`` says when the run is done.
    Raises ``InputError`` where the task does not fit the terrain."""

    def __init__(self, truth: Truth, task: Task, streams: Streams) -> None:
        scenario, graph = truth.scenario, truth.graph
        self.truth, self._kernel = truth, truth.kernel
        self.maps: dict[str, RobotMap | None] = dict.fromkeys(truth.explorers)
        self.stop_reason: str | None = None
        self.samples: list[Sample] = []  # None: it was not due
        self.latest: Sample = {}  # the quantities at the last of them
        self.tracks: list[Track] = []
        self._started_ns: int | None = None  # when the first robot's software started
        self._second_ns = -1  # the last full second
        self._causes: list[str] = []
        self._next_percent = 1
        self._finished = False
        self._tracked_ns = scenario.measure.periods.get(ROBOTS_TABLE, NS_PER_S)
        self._periods = Periods(scenario.measure.every_ns, {
            name: own_ns for name, own_ns in scenario.measure.periods.items()
            if name != ROBOTS_TABLE})
        self._measures = task if isinstance(task, Measures) else None
        names = quantities(scenario, TaskTraits.of(task).quantities)
        self._condition = (condition(scenario.stop.when, names) if scenario.stop.when else None)
        self._triggers = Triggers(scenario.measure.when, names)
        self._cost = number(scenario.measure.cost, (*names, ROBOTS))
        self.coverage = Coverage(truth.ground, truth.explorers, self._learned)
        self.incidents = Incidents(truth.robots, self._happened)
        # Where nobody has to find anything out, nobody will ask.
        self.links = None if graph.context.beliefs is None else SampledReachability(graph)
        self.energy = EnergyUse(truth.hosts, truth.powers or [None] * len(truth.hosts),
                                truth.travelled_m)
        self.meters = self._new_meters()
        for kind, listener in (row for meter in self.meters for row in meter.listeners.items()):
            graph.listeners[kind] = both(graph.listeners.get(kind), listener)
        id_of = truth.trace.names.id
        self._entity = id_of("monitor")
        self._kind = {kind: id_of(kind) for kind in (
            "sample", "sample_traffic", "sample_motion", "partition", "stop")}
        # Entity 0: before the sample of the same instant, whichever was booked first.
        self._kernel.ticker(1, Phase.OBSERVE, 0, self._each_second)
        self._kernel.process(self._by_period(), Phase.OBSERVE, self._entity)
        self.task, self._view = task, TaskView(self, streams)
        self._follows = task if isinstance(task, FollowsKnowledge) else None
        with below("task"):
            task.start(self._view)
        if isinstance(task, Briefs):
            truth.link.briefing = task.briefing()
        if isinstance(task, TakesActions):
            truth.link.on_act = partial(task.on_act, self._view)

    def _new_meters(self) -> list[Meter]:
        """All meters, in the order of their keys in summary.json."""
        truth, graph = self.truth, self.truth.graph
        return [
            Motion(truth),
            MessageCounts(graph),
            Partitions(self._parted),
            BeliefMetrics(graph, truth.explorer_hosts, truth.linked, self.samples),
            ProcessPairs(graph),
            Overlap(truth.ground.grid, truth.ground.reachable),
            OutdatedGoals(truth.ground.grid, self.coverage, truth.robots, truth.explorers),
            self.incidents,
            LongestStands(truth.robots),
            LocalizationErrors(truth.robots, truth.poses),
            ClosureErrors(truth.robots, truth.poses, truth.trace.names),
            RelativePoses(truth),
            WallErrors(truth.ground, self.judged_map),
            MapAge(graph, self.maps, self.samples),
            TopicFamilies(graph),
            InterfaceRates(truth),
            ProcessorLoad(truth),
            MemoryUse(truth),
            self.energy,
            Bottlenecks(graph, truth.nodes),
            *([self.links] if self.links else []),
        ]

    # ------------------------------------------------------------------------- what happens

    @property
    def started_ns(self) -> int:
        """The time at which the first robot's software started."""
        return self._started_ns or 0

    def watch(self, robot: str, robot_map: RobotMap | None) -> None:
        """``robot`` has a fresh map (its software started), or none (its host stopped)."""
        now_ns = self._kernel.now_ns
        if robot_map is not None and self._started_ns is None:
            self._started_ns = now_ns
        i = self.truth.explorers.index(robot)
        self.maps[robot] = robot_map
        self.coverage.restart(i)
        for meter in self.meters:
            meter.watch(robot, robot_map, now_ns)
        if robot_map is not None:
            robot_map.observers.append(partial(self.coverage.update, i, robot_map.fused,
                                               robot_map.tile_version, robot_map.row_version))

    def _parted(self, parts: int) -> None:
        self.truth.trace.row(self._kernel.now_ns, self._kind["partition"], self._entity, parts)
        self._happened("partition")

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
        measured = [cause for cause in causes if cause in self.truth.scenario.measure.on]
        if measured:
            self._sample(*measured)
        elif self._condition is not None or self._triggers:
            values = self.quantities()
            met = self._triggers.newly_met(values)
            if met:
                self._keep(values, met)
            self._judge(values)

    # ----------------------------------------------------------------------------- sampling

    def quantities(self) -> Sample:
        """The present values of ``QUANTITIES``, as expressions see them."""
        self.truth.graph.catch_up()
        coverage, now_ns = self.coverage, self._kernel.now_ns
        return {
            "time_s": now_ns / NS_PER_S,
            "explored": coverage.share(max(coverage.known, default=0)),
            "explored_union": coverage.share(coverage.union_known),
            "explored_all": coverage.share(min(coverage.known, default=0)),
            **merged([meter.quantities(now_ns) for meter in self.meters]),
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
        explorers = self.truth.explorers
        if first is None or self.maps[explorers[first]] is None:
            first = known.index(max(known))
        return explorers[first]

    def judged_map(self) -> np.ndarray:
        """int16 [height, width]: the log-odds in the map of ``judged_robot``; zeros without."""
        robot, grid = self.judged_robot(), self.truth.ground.grid
        robot_map = None if robot is None else self.maps[robot]
        return (np.zeros((grid.height, grid.width), np.int16) if robot_map is None
                else raster(grid, robot_map.fused))

    def by_host(self) -> dict[str, Sample]:
        """All that meters measured of each host."""
        out: dict[str, Sample] = {}
        for meter in self.meters:
            for name, own in meter.by_host(self._kernel.now_ns).items():
                out[name] = {**out.get(name, {}), **own}
        return out

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
            self._track(self.truth.second())
        self._sample("end")
        return self.stop_reason

    def cost(self) -> float | None:
        """The cost of equation 1 at the last sample, by ``measure.cost``; None: it is unknown."""
        return self._cost.evaluate({**self.latest, ROBOTS: len(self.truth.robots)})

    def _by_period(self) -> Generator[int, None, None]:
        while True:
            now_ns = self._kernel.now_ns
            self._sample("period", due=self._periods.due(now_ns))
            yield self._periods.next_ns(now_ns) - now_ns

    def _sample(self, *causes: str, due: Due = all_due) -> None:
        values = self.quantities()
        met = self._triggers.newly_met(values)
        self._keep(values, [*causes, *met], all_due if met else due)
        self._judge(values)

    def _keep(self, values: Sample, causes: Sequence[str],
              due: Due = all_due) -> None:
        now_ns, row, kind = self._kernel.now_ns, self.truth.trace.row, self._kind
        # The row has what the media were given: what they take is their models' affair.
        refused_bytes = sum([medium.refused_bytes for medium in self.truth.graph.media])
        row(now_ns, kind["sample"], self._entity, bits(values["explored"]),
            bits(values["explored_union"]), bits(values["explored_all"]))
        row(now_ns, kind["sample_traffic"], self._entity, values["messages_sent"],
            values["messages_delivered"], values["bytes_on_air"] + refused_bytes)
        row(now_ns, kind["sample_motion"], self._entity, values["collisions"],
            values["recoveries"], bits(values["distance_m"]))
        self.latest = values
        sample = {**values, **merged([meter.sample(now_ns, due) for meter in self.meters]),
                  "cause": "+".join(causes)}
        self.samples.append(sample if due is all_due else {
            name: value if due(name) else None for name, value in sample.items()})

    def _judge(self, values: Sample) -> None:
        if (self._condition is not None and self.stop_reason is None
                and self._condition.evaluate(values)):
            self.end(f"condition: {self._condition.text}")

    def end(self, reason: str) -> None:
        """The run ends when this instant is complete, unless it has ended before."""
        if self.stop_reason is not None:
            return
        self.stop_reason = reason
        self.truth.trace.row(self._kernel.now_ns, self._kind["stop"], self._entity)
        self._kernel.stop()

    def _each_second(self, _: int) -> None:
        self.truth.graph.catch_up()
        second = self.truth.second()
        self._second_ns = second.now_ns
        for meter in self.meters:
            meter.each_second(second)
        if second.now_ns % self._tracked_ns == 0:
            self._track(second)

    def _track(self, second: Second) -> None:
        self.tracks.append(Track(second.now_ns, second.poses, tuple(self.coverage.known),
                                 self.coverage.union_known,
                                 merged([meter.track(second) for meter in self.meters])))

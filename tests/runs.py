"""Whole runs, and the audit that each of them ends with."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from desim.engine.kernel import Phase
from desim.scenario.load import load
from desim.simulation.simulation import Outcome, Simulation
from desim.units import NS_PER_S

HERE = Path(__file__).resolve().parent
SCENARIOS = HERE.parent / "scenarios"
HELLO, MAZE_8, MAZE_30 = (SCENARIOS / f"{name}.yaml" for name in ("hello", "maze_8", "maze_30"))
ROUGH, ANNEX = (HERE / "system" / f"{name}.yaml" for name in ("rough", "annex"))
LONGEST_S = 1000  # the slowest frame of any scenario here is through by then


def built(file: Path, *overrides: str, seed: int | None = None, **options) -> Simulation:
    """A simulation that has not run; ``options`` are those of ``Simulation``."""
    return Simulation(load(file, overrides, seed).scenario, **options)


def finished(simulation: Simulation) -> Outcome:
    """Run to the end, then audit."""
    outcome = simulation.run()
    audited(simulation)
    return outcome


def audited(simulation: Simulation) -> None:
    """The books of a run that is over balance, and come out even when all hosts stop."""
    balance(simulation)
    close(simulation)


def outcome_of(file: Path, *overrides: str, seed: int | None = None, **options) -> Outcome:
    """The outcome of a run of the scenario."""
    return finished(built(file, *overrides, seed=seed, **options))


def call_often(simulation: Simulation, check: Callable[[], Any]) -> None:
    """Call ``check()`` ten times a simulated second, when all else of the instant is done."""
    simulation.kernel.ticker(10, Phase.OBSERVE, simulation.names.id("onlooker"), lambda k: check())


def balance(simulation: Simulation) -> None:
    """intended = delivered + dropped by reason + in flight, for every topic and every medium; and
    what is in flight is found where it waits (a stopped host's last frames are the media's)."""
    graph = simulation.graph
    graph.catch_up()
    stopped = bool(simulation.scenario.faults)
    for topic in graph.topics.values():
        waiting = sum(publisher.waiting() for publisher in topic.publishers)
        in_flight = topic.counts.in_flight
        assert waiting <= in_flight if stopped else waiting == in_flight, topic.name
    for medium in (*graph.media, *graph.inside):
        assert medium.intended == (medium.delivered + sum(medium.dropped.values())
                                   + medium.in_flight()), medium.name


def close(simulation: Simulation) -> None:
    """Stop every host: what waits is dropped, what flies lands, and nothing is left over."""
    graph, kernel = simulation.graph, simulation.kernel
    for host in graph.hosts:
        host.stop()
    last_ns = kernel.now_ns + LONGEST_S * NS_PER_S
    media = (*graph.media, *graph.inside)
    while any(medium.in_flight() for medium in media) and kernel.now_ns < last_ns:
        kernel.run(kernel.now_ns + NS_PER_S)
    for topic in graph.topics.values():
        counts = topic.counts
        assert counts.intended == counts.delivered + sum(counts.dropped.values()), topic.name
        assert counts.queued == counts.called + counts.overwritten + counts.discarded, topic.name
    for medium in media:
        assert medium.in_flight() == 0
        assert medium.intended == medium.delivered + sum(medium.dropped.values()), medium.name


class Tally:
    """Counts of a run, kept beside it, of its trace rows and its messages' fates.

    Give ``sink`` and ``fate`` to the ``Simulation`` as ``trace_sink`` and ``on_fate``.
    """

    def __init__(self) -> None:
        self.fates: dict[tuple[int, int], str | None] = {}
        self.delivered = Counter()  # by topic
        self.dropped: dict[str, Counter] = {}  # by topic and reason
        self.flights = []  # message, receiver, ns from its first frame's sending to its arrival
        self.missed = Counter()  # receivers whom broadcasts missed together, by reason
        self.rows = Counter()  # by kind
        self.frame_bytes = 0
        self._batches = []

    def sink(self, rows) -> None:
        self._batches.append(rows.copy())

    def fate(self, message, receiver, time_ns, reason, first_ns, last_ns) -> None:
        key = (message.number, receiver)
        assert key not in self.fates, f"message {key} has two fates"
        self.fates[key] = reason
        if reason is not None:
            self.dropped.setdefault(message.topic, Counter())[reason] += 1
            return
        assert message.born_ns <= first_ns <= last_ns <= time_ns
        self.delivered[message.topic] += 1
        self.flights.append((message, receiver, time_ns - first_ns))

    def fold(self, names) -> None:
        """Sum up the rows; ``names`` of the run's trace."""
        for batch in self._batches:
            for kind, count in zip(batch["kind"].tolist(), batch["c"].tolist(), strict=True):
                self.rows[kind] += 1
                self.missed[kind] += count
            self.frame_bytes += int(batch["c"][batch["kind"] == names.id("frame")].sum())
        self.missed = Counter({names[kind]: count for kind, count in self.missed.items()})
        self.rows = Counter({names[kind]: count for kind, count in self.rows.items()})

"""The resource of a run that gives in (saturates) first: processors, memory, a medium, or a queue.

The loads of all resources are measured every 5 s, as in the paper's testbed. A resource gives in at
the end of the first such window in which 90 % of it were in use (the paper chose its processors so
that they stayed below that). Queues give in when something is lost because one is full.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import nan

import numpy as np

from desim.middleware.busy.host import BusyHost
from desim.middleware.graph import Graph
from desim.monitor.samples import Sample
from desim.monitor.utilisation import busy_ns, utilisation
from desim.units import NS_PER_S

WINDOW_NS = 5 * NS_PER_S
_GIVES_IN = 0.9
_FULL = ("queue_full", "outbox_full")  # drops of frames by media, of messages by links


class Bottlenecks:
    """Watches the resources of ``graph``. The load of processors and memory is that of the busiest
    host, a medium's that of its busiest part (a port, the air around a host)."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph
        self._computers = [host for host in graph.hosts if isinstance(host, BusyHost)]
        self._since_ns = 0  # of the present window
        self._processors_ns = [0] * len(self._computers)
        self._kills = 0  # of processes, for want of memory
        self._media_ns: dict[str, np.ndarray | None] = {}
        self._lost = 0
        self._latest: dict[str, float] = {}  # shares in the last window
        self._peaks: dict[str, float] = {}
        self._from_s: dict[str, float] = {}

    def sample(self, now_ns: int) -> None:
        """The time is ``now_ns``: if a window is over, take its loads."""
        elapsed_ns = now_ns - self._since_ns
        if elapsed_ns < WINDOW_NS:
            return
        self._latest = dict(self._shares(elapsed_ns))
        for resource, share in self._latest.items():
            self._peaks[resource] = max(self._peaks.get(resource, 0.0), share)
            if share >= _GIVES_IN:
                self._from_s.setdefault(resource, now_ns / NS_PER_S)
        lost = self._lost_in_queues()
        if lost > self._lost:
            self._from_s.setdefault("queue", now_ns / NS_PER_S)
        self._since_ns, self._lost = now_ns, lost

    def quantities(self) -> dict[str, float]:
        """The loads of the busiest computer in the last window that is over, as expressions see
        them: NaN before there is one, and of memory without a limit. None where computers are
        ideal."""
        return {} if not self._computers else {
            name: 100.0 * self._latest.get(resource, nan) for name, resource in
            (("max_cpu_percent", "processor"), ("max_ram_percent", "memory"))}

    def summary(self) -> Sample:
        """The resource that gave in first, None if none did (of several in one window the first in
        this order); of each the largest share that was in use, and when it gave in."""
        return {"gives_in_first": min(self._from_s, key=self._from_s.__getitem__, default=None),
                "saturation": {
                    **{resource: {"peak": peak, "from_s": self._from_s.get(resource)}
                       for resource, peak in self._peaks.items()},
                    "queue": {"lost": self._lost_in_queues(),
                              "from_s": self._from_s.get("queue")}}}

    def _shares(self, elapsed_ns: int) -> Iterator[tuple[str, float]]:
        """The share of each resource that was in use in a window."""
        if self._computers:
            processors_ns = [host.computer.processors.busy_ns() for host in self._computers]
            yield "processor", max(
                (after - before) / (host.computer.processors.count * elapsed_ns)
                for host, before, after in zip(self._computers, self._processors_ns, processors_ns,
                                               strict=True))
            self._processors_ns = processors_ns
        limited = [(host.memory, host.memory.limit_bytes) for host in self._computers
                   if host.memory is not None and host.memory.limit_bytes is not None]
        if limited:
            kills = sum(len(memory.kills) for memory, _ in limited)
            # A host whose software has died since then was full, and is empty now.
            yield "memory", max(float(kills > self._kills), *(
                memory.used_bytes() / limit_bytes for memory, limit_bytes in limited))
            self._kills = kills
        for medium in self._graph.media:
            before_ns = self._media_ns.get(medium.name)
            share = utilisation(medium, elapsed_ns, 0 if before_ns is None else before_ns)
            if share is not None:
                yield medium.name, share["max"]
                self._media_ns[medium.name] = busy_ns(medium)

    def _lost_in_queues(self) -> int:
        """The frames and messages that were lost because a queue was full, so far."""
        counts = [medium.dropped for medium in self._graph.media]
        counts += [topic.counts.dropped for topic in self._graph.topics.values()]
        return sum(dropped.get(reason, 0) for dropped in counts for reason in _FULL)

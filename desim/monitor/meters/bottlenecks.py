"""The resource of a run that saturates first.

Resources are processors of hosts and of cluster nodes, threads of programs, memory, media, sockets
and queues. Their loads are measured every 5 s, as in the paper's testbed. A resource saturates at
the end of the first such window in which 90 % of it were in use (the paper chose its processors so
that they stayed below that). Queues saturate if 10 % of what was sent in a window was lost in
full queues.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from math import nan

import numpy as np

from desim.computers.cluster_node import ClusterNode
from desim.computers.processors import Processors
from desim.middleware.busy.executor import Executor
from desim.middleware.busy.host import BusyHost
from desim.middleware.graph import Graph
from desim.monitor.meters.meter import Meter, Second
from desim.monitor.samples import Sample
from desim.monitor.utilisation import busy_ns, utilisation
from desim.units import NS_PER_S

WINDOW_NS = 5 * NS_PER_S
_GIVES_IN = 0.9
_LOST = 0.1
# Drops of frames by media, and of messages by links and sockets.
_FULL = ("queue_full", "outbox_full", "send_buffer_full", "receive_buffer_full", "reassembly_full")


class Bottlenecks(Meter):
    """Watches the resources of ``graph``, and the cluster's ``nodes``. Of processors and memory the
    busiest host or node counts, of threads the busiest program (it runs one callback at a time), of
    a medium its busiest part (a port, the air around a host)."""

    def __init__(self, graph: Graph, nodes: Mapping[str, ClusterNode]) -> None:
        self._graph = graph
        self._computers = [host for host in graph.hosts if isinstance(host, BusyHost)]
        self._processors: dict[str, list[Processors | ClusterNode]] = {
            "processor": [host.computer.processors for host in self._computers],
            "cluster_node": list(nodes.values()) if self._computers else []}
        self._since_ns = 0  # of the present window
        # The work that was done when it began:
        self._processors_ns = {name: [0] * len(own) for name, own in self._processors.items()}
        self._threads_ns: dict[Executor, int] = {}
        self._media_ns: dict[str, np.ndarray | None] = {}
        self._losses: list[tuple[int, int]] = []
        self._waits_ns = [0] * len(graph.hosts)  # of publishers, for room in sockets
        self._kills = 0  # of processes, for want of memory
        self._latest: dict[str, float] = {}  # shares in the last window
        self._peaks: dict[str, float] = {}
        self._from_s: dict[str, float] = {}

    def each_second(self, second: Second) -> None:
        """If a window is over, take its loads."""
        now_ns = second.now_ns
        elapsed_ns = now_ns - self._since_ns
        if elapsed_ns < WINDOW_NS:
            return
        self._latest = dict(self._shares(elapsed_ns))
        for resource, share in self._latest.items():
            self._peaks[resource] = max(self._peaks.get(resource, 0.0), share)
            if share >= (_LOST if resource == "queue" else _GIVES_IN):
                self._from_s.setdefault(resource, now_ns / NS_PER_S)
        self._since_ns = now_ns

    def quantities(self, now_ns: int) -> Sample:
        """The loads of the busiest computer in the last window that is over: NaN before there is
        one, and of memory without a limit. Empty where computers are ideal."""
        return {} if not self._computers else {
            name: 100.0 * self._latest.get(resource, nan) for name, resource in
            (("max_cpu_percent", "processor"), ("max_ram_percent", "memory"))}

    def summary(self, now_ns: int) -> Sample:
        """The resource that saturated first, None if none did (of several in one window the first
        in the module's order); of each the largest share that was in use, and when it saturated."""
        return {"saturated_first": min(self._from_s, key=self._from_s.__getitem__, default=None),
                "saturation": {
                    resource: {"peak": peak, "from_s": self._from_s.get(resource),
                               **({"lost": sum(lost for lost, _ in self._lost_and_sent())}
                                  if resource == "queue" else {})}
                    for resource, peak in {**self._peaks, "queue": self._peaks.get("queue", 0.0)
                                           }.items()}}

    def _shares(self, elapsed_ns: int) -> Iterator[tuple[str, float]]:
        """The share of each resource that was in use in a window."""
        for name, own in self._processors.items():
            if own:
                busy = [each.busy_ns() for each in own]
                yield name, max((after - before) / (each.count * elapsed_ns) for each, before, after
                                in zip(own, self._processors_ns[name], busy, strict=True))
                self._processors_ns[name] = busy
        if self._computers:
            yield "thread", self._busiest_thread(elapsed_ns)
        limited = [(host.memory, host.memory.limit_bytes) for host in self._computers
                   if host.memory is not None and host.memory.limit_bytes is not None]
        if limited:
            kills = sum(len(memory.kills) for memory, _ in limited)
            # A host whose software has died in the window was full, and is empty now.
            yield "memory", max(float(kills > self._kills), *(
                memory.used_bytes() / limit_bytes for memory, limit_bytes in limited))
            self._kills = kills
        yield from self._busiest_parts(elapsed_ns).items()
        before_ns, self._waits_ns = self._waits_ns, [host.sockets.waited_ns()
                                                     for host in self._graph.hosts]
        waited_ns = max(map(int.__sub__, self._waits_ns, before_ns), default=0)
        if waited_ns:
            yield "socket", waited_ns / elapsed_ns
        before, self._losses = self._losses, self._lost_and_sent()
        yield "queue", max((
            (lost - lost_before) / max(sent - sent_before, lost - lost_before, 1)
            for (lost, sent), (lost_before, sent_before)
            in zip(self._losses, before or [(0, 0)] * len(self._losses), strict=True)), default=0.0)

    def _busiest_thread(self, elapsed_ns: int) -> float:
        """The share of a window for which the busiest thread computed. What a callback takes
        beyond the window counts in the next ones."""
        done_ns, most_ns = {}, 0
        for host in self._computers:
            for executor in host.executors:
                before_ns = self._threads_ns.get(executor, 0)
                all_ns = host.computer.processors.alone_ns(executor.computing_ns)
                done_ns[executor] = min(all_ns, before_ns + elapsed_ns)
                most_ns = max(most_ns, done_ns[executor] - before_ns)
        self._threads_ns = done_ns
        return most_ns / elapsed_ns

    def _busiest_parts(self, elapsed_ns: int) -> dict[str, float]:
        """The share of a window for which the busiest part of each medium was in use; media inside
        hosts by their name there (``bus`` of ``bus@robot_3``)."""
        shares: dict[str, float] = {}
        for medium in (*self._graph.media, *self._graph.inside):
            before_ns = self._media_ns.get(medium.name)
            share = utilisation(medium, elapsed_ns, 0 if before_ns is None else before_ns)
            if share is not None:
                name = medium.name.partition("@")[0]
                shares[name] = max(shares.get(name, 0.0), share["max"])
                self._media_ns[medium.name] = busy_ns(medium)
        return shares

    def _lost_and_sent(self) -> list[tuple[int, int]]:
        """The frames of each medium so far, those lost because a queue was full and all; last, the
        same of messages."""
        topics = [topic.counts for topic in self._graph.topics.values()]
        return [*((_lost([medium.dropped]), medium.intended)
                  for medium in (*self._graph.media, *self._graph.inside)),
                (_lost([counts.dropped for counts in topics]),
                 sum([counts.intended for counts in topics]))]


def _lost(dropped: Iterable[Mapping[str, int]]) -> int:
    """The number of those that were dropped because a queue was full."""
    return sum([number for counts in dropped for reason, number in counts.items()
                if reason in _FULL])

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
from operator import itemgetter
from typing import NamedTuple

import numpy as np

from desim.computers.cluster_node import ClusterNode
from desim.computers.processors import Processors
from desim.middleware.busy.executor import Executor
from desim.middleware.graph import Graph
from desim.monitor.meters.meter import Meter, Second
from desim.monitor.samples import Sample
from desim.monitor.utilisation import busy_ns, channels
from desim.units import NS_PER_S

WINDOW_NS = 5 * NS_PER_S
_GIVES_IN = 0.9
_LOST = 0.1
# Drops of frames by media, and of messages by links and sockets.
_FULL = ("queue_full", "outbox_full", "send_buffer_full", "history_full", "receive_buffer_full",
         "reassembly_full")


class _Load(NamedTuple):
    """The share of a resource that was in use in a window, and which of its parts (hosts, nodes,
    programs, channels) was the busiest, with the number of others that were saturated."""

    resource: str
    share: float
    part: str | None = None


class Bottlenecks(Meter):
    """Watches the resources of ``graph``, and the cluster's ``nodes``. Of processors and memory the
    busiest host or node counts, of threads the busiest program (it runs one callback at a time), of
    a medium its busiest part (a port, the air around a host)."""

    def __init__(self, graph: Graph, nodes: Mapping[str, ClusterNode]) -> None:
        self._graph = graph
        self._computers = [(host, host.computer) for host in graph.hosts
                           if host.computer is not None]
        self._processors: dict[str, Mapping[str, Processors | ClusterNode]] = {
            "processor": {host.name: computer.processors for host, computer in self._computers},
            "cluster_node": nodes if self._computers else {}}
        self._since_ns = 0  # of the present window
        # The work that was done when it began:
        self._processors_ns = {name: [0] * len(own) for name, own in self._processors.items()}
        self._threads_ns: dict[Executor, int] = {}
        self._media_ns: dict[str, np.ndarray] = {}
        self._losses: list[tuple[int, int]] = []
        self._waits_ns = [0] * len(graph.hosts)  # of publishers, for room in sockets
        self._kills: list[int] = []  # of processes, for want of memory
        self._latest: dict[str, float] = {}  # shares in the last window
        self._peaks: dict[str, float] = {}
        self._first: dict[str, dict[str, float | str]] = {}  # from when on it saturated, which part

    def each_second(self, second: Second) -> None:
        """If a window is over, take its loads."""
        now_ns = second.now_ns
        elapsed_ns = now_ns - self._since_ns
        if elapsed_ns < WINDOW_NS:
            return
        self._latest = {}
        for resource, share, part in self._loads(elapsed_ns):
            self._latest[resource] = share
            self._peaks[resource] = max(self._peaks.get(resource, 0.0), share)
            if share >= (_LOST if resource == "queue" else _GIVES_IN):
                where = {} if part in (None, resource) else {"part": part}
                self._first.setdefault(resource, {"from_s": now_ns / NS_PER_S, **where})
        self._since_ns = now_ns

    def quantities(self, now_ns: int) -> Sample:
        """The loads of the busiest computer in the last window that is over: NaN before there is
        one, and of memory without a limit. Empty where computers are ideal."""
        return {} if not self._computers else {
            name: 100.0 * self._latest.get(resource, nan) for name, resource in
            (("max_cpu_percent", "processor"), ("max_ram_percent", "memory"))}

    def summary(self, now_ns: int) -> Sample:
        """The resource that saturated first, None if none did (of several in one window the first
        in the module's order); of each the largest share that was in use, and when it saturated
        and which part of it, if it did."""
        first = min(self._first, key=lambda resource: self._first[resource]["from_s"], default=None)
        return {"saturated_first": first,
                "saturation": {
                    resource: {"peak": peak, "from_s": None, **self._first.get(resource, {}),
                               **({"lost": sum(lost for lost, _ in self._lost_and_sent())}
                                  if resource == "queue" else {})}
                    for resource, peak in {**self._peaks, "queue": self._peaks.get("queue", 0.0)
                                           }.items()}}

    def _loads(self, elapsed_ns: int) -> Iterator[_Load]:
        """The load of each resource in a window."""
        for name, own in self._processors.items():
            if own:
                busy = [each.busy_ns() for each in own.values()]
                yield _busiest(name, own, [
                    (after - before) / (each.count * elapsed_ns) for each, before, after
                    in zip(own.values(), self._processors_ns[name], busy, strict=True)])
                self._processors_ns[name] = busy
        if self._computers:
            yield self._busiest_thread(elapsed_ns)
        limited = {host.name: (host.memory, host.memory.limit_bytes) for host in self._graph.hosts
                   if host.memory is not None and host.memory.limit_bytes is not None}
        if limited:
            kills = [len(memory.kills) for memory, _ in limited.values()]
            # A host whose software has died in the window was full, and is empty now.
            yield _busiest("memory", limited, [
                max(float(killed > before), memory.used_bytes() / limit_bytes)
                for (memory, limit_bytes), killed, before
                in zip(limited.values(), kills, self._kills or [0] * len(kills), strict=True)])
            self._kills = kills
        yield from self._busiest_channels(elapsed_ns)
        before_ns, self._waits_ns = self._waits_ns, [host.sockets.waited_ns()
                                                     for host in self._graph.hosts]
        waited_ns = list(map(int.__sub__, self._waits_ns, before_ns))
        if any(waited_ns):
            yield _busiest("socket", [host.name for host in self._graph.hosts],
                           [ns / elapsed_ns for ns in waited_ns])
        before, self._losses = self._losses, self._lost_and_sent()
        yield _Load("queue", max(
            (lost - lost_before) / max(sent - sent_before, lost - lost_before, 1)
            for (lost, sent), (lost_before, sent_before)
            in zip(self._losses, before or [(0, 0)] * len(self._losses), strict=True)))

    def _busiest_thread(self, elapsed_ns: int) -> _Load:
        """The program whose thread computed for most of a window. What a callback takes beyond the
        window counts in the next ones."""
        done_ns, busiest, most_ns = {}, None, 0
        for host, computer in self._computers:
            for executor in host.executors:
                before_ns = self._threads_ns.get(executor, 0)
                all_ns = computer.processors.alone_ns(executor.computing_ns)
                done_ns[executor] = min(all_ns, before_ns + elapsed_ns)
                if done_ns[executor] - before_ns > most_ns:
                    busiest = f"{host.name}/{executor.program}"
                    most_ns = done_ns[executor] - before_ns
        self._threads_ns = done_ns
        return _Load("thread", most_ns / elapsed_ns, busiest)

    def _busiest_channels(self, elapsed_ns: int) -> Iterator[_Load]:
        """The busiest channel of each medium; media inside hosts by their name there (``bus`` of
        ``bus@robot_3``)."""
        loads: dict[str, _Load] = {}
        for medium in (*self._graph.media, *self._graph.inside):
            busy = busy_ns(medium)
            if busy is None or not len(busy):
                continue
            shares = (busy - self._media_ns.get(medium.name, 0)) / elapsed_ns
            name = medium.name.partition("@")[0]
            load = _busiest(name, channels(medium, len(shares)), shares.tolist())
            if name not in loads or load.share > loads[name].share:
                loads[name] = load
            self._media_ns[medium.name] = busy
        yield from loads.values()

    def _lost_and_sent(self) -> list[tuple[int, int]]:
        """The frames of each medium so far, those lost because a queue was full and all; last, the
        same of messages."""
        topics = [topic.counts for topic in self._graph.topics.values()]
        return [*((_lost([medium.dropped]), medium.intended)
                  for medium in (*self._graph.media, *self._graph.inside)),
                (_lost([counts.dropped for counts in topics]),
                 sum([counts.intended for counts in topics]))]


def _busiest(resource: str, parts: Iterable[str], shares: list[float]) -> _Load:
    """The load of a resource whose ``parts`` have these shares."""
    share, part = max(zip(shares, parts, strict=True), key=itemgetter(0))
    more = sum(other >= _GIVES_IN for other in shares) - 1
    return _Load(resource, share, f"{part} and {more} more" if more > 0 else part)


def _lost(dropped: Iterable[Mapping[str, int]]) -> int:
    """The number of those that were dropped because a queue was full."""
    return sum([number for counts in dropped for reason, number in counts.items()
                if reason in _FULL])

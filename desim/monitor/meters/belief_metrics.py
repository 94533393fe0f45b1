"""Metrics of what hosts believe of each other.

They are the times until silence is noticed and until a returned host is heard again, and the
difference between beliefs and the truth.

The links are sampled once a second, and whenever a host starts, stops or is taken for gone. No
result but these metrics depends on that.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from desim.middleware.context import ACKS
from desim.middleware.counts import EDGES_NS
from desim.middleware.graph import Graph
from desim.middleware.host import Host
from desim.monitor.meters.meter import Due, Meter, Second
from desim.monitor.samples import Sample, mean, mean_over
from desim.ports.middleware import HostState
from desim.units import NS_PER_S

LATE_NS = NS_PER_S  # a message that took so long is late; the edge of a bin

Pair = tuple[int, int]  # believer, other: places in ``hosts``


class BeliefMetrics(Meter):
    """Watches ordered pairs (believer, other) of ``hosts``, those of the robots. ``samples`` are
    all of the run.

    ``linked()`` gives [n, n] bool for those of ``hosts`` that are up, in their order: whether
    frames get from one to the other now. None: between all.
    """

    def __init__(self, graph: Graph, hosts: Sequence[Host],
                 linked: Callable[[], np.ndarray | None], samples: Sequence[Sample]) -> None:
        self._graph, self._hosts, self._linked = graph, tuple(hosts), linked
        self._samples = samples
        self._place = {host.index: i for i, host in enumerate(self._hosts)}
        self._reach = np.zeros((len(hosts), len(hosts)), bool)  # pairs in reach at the last sample
        self._met = np.zeros_like(self._reach)  # and at any time
        self._lost_ns: dict[Pair, int] = {}  # out of reach since then, and taken for online
        self._gone: dict[Pair, None] = {}  # taken for offline or removed
        self._noticed_ns: list[int] = []
        self._unnoticed = 0
        self._false_alarms = 0
        self._again = 0  # pairs that came into each other's reach again
        self._resynced_ns: list[int] = []
        self._divergence: list[float] = []
        self._ghosts: list[int] = []
        self._beliefs = graph.context.beliefs
        graph.context.watchers.append(self._switched)
        if self._beliefs is not None:
            self._beliefs.watchers.append(self._sees)

    # --------------------------------------------------------------------------------- events

    def each_second(self, second: Second) -> None:
        self._sample_links(second.linked)
        if self._beliefs is not None:
            self._divergence.append(self._beliefs.divergence)
            self._ghosts.append(self._beliefs.ghosts)

    def _sample_links(self, links: np.ndarray | None) -> None:
        reach = np.zeros_like(self._reach)
        is_up = self._graph.up
        up = [i for i, host in enumerate(self._hosts) if is_up[host.index]]
        reach[np.ix_(up, up)] = True if links is None else links
        np.fill_diagonal(reach, False)
        before, self._reach = self._reach, reach
        if np.array_equal(before, reach):
            return
        self._graph.catch_up()  # what has arrived by now comes before the next arrival
        for believer, other in np.argwhere(before & ~reach).tolist():
            self._part(believer, other)
        for believer, other in np.argwhere(reach & ~before & self._met).tolist():
            self._meet_again(believer, other)
        self._met |= reach

    def _part(self, believer: int, other: int) -> None:
        self._hosts[other].on_next_arrival.pop(self._hosts[believer].index, None)
        if self._hosts[believer].up and (believer, other) not in self._gone:
            self._lost_ns[believer, other] = self._graph.kernel.now_ns

    def _meet_again(self, believer: int, other: int) -> None:
        if self._lost_ns.pop((believer, other), None) is not None:
            self._unnoticed += 1
        self._again += 1
        self._hosts[other].on_next_arrival[self._hosts[believer].index] = partial(
            self._heard, self._graph.kernel.now_ns)

    def _heard(self, since_ns: int, time_ns: int) -> None:
        self._resynced_ns.append(time_ns - since_ns)

    def _switched(self, host: int, up: bool) -> None:
        place = self._place.get(host)
        # At the start of the run nobody is there again.
        if place is None or (up and not self._met[place].any()):
            return
        if not up:
            # What it believed is gone, and nobody is left to notice anything.
            self._lost_ns = {pair: at for pair, at in self._lost_ns.items() if pair[0] != place}
            self._gone = {pair: None for pair in self._gone if pair[0] != place}
        self._sample_links(self._linked())

    def _sees(self, believer: int, other: int, state: HostState) -> None:
        if believer not in self._place or other not in self._place:
            return
        pair = self._place[believer], self._place[other]
        if state == HostState.ONLINE:
            self._gone.pop(pair, None)
        elif pair not in self._gone:
            if self._reach[pair]:  # as of the last sample, which may be a second ago
                self._sample_links(self._linked())
            self._gone[pair] = None
            if pair in self._lost_ns:
                self._noticed_ns.append(self._graph.kernel.now_ns - self._lost_ns.pop(pair))
            elif self._reach[pair]:
                self._false_alarms += 1

    # -------------------------------------------------------------------------------- numbers

    def sample(self, now_ns: int, due: Due) -> Sample:
        """The present values; those of beliefs only where the middleware has some."""
        out: Sample = {"stale_age_s": self.stale_age_s()}
        if self._beliefs is not None:
            out |= {"registry_divergence": self._beliefs.divergence,
                    "ghosts": self._beliefs.ghosts}
        return out

    def stale_age_s(self) -> float | None:
        """The age of the last message that a robot has heard from another one, as a mean over
        ordered pairs that are up; as old as the run where it heard none since its start. None
        without pairs."""
        up = [host.index for host in self._hosts if host.up]
        pairs = len(up) * (len(up) - 1)
        if not pairs:
            return None
        # Nobody hears itself: those entries are 0.
        received_ns = int(self._graph.arrivals.last_ns[np.ix_(up, up)].sum())
        return (self._graph.kernel.now_ns - received_ns / pairs) / NS_PER_S

    def summary(self, now_ns: int) -> Sample:
        context, believes = self._graph.context, self._beliefs is not None
        pairs = len(self._noticed_ns) + self._unnoticed + len(self._lost_ns)
        size, frames = context.discovery_bytes, context.discovery_frames
        kinds = [kind for kind in sorted(size) if kind != ACKS]
        return {
            "registry_divergence": _over_time(self._divergence),
            "ghosts": _over_time(self._ghosts),
            "discovery_bytes": sum(size[kind] for kind in kinds),
            "discovery_frames": sum(frames[kind] for kind in kinds),
            "discovery_by_kind": {kind: {"bytes": size[kind], "frames": frames[kind]}
                                  for kind in kinds},
            "ack_bytes": size.get(ACKS, 0),
            "detection_delay_s": {**_delays(self._noticed_ns),
                                  "noticed": len(self._noticed_ns) if believes else None,
                                  "pairs": pairs if believes else None},
            "false_alarms": self._false_alarms if believes else None,
            "resync_delay_s": {**_delays(self._resynced_ns), "resynced": len(self._resynced_ns),
                               "pairs": self._again},
            "stale_age_s": mean_over(self._samples, "stale_age_s"),
            "messages_late": messages_late(self._graph),
        }


def messages_late(graph: Graph) -> int:
    """Messages between hosts that took ``LATE_NS`` or longer, once for each receiver."""
    first = int(np.searchsorted(EDGES_NS, LATE_NS, side="right"))
    return int(graph.arrivals.tallies.latencies[:, first:].sum())


def _delays(delays_ns: list[int]) -> dict[str, float | None]:
    delays_s = [delay_ns / NS_PER_S for delay_ns in delays_ns]
    return {"mean": mean(delays_s), "max": max(delays_s, default=None)}


def _over_time(values: Sequence[float]) -> dict[str, float | None]:
    """The statistics of values that were sampled once a second."""
    return {"mean": mean(values), "max": max(values, default=None),
            "end": values[-1] if values else None}

"""The load of processors: of hosts, and of the cluster's nodes. User and system time are one."""

from __future__ import annotations

from collections.abc import Iterable

from desim.computers.cluster_node import ClusterNode
from desim.computers.processors import Processors
from desim.middleware.host import Host
from desim.monitor.meters.meter import Due, Meter, Second
from desim.monitor.samples import LEAST_WINDOW_NS, Sample, mean
from desim.monitor.truth import Truth
from desim.units import NS_PER_S

_NOT_MEASURED: Sample = {"cpu_percent": None, "cpu_s": None, "missed_ticks": 0}


class MeanLoad:
    """The mean load of ``these``, from one sample to the next."""

    def __init__(self, these: Iterable[Processors | ClusterNode]) -> None:
        self._these = list(these)
        self._since_ns = 0  # of the last sample
        self._busy_ns = [0] * len(self._these)  # at the last sample

    def percent(self, now_ns: int) -> float | None:
        """The mean share of the processors that was busy since the sample before; null if that was
        less than ``LEAST_WINDOW_NS`` ago, and without processors."""
        busy_ns, elapsed_ns = [each.busy_ns() for each in self._these], now_ns - self._since_ns
        if elapsed_ns < LEAST_WINDOW_NS:
            return None
        shares = [percent(each, after - before, elapsed_ns) for each, before, after
                  in zip(self._these, self._busy_ns, busy_ns, strict=True)]
        self._busy_ns, self._since_ns = busy_ns, now_ns
        return mean(shares)


class ProcessorLoad(Meter):
    """The loads of hosts, and of the cluster's nodes whose processors they share. Where computers
    are ideal there are none, and nothing is measured."""

    def __init__(self, truth: Truth) -> None:
        self._truth, self._nodes = truth, truth.nodes
        self._hosts = [host for host in truth.loaded if host.computer is not None]
        self._processors = [host.computer.processors for host in truth.loaded
                            if host.computer is not None]
        host_load = MeanLoad(self._processors)
        self._loads = {} if not self._hosts else {"cpu_percent": host_load, **(
            {"node_cpu_percent": MeanLoad(self._nodes.values())} if self._nodes else {})}

    def track(self, second: Second) -> Sample:
        return {} if not self._hosts else {
            "cpu_s": [each.busy_ns() / NS_PER_S for each in self._processors],
            "missed_ticks": [host.missed_ticks for host in self._hosts]}

    def quantities(self, now_ns: int) -> Sample:
        """The work of all hosts so far."""
        if not self._hosts:
            return {}
        busy_ns = sum([each.busy_ns() for each in self._processors])
        return {"cpu_s": busy_ns / NS_PER_S, "missed_ticks": self._missed()}

    def _missed(self) -> int:
        return sum([host.missed_ticks for host in self._hosts])

    def sample(self, now_ns: int, due: Due) -> Sample:
        """The mean loads of hosts and nodes since each was ``due`` before."""
        return {name: load.percent(now_ns) if due(name) else None
                for name, load in self._loads.items()}

    def by_host(self, now_ns: int) -> dict[str, Sample]:
        """Over the whole run; None where there is no load."""
        return {**dict.fromkeys(self._truth.robots, _NOT_MEASURED), **{
            host.name: _load(host, now_ns) for host in self._truth.with_software}}

    def summary(self, now_ns: int) -> Sample:
        """The means over hosts and over nodes (equation 8), all missed ticks, and each node."""
        nodes = {name: {"cpu_percent": percent(node, node.busy_ns(), now_ns),
                        "cpu_s": node.busy_ns() / NS_PER_S,
                        "waited_s": node.waited_ns() / NS_PER_S}
                 for name, node in self._nodes.items()}
        return {"mean_cpu_percent": mean([_load(host, now_ns)["cpu_percent"]
                                          for host in self._hosts]),
                "missed_ticks": self._missed(),
                "mean_node_cpu_percent": mean([node["cpu_percent"] for node in nodes.values()]),
                "cluster_nodes": nodes}


def _load(host: Host, elapsed_ns: int) -> Sample:
    """The load of ``host`` over the whole run."""
    if host.computer is None:
        return _NOT_MEASURED
    processors = host.computer.processors
    busy_ns = processors.busy_ns()
    return {"cpu_percent": percent(processors, busy_ns, elapsed_ns),
            "cpu_s": busy_ns / NS_PER_S, "missed_ticks": host.missed_ticks}


def percent(processors: Processors | ClusterNode, busy_ns: int, elapsed_ns: int) -> float:
    """The load of ``processors`` that were busy for ``busy_ns`` in ``elapsed_ns``, in per cent."""
    return 100.0 * busy_ns / (max(elapsed_ns, 1) * processors.count)

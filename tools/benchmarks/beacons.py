"""What does a beacon cost, on the bare medium and through whole nodes?

Hosts with a radio stand about, 1000 to the square kilometre, and say 100 B to everybody ten times a
second.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.air import Air
from desim.engine.garbage import rare_collections
from desim.engine.kernel import Kernel
from desim.engine.streams import Streams
from desim.engine.trace import Names, Trace
from desim.middleware.direct import Direct
from desim.middleware.graph import Graph
from desim.middleware.host import Host
from desim.middleware.message import Message
from desim.middleware.node import Node
from desim.network.medium import Medium
from desim.network.surroundings import Still
from desim.units import NS_PER_S
from netmodels.radio.radio import Radio

HERTZ = 10
FRAME_BYTES = 100 + 54  # 100 B of UDPROS
WARM_UP_S = 0.2
HOSTS = 100, 1000, 4000
FRAMES, TURNS = 2500, 6

# The parameters of a radio, by the name of its link budget.
BUDGETS: dict[str, dict[str, Any]] = {
    "default budget": {},
    "ns-3's budget": {"reception": {"preamble": "-82 dBm"},
                      "path_loss": {"reference": "46.6777 dB"}},
}


def places(hosts: int) -> dict[str, tuple[float, float]]:
    """Hosts anywhere on a square that has room for them."""
    side_m, draw = 1000 * (hosts / 1000) ** 0.5, np.random.default_rng(2)
    return {f"host_{i}": tuple(draw.uniform(0, side_m, 2)) for i in range(hosts)}


class Beacon:
    size_bytes = 96  # with its length 100 B


class Beacons(Node):
    """Says and hears beacons."""

    received = 0  # by all of them, ever

    def start(self) -> None:
        self.advertise("/beacon", transport="datagram", via="broadcast")
        self.subscribe("/beacon", self._hear)
        self.timer(HERTZ, self._say)

    def _say(self, k: int) -> None:
        self.publish("/beacon", Beacon)

    def _hear(self, message: Message) -> None:
        Beacons.received += 1


def _software(host: Host) -> list[Node]:
    return [Beacons(host, "beacons")]


class Nodes:
    """Whole nodes, without the first beacons."""

    def __init__(self, hosts: int, budget: str) -> None:
        self.kernel, names, streams = Kernel(), Names(), Streams(1)
        where = places(hosts)
        self.graph = Graph(self.kernel, names, Trace(names), streams, Direct(), where)
        own = [host.name for host in self.graph.hosts]
        self.medium = Medium("air", Radio.build(Radio.Params(**BUDGETS[budget])),
                             kernel=self.kernel, names=names, streams=streams, hosts=own,
                             place=Still(np.array([where[name] for name in own])))
        self.graph.attach(self.medium)
        for host in self.graph.hosts:
            host.software = _software
        self.graph.start()
        self.kernel.run(round(WARM_UP_S * NS_PER_S))

    def run(self, simulated_s: float) -> tuple[float, int, int]:
        """CPU time, frames and receptions of so long."""
        frames, delivered = self.medium.frames, self.medium.delivered
        start = time.process_time()
        self.kernel.run(self.kernel.now_ns + round(simulated_s * NS_PER_S))
        self.graph.trace.flush()
        return (time.process_time() - start, self.medium.frames - frames,
                self.medium.delivered - delivered)


class BareAir(Air):
    """Frames without messages, after the first ones."""

    def __init__(self, hosts: int, budget: str) -> None:
        super().__init__(places(hosts), **BUDGETS[budget])
        self.send_every(HERTZ, FRAME_BYTES, 1, broadcast=True)
        self.kernel.run(round(WARM_UP_S * NS_PER_S))

    def run(self, simulated_s: float) -> tuple[float, int, int]:
        """The same as ``Nodes.run``."""
        frames, delivered = self.medium.frames, self.medium.delivered
        cpu_s = self.spent_s(self.kernel.now_ns / 1e9, simulated_s)
        return cpu_s, self.medium.frames - frames, self.medium.delivered - delivered


KINDS: dict[str, Callable[[int, str], Nodes | BareAir]] = {"bare": BareAir, "nodes": Nodes}


def beacons() -> list[dict[str, object]]:
    """Beacons, best of several: times real time and CPU time of a frame, bare and whole nodes."""
    rows = []
    for hosts in HOSTS:
        simulated_s = FRAMES / HERTZ / hosts
        for budget in BUDGETS:
            row: dict[str, object] = {"what": f"{hosts} hosts, {budget}"}
            for kind, made in KINDS.items():
                with rare_collections():  # as in a run
                    running = made(hosts, budget)
                    cpu_s, sent, received = min(running.run(simulated_s) for _ in range(TURNS))
                if isinstance(running, BareAir):
                    row["heard by, in reach of"] = "{:.0f}, {:.0f}".format(*running.audience())
                    row["received by"] = round(received / sent, 1)
                row[f"{kind}: times real time"] = round(simulated_s / cpu_s, 2)
                row[f"{kind}: us a frame"] = round(1e6 * cpu_s / sent, 1)
            rows.append(row)
    return rows

"""What does a small message cost? Fifteen pairs of hosts, 797 B at 25 Hz over a switch."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from desim.engine.kernel import Kernel
from desim.engine.streams import Streams
from desim.engine.trace import Names, Trace
from desim.middleware.direct import Direct
from desim.middleware.graph import Graph
from desim.middleware.host import Host
from desim.middleware.node import Node
from desim.middleware.ros1.ros1 import Ros1
from desim.network.medium import Medium
from desim.units import NS_PER_S
from netmodels.switch import Switch

PAIRS, HERTZ, SECONDS = 15, 25, 30
BEGIN_NS = 3 * NS_PER_S  # all have found each other

MIDDLEWARE: dict[str, Callable[[], Any]] = {
    "direct": Direct,
    "ros1": lambda: Ros1(Ros1.Params(master="master")),
    "ros1, tcp_nodelay": lambda: Ros1(Ros1.Params(master="master", tcp_nodelay=True)),
}


class Scan:
    size_bytes = 797  # of 180 beams


class Talker(Node):
    def start(self) -> None:
        self.advertise("/" + self.host.name)
        self.timer(HERTZ, self._say)

    def _say(self, k: int) -> None:
        self.publish("/" + self.host.name, Scan)


class Listener(Node):
    def start(self) -> None:
        self.subscribe("/" + self.host.name.replace("listener", "talker"), lambda message: None)


def _software(host: Host) -> list[Node]:
    kinds = {"talker": Talker, "listener": Listener}
    return [kind(host, "node") for name, kind in kinds.items() if host.name.startswith(name)]


def microseconds(name: str) -> float:
    """CPU time of a message between hosts, with publishing and callback."""
    kernel, names, streams = Kernel(), Names(), Streams(1)
    hosts = ["master", *(f"{kind}_{k}" for kind in ("talker", "listener") for k in range(PAIRS))]
    graph = Graph(kernel, names, Trace(names), streams, MIDDLEWARE[name](), hosts)
    graph.attach(Medium("lan", Switch(Switch.Params()), kernel=kernel, names=names,
                        streams=streams, hosts=[host.name for host in graph.hosts]))
    for host in graph.hosts:
        host.software = _software
    graph.start()
    kernel.run(BEGIN_NS)
    before, begin_s = graph.messages, time.process_time()
    kernel.run(BEGIN_NS + SECONDS * NS_PER_S)
    return (time.process_time() - begin_s) / (graph.messages - before) * 1e6


def messages() -> list[dict[str, object]]:
    """A message of 797 B between two hosts; the best of five."""
    return [{"what": name, "us": round(min(microseconds(name) for _ in range(5)), 1)}
            for name in MIDDLEWARE]

"""Hosts with nodes of a test's choice on one ideal medium."""

from __future__ import annotations

from desim.engine.kernel import Kernel
from desim.engine.streams import Streams
from desim.engine.trace import Names, Trace
from desim.middleware.direct import Direct
from desim.middleware.graph import Graph
from desim.middleware.node import Node
from desim.network.medium import Medium
from desim.network.surroundings import Nowhere
from netmodels.ideal import Ideal


class Hosts:
    """``software``: host name to a function that makes its nodes, which are in ``nodes``."""

    def __init__(self, **software):
        self.kernel, names, streams = Kernel(), Names(), Streams(3)
        self.batches = []
        self.graph = Graph(self.kernel, names, Trace(names, self.batches.append), streams,
                           Direct(), list(software))
        hosts = [host.name for host in self.graph.hosts]
        self.graph.attach(Medium("lan", Ideal(Ideal.Params()), (), kernel=self.kernel, names=names,
                                 streams=streams, hosts=hosts, place=Nowhere(len(hosts))), None)
        self.nodes = {}
        for name, make in software.items():
            def made(host, name=name, make=make):
                self.nodes[name] = make(host)
                return self.nodes[name]
            self.graph.host(name).software = made
        self.graph.start()

    def at(self, time_ns, fn):
        self.kernel.at(time_ns, 0, 0, lambda _: fn())
        return self

    def run(self, until_ns):
        self.kernel.run(until_ns)
        self.graph.catch_up()
        return self


class Ears(Node):
    """Notes (time_ns, topic, content) of what it hears on ``topics``; says what a test wants."""

    def __init__(self, host, *topics, says=()):
        super().__init__(host, "ears")
        self.heard, self._topics, self._says = [], topics, says

    def start(self):
        for topic in self._says:
            self.advertise(topic)
        for topic in self._topics:
            self.subscribe(topic, lambda message, topic=topic: self.heard.append(
                (self.now_ns, topic, message.content)), 100)

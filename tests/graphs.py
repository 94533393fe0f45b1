"""A small network of hosts to test with: who says what, and what becomes of it."""

from __future__ import annotations

from fractions import Fraction
from functools import partial

from desim.computers.computer import Computer
from desim.computers.memory import Memory
from desim.computers.processors import Processors
from desim.computers.scheduling import DISCIPLINES
from desim.engine.kernel import Kernel, Phase
from desim.engine.streams import Streams
from desim.engine.trace import Names, Trace
from desim.middleware.direct import Direct
from desim.middleware.graph import Graph
from desim.middleware.graph_options import GraphOptions
from desim.middleware.node import Node
from desim.network.itemized_medium import ItemizedMedium
from desim.network.medium import Medium
from desim.network.surroundings import Nowhere
from desim.ports.computers import MemoryModel
from netmodels.ideal import Ideal

MS = 10**6
S = 10**9


class Words:
    """Content of a given size."""

    def __init__(self, text: str, size_bytes: int = 100) -> None:
        self.text = text
        self.size_bytes = size_bytes


class Life(Node):
    """A node that does what a test tells it: ``begin(node)`` is its ``start``."""

    def __init__(self, host, name, begin):
        super().__init__(host, name)
        self._begin = begin

    def start(self):
        self._begin(self)


class Net:
    """A graph over one medium whose trace rows are kept. ``nodes``: host name to a function (or
    several, by node name) that starts its node; ``ledger``: a ``MessageLedger``. ``costs``: a cost
    model for all hosts, with ``processors``, ``speed``, ``discipline``, ``priorities``, and
    ``memory_bytes`` if it knows memory.
    ``further`` media: model, rules and hosts (None: all) by name. ``routes(graph, media)`` is
    called before anybody starts; ``on``: the hosts on the first medium."""

    def __init__(self, nodes, model=None, rules=(), *, place=None, middleware=None, seed=0,
                 ledger=None, costs=None, processors=1, speed=Fraction(1),
                 discipline="processor_sharing", priorities=None, memory_bytes=None, further=None,
                 routes=None, on=None, **options):
        new_medium = Medium
        if ledger is not None:
            options |= {"on_fate": ledger, "passages": ledger.passages,
                        "callbacks": ledger.callbacks}
            new_medium = partial(ItemizedMedium, ledger.passages)
        self.kernel, self.names, self.fates = Kernel(), Names(), []
        self.batches = []
        self.trace = Trace(self.names, self.batches.append)
        streams = Streams(seed)
        options.setdefault("on_fate", self._fate)
        if costs is not None:
            options["computers"] = {host: Computer(
                Processors(self.kernel, self.names.id(host), processors, speed,
                           DISCIPLINES[discipline]()), costs, priorities or {},
                Memory(costs, memory_bytes) if isinstance(costs, MemoryModel) else None)
                for host in nodes}
        self.graph = Graph(self.kernel, self.names, self.trace, streams, middleware or Direct(),
                           nodes, GraphOptions(**options))
        hosts = [host.name for host in self.graph.hosts]
        self.media = {}
        for name, (own, its_rules, attached) in {"lan": (model or Ideal(Ideal.Params()), rules, on),
                                                 **(further or {})}.items():
            self.media[name] = new_medium(
                name, own, its_rules, kernel=self.kernel, names=self.names, streams=streams,
                hosts=hosts, place=place or Nowhere(len(hosts)))
            self.graph.attach(self.media[name], attached)
        self.medium = self.media["lan"]
        if routes is not None:
            routes(self.graph, self.media)
        for host, begin in nodes.items():
            lives = begin if isinstance(begin, dict) else {"node": begin}
            self.graph.host(host).software = lambda host, lives=lives: [
                Life(host, name, life) for name, life in lives.items()]
        self.graph.start()

    def at(self, time_ns, fn, phase=Phase.WORLD):
        """Call ``fn()`` at ``time_ns``."""
        self.kernel.at(time_ns, phase, 0, lambda _: fn())

    def run(self, until_ns):
        self.kernel.run(until_ns)
        self.graph.catch_up()
        return self

    def rows(self, *kinds):
        """The log so far: (time_ns, kind, entity, a, b, c), ids as names where they are some."""
        self.trace.flush()
        names = self.names.items()
        out = [(int(t), names[kind], names[entity], *(names.get(int(v), int(v)) for v in rest))
               for batch in self.batches for t, kind, entity, *rest in batch.tolist()]
        return [row for row in out if not kinds or row[1] in kinds]

    def counts(self, topic):
        return self.graph.topics[topic].counts

    def waiting(self):
        """Receptions under way, counted where they are and not by subtraction."""
        return sum(publisher.transport.waiting() for topic in self.graph.topics.values()
                   for publisher in topic.publishers)

    def _fate(self, message, receiver, time_ns, reason, first_ns, last_ns):
        self.fates.append((message.number, self.graph.hosts[receiver].name, time_ns,
                           reason or "delivered", first_ns, last_ns))


def silent(node):
    """A node that does nothing."""


def listener(log, topic="/talk", queue=1):
    """Starts a node that logs (time_ns, host, source, text)."""
    def begin(node):
        def heard(message):
            log.append((node.now_ns, node.host.name,
                        node.host.graph.hosts[message.source].name, message.content.text))
        node.subscribe(topic, heard, queue=queue)
    return begin


def talker(says, topic="/talk", size_bytes=100, **options):
    """Starts a node that says the given words at the given times."""
    def begin(node):
        node.advertise(topic, **options)
        for time_ns, text in says:
            if time_ns >= node.now_ns:
                node.after(time_ns - node.now_ns,
                           lambda text: node.publish(topic, Words(text, size_bytes)), text)
    return begin

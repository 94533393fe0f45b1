"""Two hosts with a TCP between them, and a log of all that its users hear."""

from __future__ import annotations

from configured import configured
from graphs import Net, silent

from desim.middleware.tcp import Tcp, TcpParams
from desim.ports import PASS, Drop
from netmodels.access_link import AccessLink
from netmodels.rules.partition import Partition


class Word:
    """A message as TCP sees one."""

    def __init__(self, seq):
        self.seq = seq
        self.first_ns = self.last_ns = -1


class Losing:
    """A rule that loses the frames of these numbers, from 1, counted over all that are sent from
    ``source`` with at least ``least_bytes``."""

    reasons = ("lost",)

    def __init__(self, *numbers, source=0, least_bytes=0):
        self._numbers, self._source, self._least_bytes = numbers, source, least_bytes
        self._count = 0

    def start(self, context, hosts):
        pass

    def judge(self, frame, receivers):
        if frame.source != self._source or frame.size_bytes < self._least_bytes:
            return None
        self._count += 1
        return [Drop("lost") if self._count in self._numbers else PASS for _ in receivers]


class Takes:
    """A rule that takes ``packets`` out of the trains of these numbers, from 1."""

    reasons = ("taken",)

    def __init__(self, packets, trains=(1,)):
        self._packets, self._trains, self._count = packets, trains, 0
        self.seen = []

    def start(self, context, hosts):
        pass

    def judge(self, frame, receivers):
        self._count += 1
        self.seen.append((frame.segments, frame.size_bytes))
        if self._count not in self._trains:
            return None
        return [Drop("taken", self._packets) for _ in receivers]


class Pair:
    """``a`` calls, ``b`` listens to the service talk. They know each other's address unless
    ``params`` says otherwise. The log: (time_ns, what, ...)."""

    def __init__(self, model=None, rules=(), *, params=None, **options):
        self.net = Net({"a": silent, "b": silent}, model, rules, **options)
        self.tcp = Tcp(self.net.graph.context, configured(
            TcpParams, **{"arp": "static"} | (params or {})))
        self.log = []
        self.calls = []  # connections
        self.tcp.listen(1, "talk", self._accept)

    @property
    def connection(self):
        return self.calls[-1]

    def note(self, *what):
        self.log.append((self.net.kernel.now_ns, *what))

    def _accept(self, connection):
        self.note("accepted")
        connection.on_closed(1, lambda connection, reason: self.note("b closed", reason))

    def call(self, service="talk", **options):
        self.calls.append(self.tcp.connect(
            0, 1, service, "talk", opened=lambda connection: self.note("opened"),
            closed=lambda connection, reason: self.note("a closed", reason), **options))

    def say(self, seq, size_bytes=100, source=0):
        self.connection.send(source, size_bytes, lambda word: self.note("heard", word.seq),
                             Word(seq))

    def close(self, host):
        self.connection.close(host)

    def stop(self, host):
        self.net.graph.hosts[host].stop()
        self.tcp.switched(host, False)

    def start(self, host):
        self.net.graph.hosts[host].start()
        self.tcp.switched(host, True)

    def at(self, time_ns, fn, *args):
        self.net.at(time_ns, lambda: fn(*args))
        return self

    def run(self, until_ns):
        self.net.run(until_ns)
        return self

    def rows(self, *kinds):
        """The log of the network: (time_ns, kind, from, to, seq or kind, bytes)."""
        return [row for row in self.net.rows(*kinds) if row[1] != "host_started"]

    def heard(self):
        """(time_ns, seq) of what arrived."""
        return [(row[0], row[2]) for row in self.log if row[1] == "heard"]

    def at_rest(self):
        """Whether no end exists any more."""
        return not any(self.tcp._ends.values())


def link(**params):
    return AccessLink(AccessLink.Params(**params))


def partition(start, until):
    return Partition(Partition.Params(groups=[["b"]], **{"from": start, "until": until}))

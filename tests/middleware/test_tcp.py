"""TCP: whole logs of small cases, and what theory says of large ones."""

import pytest
from graphs import MS, Net, S, silent

from desim.middleware.tcp import Tcp, TcpParams
from netmodels.link import Link
from netmodels.rules.loss import Loss
from netmodels.rules.partition import Partition


class Word:
    """A message as TCP sees one."""

    def __init__(self, seq):
        self.seq = seq


class Pair:
    """Hosts a, b (and more) over a network with a TCP, and a log of all that its users hear."""

    def __init__(self, model=None, rules=(), hosts="ab", params=None, **options):
        self.net = Net(dict.fromkeys(hosts, silent), model, rules, **options)
        self.tcp = Tcp(self.net.graph.context, TcpParams(**params or {}))
        self.log = []
        self.accepted = []
        self.tcp.listen(1, "talk", self._accept)

    def _note(self, *what):
        self.log.append((self.net.kernel.now_ns, *what))

    def _accept(self, connection):
        self.accepted.append(connection)
        self._note("accepted")
        connection.on_closed(1, lambda connection, reason: self._note("b closed", reason))

    def call(self, service="talk", **options):
        self.connection = self.tcp.connect(
            0, 1, service, "talk", opened=lambda connection: self._note("opened"),
            closed=lambda connection, reason: self._note("a closed", reason), **options)
        return self.connection

    def say(self, seq, size_bytes=100, source=0):
        self.connection.send(source, size_bytes, lambda word: self._note("heard", word.seq),
                             Word(seq))

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
        return [row for row in self.net.rows(*kinds) if row[1] != "host_started"]


def link(**params):
    return Link(Link.Params(**params))


def partition(start, until):
    return Partition(Partition.Params(groups=[["b"]], **{"from": start, "until": until}))


def test_hello():
    """A handshake, a message, its acknowledgement 40 ms later."""
    pair = Pair(link(rate="1 Gb/s", latency="1 ms"))
    pair.call()
    pair.at(10 * MS, pair.say, 7).run(S)
    assert pair.log == [(2_001_248, "opened"), (3_001_808, "accepted"), (11_001_360, "heard", 7)]
    assert pair.rows() == [
        (0, "control", "a", "b", "talk", 78), (1_000_624, "control", "b", "a", "talk", 78),
        (2_001_248, "control", "a", "b", "talk", 70), (10 * MS, "frame", "a", "b", 7, 170)]
    assert pair.net.graph.context.discovery_bytes == {"ack": 70, "talk": 226}
    assert not pair.connection.unacked(0)


def test_a_partition_is_felt_until_the_next_timeout():
    """Nagle lets the second message wait for the acknowledgement of the first."""
    pair = Pair(rules=[partition("1 s", "2.5 s")])
    pair.call()
    pair.at(S, pair.say, 1).at(2 * S, pair.say, 2).run(10 * S)
    assert pair.log == [(0, "opened"), (0, "accepted"), (4 * S, "heard", 1),
                        (4_040 * MS, "heard", 2)]


def test_nobody_listens():
    pair = Pair()
    pair.call("other")
    assert pair.run(S).log == [(0, "a closed", "refused")]


@pytest.mark.parametrize(("size_bytes", "loss"), [(100, 0.2), (20_000, 0.2), (600_000, 0.05)])
def test_all_arrives_under_loss(size_bytes, loss):
    pair = Pair(link(rate="100 Mb/s", latency="1 ms"), [Loss(Loss.Params(probability=loss))])
    pair.call()
    for k in range(20):
        pair.say(k, size_bytes)
    pair.run(3600 * S)
    assert [seq for _, what, seq in (row for row in pair.log if len(row) == 3)] == list(range(20))


def test_close():
    pair = Pair()
    pair.call()
    pair.at(S, pair.say, 1).at(S, lambda: pair.connection.close(0))
    pair.at(2 * S, lambda: pair.connection.close(1)).run(1000 * S)
    assert pair.log == [(0, "opened"), (0, "accepted"), (S, "heard", 1), (S, "b closed", "fin")]
    assert not any(pair.tcp._ends.values())


def test_a_peer_that_restarted_resets():
    pair = Pair()
    pair.call()
    pair.at(S, pair.stop, 1).at(2 * S, pair.start, 1).at(3 * S, pair.say, 1).run(10 * S)
    assert pair.log == [(0, "opened"), (0, "accepted"), (3 * S, "a closed", "reset")]

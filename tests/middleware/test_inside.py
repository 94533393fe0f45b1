"""Media inside hosts: what a bus does to messages between the nodes of one host."""

import pytest
from graphs import MS, Net, S, listener, silent, talker

from desim.network.medium import Medium
from desim.network.surroundings import Nowhere
from netmodels.access_link import AccessLink
from netmodels.bus import Bus
from netmodels.ideal import Ideal
from netmodels.rules.loss import Loss

TOPIC = "/talk"


def serial(rate="1 Mb/s", **params):
    return AccessLink(AccessLink.Params(rate=rate, **params))


def cable(arbitration):
    return Bus(Bus.Params(arbitration=arbitration, rate="1 Mb/s", propagation="0 ns"))


def with_bus(*hosts, make=serial, rules=(), pattern=TOPIC, media=()):
    """Gives each of these hosts a medium of its own for topics of this pattern, which go to other
    hosts over ``media``, names, or any."""
    def routes(graph, known):
        inside = {}
        for name in hosts:
            host = graph.host(name)
            inside[host.index] = Medium(
                f"bus@{name}", make(), rules, kernel=graph.kernel, names=graph.names,
                streams=graph.streams, hosts=[one.name for one in graph.hosts],
                place=Nowhere(len(graph.hosts)))
            graph.put_inside(inside[host.index], host.index)
        graph.routes.choose(pattern, [known[name] for name in media], inside)
    return routes


def test_the_whole_log_of_a_message_on_a_bus():
    """174 B at 1 Mb/s: 1.392 ms. On b, which has none, its node hears itself at once."""
    heard = []
    says = {"mouth": talker([(S, "hm")], topic="talk"), "ear": listener(heard, "talk")}
    net = Net({"a": says, "b": says}, routes=with_bus("a", pattern="talk")).run(2 * S)
    at_ns = S + 1_392_000
    assert heard == [(S, "b", "b", "hm"), (at_ns, "a", "a", "hm")]
    assert [row for row in net.rows() if row[1] != "host_started"] == [
        (S, "sent", "a", "/a/talk", 1, 100),
        (S, "frame", "a", "a", 1, 174),
        (S, "callback", "b", "b", 1, "/b/talk"),
        (at_ns, "delivered", "a", "a", 1, 1_392_000),
        (at_ns, "callback", "a", "a", 1, "/a/talk")]
    (bus,) = net.graph.inside
    assert (bus.frames, bus.delivered, net.medium.frames) == (1, 1, 0)
    assert [(host.tx_bytes, host.rx_bytes) for host in net.graph.hosts] == [(0, 0), (0, 0)]


def test_each_host_has_a_bus_of_its_own():
    heard = []
    says = {"mouth": talker([(S, "x")], topic="talk"), "ear": listener(heard, "talk")}
    Net(dict.fromkeys("abc", says), routes=with_bus(*"abc", pattern="talk")).run(2 * S)
    assert [time_ns for time_ns, *_ in heard] == [S + 1_392_000] * 3


def test_what_shares_a_bus_waits():
    """Two topics at once: one frame after the other."""
    heard = []
    net = Net({"a": {"one": talker([(S, "x")], "/talk/1"), "two": talker([(S, "y")], "/talk/2"),
                     "ear": listener(heard, "/talk/1"), "ear 2": listener(heard, "/talk/2")}},
              routes=with_bus("a", pattern="/talk/*")).run(2 * S)
    assert sorted(time_ns for time_ns, *_ in heard) == [S + 1_392_000, S + 2 * 1_392_000]
    assert len(net.fates) == 2


@pytest.mark.parametrize("media, at_b", [((), S + 3 * MS), (("wifi",), S + 5 * MS)])
def test_other_hosts_are_reached_as_ever(media, at_b):
    """lan (3 ms) by preference, or what the topic has chosen beside its bus."""
    heard = []
    net = Net({"a": {"mouth": talker([(S, "x")]), "ear": listener(heard)}, "b": listener(heard)},
              Ideal(Ideal.Params(delay="3 ms")),
              further={"wifi": (Ideal(Ideal.Params(delay="5 ms")), (), None)},
              routes=with_bus("a", media=media)).run(2 * S)
    assert sorted(heard) == [(S + 1_392_000, "a", "a", "x"), (at_b, "b", "a", "x")]
    assert net.counts(TOPIC).intended == 2


def test_a_latched_message_comes_over_the_bus_to_a_node_that_subscribes_late():
    heard = []

    def late(node):
        node.after(5 * S, lambda _: listener(heard)(node))

    net = Net({"a": {"mouth": talker([(S, "x")], latch=True), "late": late}},
              routes=with_bus("a")).run(6 * S)
    assert [time_ns for time_ns, *_ in heard] == [5 * S + 1_392_000]
    assert net.counts(TOPIC).unmatched == 0


@pytest.mark.parametrize("transport", ["stream", "datagram"])
def test_a_bus_may_lose_packets(transport):
    """A stream sends them again. (A tenth of 20 packets of a message.)"""
    heard = []
    net = Net({"a": {"mouth": talker([(S, "x")], size_bytes=28_000, transport=transport),
                     "ear": listener(heard)}}, seed=3,
              routes=with_bus("a", rules=[Loss(Loss.Params(probability="10 %"))])).run(20 * S)
    assert len(heard) == (transport == "stream")
    assert [fate[3] for fate in net.fates] == ["delivered" if heard else "random_loss"]


def test_a_host_that_stops_drops_what_waits():
    heard = []
    net = Net({"a": {"mouth": talker([(S, str(k)) for k in range(3)], queue=5),
                     "ear": listener(heard)}}, routes=with_bus("a"))
    net.at(S + MS, net.graph.host("a").stop)
    net.run(2 * S)
    assert not heard
    assert sorted(fate[3] for fate in net.fates) == ["host_down", "sender_down", "sender_down"]
    assert net.waiting() == 0


@pytest.mark.parametrize("make", [
    serial, lambda: Ideal(Ideal.Params(delay="1 ms")), *(lambda kind=kind: cable(kind)
                                                         for kind in ("csma", "csma_cd", "fifo"))])
def test_models_that_can_be_inside(make):
    """All of 200 messages arrive, in order, whatever the model."""
    heard = []
    net = Net({"a": {"mouth": talker([(S + k * MS, str(k)) for k in range(200)], queue=0,
                                     size_bytes=3000),
                     "ear": listener(heard, queue=0)}, "b": silent},
              routes=with_bus("a", make=make)).run(60 * S)
    assert [text for *_, text in heard] == [str(k) for k in range(200)]
    (bus,) = net.graph.inside
    assert bus.intended == bus.delivered + sum(bus.dropped.values())

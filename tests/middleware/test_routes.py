"""Several media: which of them frames take, by topic, past lost carriers, through other hosts."""

import numpy as np
import pytest
from graphs import MS, Net, S, listener, silent, talker
from hypothesis import given, settings
from hypothesis import strategies as st

from desim import ports
from desim.middleware.link_states import LinkStates
from desim.middleware.message_ledger import ROW, STAMP, MessageLedger
from desim.network.passages import Passages
from desim.ports.scope import is_topic
from netmodels.access_link import AccessLink
from netmodels.ideal import Ideal
from netmodels.rules.loss import Loss
from netmodels.rules.outage import Flapping, Outage

UNPLUGGED = {"hosts": ["a"], "from": "1 s", "until": "3 s"}


def ideal(delay):
    return Ideal(Ideal.Params(delay=delay))


def link(**params):
    return AccessLink(AccessLink.Params(**params))


def failing_over(announce_every_ns=S):
    """Gives a graph link states, noticed after 100 ms."""
    def routes(graph, media):
        graph.routes.link_states = LinkStates(graph, 100 * MS, announce_every_ns)
    return routes


def two_media(says, answers, routes, **options):
    """Hosts a and b on lan (1 ms), from which a is unplugged from 1 to 3 s, and wifi (5 ms)."""
    heard = []
    net = Net({"a": {"mouth": talker(says), "ear": listener(heard, "/back")},
               "b": {"mouth": talker(answers, topic="/back"), "ear": listener(heard)}},
              ideal("1 ms"), [Outage(Outage.Params(**UNPLUGGED))],
              further={"wifi": (ideal("5 ms"), (), None)}, routes=routes, **options)
    return net, heard


# ------------------------------------------------------------------------------------ failover


def test_the_whole_log_of_a_failover():
    """a notices after 100 ms, says so every second over wifi, and once more when lan is back. What
    was under way comes over wifi with the next retransmission: 200 ms after it was sent, and within
    a tick of 4 ms more."""
    net, heard = two_media([(S + 50 * MS, "lost at first"), (2500 * MS, "by wifi")],
                           [(1500 * MS, "as well"), (4 * S, "by lan")], failing_over())
    net.run(5 * S)
    again_ns = S + 252 * MS
    assert net.rows() == [
        (0, "host_started", "a", 0, 0, 0),
        (0, "host_started", "b", 0, 0, 0),
        (S + 50 * MS, "sent", "a", "/talk", 1, 100),
        (S + 50 * MS, "frame", "a", "b", 1, 174),
        (S + 50 * MS, "lost", "b", "a", 1, "outage"),
        (S + 100 * MS, "carrier_lost", "a", "medium/lan", 0, 0),
        (S + 100 * MS, "control", "a", "medium/wifi", "link_state", 64),
        (again_ns, "frame", "a", "b", 1, 174),
        (again_ns + 5 * MS, "delivered", "b", "a", 1, 207 * MS),
        (again_ns + 5 * MS, "callback", "b", "a", 1, "/talk"),
        (1500 * MS, "sent", "b", "/back", 1, 100),
        (1500 * MS, "frame", "b", "a", 1, 174),
        (1505 * MS, "delivered", "a", "b", 1, 5 * MS),
        (1505 * MS, "callback", "a", "b", 1, "/back"),
        (2100 * MS, "control", "a", "medium/wifi", "link_state", 64),
        (2500 * MS, "sent", "a", "/talk", 2, 100),
        (2500 * MS, "frame", "a", "b", 2, 174),
        (2505 * MS, "delivered", "b", "a", 2, 5 * MS),
        (2505 * MS, "callback", "b", "a", 2, "/talk"),
        (3100 * MS, "control", "a", "medium/wifi", "link_state", 64),
        (3100 * MS, "carrier_back", "a", "medium/lan", 0, 0),
        (3100 * MS, "control", "a", "medium/lan", "link_state", 64),
        (4 * S, "sent", "b", "/back", 2, 100),
        (4 * S, "frame", "b", "a", 2, 174),
        (4001 * MS, "delivered", "a", "b", 2, MS),
        (4001 * MS, "callback", "a", "b", 2, "/back")]
    assert net.graph.context.discovery_bytes == {"link_state": 4 * 64}
    assert len(heard) == 4


@pytest.mark.parametrize("routes, to_b, to_a", [
    (failing_over(), True, True),
    (failing_over(announce_every_ns=None), True, False),  # Linux's static routes: b goes on by lan
    (None, False, False),
])
def test_the_other_end_has_to_hear_of_it(routes, to_b, to_a):
    """Between 1.3 and 2.9 s: nobody falls back without link states, and b not without a word."""
    net, heard = two_media([(1300 * MS, "x")], [(1300 * MS, "y")], routes)
    net.run(2900 * MS)
    hosts = [host for _, host, *_ in heard]
    assert ("b" in hosts, "a" in hosts) == (to_b, to_a)


def test_who_restarts_looks_at_its_interfaces():
    """a starts anew while it is unplugged, without waiting for anything to change; b, which starts
    anew too, hears of it within a second."""
    net, heard = two_media([(2 * S, "x")], [(2200 * MS, "y")], failing_over())
    for name, down_ns, up_ns in (("a", 1200 * MS, 1300 * MS), ("b", 1400 * MS, 1500 * MS)):
        net.at(down_ns, net.graph.host(name).stop)
        net.at(up_ns, net.graph.host(name).start)
    net.run(2900 * MS)
    assert net.rows("carrier_lost") == [(1100 * MS, "carrier_lost", "a", "medium/lan", 0, 0)]
    assert [row[0] for row in net.rows("control")] == [1100 * MS, 1300 * MS, 2300 * MS]
    # b does not know at 2.2 s, and sends again by wifi when its timeout comes.
    assert [(time_ns, host) for time_ns, host, *_ in heard] == [
        (2005 * MS, "b"), (2409 * MS, "a")]


def test_a_broadcast_goes_over_the_medium_of_each_receiver():
    """While b is unplugged, a's broadcast is two frames: one for c on lan, one for b on wifi."""
    heard = []
    net = Net({"a": talker([(500 * MS, "one"), (2 * S, "two")], via="broadcast"),
               "b": listener(heard), "c": listener(heard)},
              ideal("1 ms"), [Outage(Outage.Params(**{**UNPLUGGED, "hosts": ["b"]}))],
              further={"wifi": (ideal("5 ms"), (), None)}, routes=failing_over())
    net.run(3 * S)
    assert [(row[0], row[3]) for row in net.rows("frame")] == [
        (500 * MS, "medium/lan"), (2 * S, "medium/wifi"), (2 * S, "medium/lan")]
    assert sorted(heard) == [(501 * MS, "b", "a", "one"), (501 * MS, "c", "a", "one"),
                             (2001 * MS, "c", "a", "two"), (2005 * MS, "b", "a", "two")]


def test_without_a_carrier_anywhere_the_first_medium_is_tried():
    net, heard = two_media([(1500 * MS, "x")], [], failing_over())
    states = net.graph.routes.link_states
    states._cut[0][0, 1] = None  # a believes that wifi is gone, too
    states._cut[0][0, 0] = None
    net.run(1600 * MS)
    assert [row[1:3] for row in net.rows("lost")] == [("lost", "b")]


@pytest.mark.parametrize("window, changes", [
    ({"from": "1 s", "until": "3 s"}, [S, 3 * S]),
    ({"from": "1 s"}, [S]),
    ({"until": "2 s"}, [2 * S]),
    ({"from": "1 s", "until": "2 s", "every": "5 s"}, [S, 2 * S, 6 * S, 7 * S, 11 * S, 12 * S]),
])
def test_an_outage_says_when_carriers_change(window, changes):
    rule = Outage(Outage.Params(hosts=["a"], links=[("b", "c")], **window))
    net = Net({"a": silent, "b": silent, "c": silent}, rules=[rule])
    assert isinstance(rule, ports.CutsCarrier)
    assert rule.carrier(1) == rule.carrier(2) == (True, None)
    now_ns, up, seen = 0, rule.carrier(0)[0], []
    while (next_ns := rule.carrier(0)[1]) is not None and next_ns < 13 * S:
        net.run(next_ns)
        assert rule.carrier(0)[0] is (up := not up)
        assert next_ns > now_ns
        now_ns = next_ns
        seen.append(next_ns)
    assert seen == changes


def test_flapping_carriers_are_those_of_its_frames():
    rule = Flapping(Flapping.Params(hosts=["a"], up="300 ms", down="200 ms"))
    net = Net({"a": silent, "b": silent}, rules=[rule])
    for _ in range(50):
        up, until_ns = rule.carrier(0)
        assert up is not rule.separates(0, 1)
        net.run(until_ns)
        assert rule.carrier(0)[0] is not up


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 1000))
def test_flapping_loses_nothing_of_a_stream(seed):
    """A cable that comes and goes, and Wi-Fi beside it: each message arrives once, in order."""
    heard = []
    net = Net({"a": talker([(k * 100 * MS, str(k)) for k in range(1, 40)], queue=0),
               "b": listener(heard, queue=0)}, ideal("1 ms"),
              [Flapping(Flapping.Params(hosts=["a"], up="500 ms", down="300 ms"))],
              further={"wifi": (link(rate="1 Mb/s"), (), None)}, seed=seed, routes=failing_over())
    net.run(200 * S)
    assert [text for *_, text in heard] == [str(k) for k in range(1, 40)]
    for medium in net.media.values():
        assert medium.intended == medium.delivered + sum(medium.dropped.values())


# ------------------------------------------------------------------------------------ forwarding


def relayed(says, lan=None, wifi=None, wifi_rules=(), **options):
    """a on wifi, c on lan, and b on both, which forwards."""
    heard = []
    net = Net({"a": talker(says, **options.pop("how", {})), "b": silent, "c": listener(heard)},
              lan or ideal("1 ms"), options.pop("rules", ()), on=["b", "c"],
              further={"wifi": (wifi or ideal("5 ms"), wifi_rules, ["a", "b"])},
              routes=lambda graph, media: graph.routes.forward("b", [media["lan"], media["wifi"]]),
              **options)
    return net, heard


def test_the_whole_log_of_a_relay():
    """174 B: 1.392 ms at 1 Mb/s, then 0.139 200 ms at 10 Mb/s, one after the other."""
    net, heard = relayed([(S, "hello")], link(rate="10 Mb/s"), link(rate="1 Mb/s"))
    net.run(2 * S)
    at_ns = S + 1_392_000 + 139_200
    assert net.rows() == [
        (0, "host_started", "a", 0, 0, 0),
        (0, "host_started", "b", 0, 0, 0),
        (0, "host_started", "c", 0, 0, 0),
        (S, "sent", "a", "/talk", 1, 100),
        (S, "frame", "a", "c", 1, 174),
        (S + 1_392_000, "forwarded", "b", "a", "c", 174),
        (at_ns, "delivered", "c", "a", 1, 1_531_200),
        (at_ns, "callback", "c", "a", 1, "/talk")]
    assert heard == [(at_ns, "c", "a", "hello")]
    assert [(host.name, host.tx_bytes, host.rx_bytes) for host in net.graph.hosts] == [
        ("a", 174, 0), ("b", 174, 174), ("c", 0, 174)]


def test_a_host_that_does_not_forward_is_no_way():
    net, heard = relayed([(S, "hello")])
    twin = Net({"a": talker([(S, "hello")]), "b": silent, "c": listener(heard)}, on=["b", "c"],
               further={"wifi": (ideal("5 ms"), (), ["a", "b"])})
    twin.run(2 * S)
    assert net.run(2 * S).fates == [(1, "c", S + 6 * MS, "delivered", S, S)]
    assert twin.fates == [(1, "c", S, "no_route", -1, -1)]


def test_a_relay_that_is_down_forwards_nothing():
    net, heard = relayed([(S, "hello")], how={"transport": "datagram"})
    net.at(S + MS, net.graph.host("b").stop)
    net.run(2 * S)
    assert net.fates == [(1, "c", S + 5 * MS, "host_down", S, S)]


def test_three_media_in_a_row_take_two_relays():
    heard = []
    net = Net({"a": talker([(S, "far")]), "b": silent, "c": silent, "d": listener(heard)},
              ideal("1 ms"), on=["a", "b"],
              further={"bridge": (ideal("2 ms"), (), ["b", "c"]),
                       "wifi": (ideal("4 ms"), (), ["c", "d"])},
              routes=lambda graph, media: [
                  graph.routes.forward("b", [media["lan"], media["bridge"]]),
                  graph.routes.forward("c", [media["bridge"], media["wifi"]])])
    net.run(2 * S)
    assert [row[2] for row in net.rows("forwarded")] == ["b", "c"]
    assert [time_ns for time_ns, *_ in heard] == [S + 7 * MS]


def test_a_failover_to_a_relay():
    """a's cable fails: what it sends to c, which is on lan alone, comes through b; and c's answers
    too, when c has heard of it through b."""
    heard = []
    net = Net({"a": {"mouth": talker([(2 * S, "x")]), "ear": listener(heard, "/back")}, "b": silent,
               "c": {"mouth": talker([(2 * S, "y")], topic="/back"), "ear": listener(heard)}},
              ideal("1 ms"), [Outage(Outage.Params(**UNPLUGGED))],
              further={"wifi": (ideal("5 ms"), (), ["a", "b"])},
              routes=lambda graph, media: (
                  failing_over()(graph, media),
                  graph.routes.forward("b", [media["lan"], media["wifi"]])))
    net.run(2900 * MS)
    assert sorted(heard) == [(2006 * MS, "a", "c", "y"), (2006 * MS, "c", "a", "x")]


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from(["stream", "datagram"]),
       st.integers(1, 20_000))
def test_each_message_has_one_fate_over_lossy_legs(seed, transport, size_bytes):
    """Trains of up to 14 packets, of which each leg loses a fifth of those that it gets."""
    net, heard = relayed([(k * S, str(k)) for k in range(1, 6)], link(rate="10 Mb/s"),
                         link(rate="5 Mb/s"), [Loss(Loss.Params(probability="20 %"))],
                         rules=[Loss(Loss.Params(probability="20 %"))], seed=seed,
                         how={"transport": transport, "size_bytes": size_bytes, "queue": 0})
    net.run(1000 * S)
    assert sorted(number for number, *_ in net.fates) == list(range(1, 6))
    if transport == "stream":
        assert [text for *_, text in heard] == ["1", "2", "3", "4", "5"]
    for medium in net.media.values():
        assert medium.intended == medium.delivered + sum(medium.dropped.values())
        assert medium.packets_intended == medium.packets_delivered + sum(
            medium.packets_dropped.values())
    # Nothing goes over the second leg that the first has lost.
    assert net.media["lan"].packets_intended == net.media["wifi"].packets_delivered


def test_the_ledger_has_the_parts_of_both_legs():
    """One message of 174 B: its time on wifi and on lan, and nothing else; a loss on lan is b's."""
    ledger = MessageLedger(Passages())
    net, _ = relayed([(S, "hello")], link(rate="10 Mb/s"), link(rate="1 Mb/s"), ledger=ledger)
    net.run(2 * S)
    names = [medium.name for medium in ledger.passages.media]
    stamps = [np.frombuffer(raw, STAMP)[0] for raw in ledger.stamps]
    assert [(names[one["medium"]], one["host"], one["time_ns"]) for one in stamps] == [
        ("wifi", 0, 1_392_000), ("lan", 1, 139_200)]

    ledger = MessageLedger(Passages())
    net, _ = relayed([(S, "hello")], rules=[Loss(Loss.Params(probability="100 %"))],
                     how={"transport": "datagram"}, ledger=ledger)
    net.run(2 * S)
    (row,) = ledger.rows
    *_, medium, host = np.frombuffer(row, ROW)[0].tolist()
    assert (names[medium], net.graph.hosts[host].name) == ("lan", "b")


# ------------------------------------------------------------------------------------ topics


@pytest.mark.parametrize("pattern, matching, other", [
    ("scan", ["/robot_0/scan"], ["/scan", "/robot_0/low/scan", "/base_1/scan", "/robot_0/scans"]),
    ("*/scan", ["/robot_0/low/scan"], ["/robot_0/scan"]),
    ("/map_exchange/*", ["/map_exchange/robot_0", "/map_exchange/robot_0/pose"],
     ["/map_exchange", "/robot_0/map_exchange/x"]),
    ("/*/scan", ["/robot_0/scan", "/robot_0/low/scan", "/base_1/scan"], ["/scan"]),
    ("*", ["/robot_0/scan", "/robot_0/a/b"], ["/tf", "/map_exchange/robot_0"]),
    ("/*", ["/robot_0/scan", "/tf"], []),
    ("strategy/bi?", ["/robot_0/strategy/bid"], ["/robot_0/strategy/bids"]),
])
def test_patterns(pattern, matching, other):
    hosts = ["base", "robot_0"]
    assert all(is_topic(topic, pattern, hosts) for topic in matching)
    assert not any(is_topic(topic, pattern, hosts) for topic in other)


@pytest.mark.parametrize("transport", ["stream", "datagram"])
def test_a_topic_takes_its_medium_and_no_other(transport):
    """On lan (1 ms) unless told otherwise; /far has wifi alone, which c is not on."""
    heard = []
    says = {"mouth": talker([(S, "x")], transport=transport),
            "mouth 2": talker([(S, "y")], topic="/far", transport=transport)}
    net = Net({"a": says, **{host: {"ear": listener(heard), "ear 2": listener(heard, "/far")}
                             for host in ("b", "c")}}, ideal("1 ms"),
              further={"wifi": (ideal("5 ms"), (), ["a", "b"])},
              routes=lambda graph, media: (graph.routes.choose("/f*", [media["wifi"]]),
                                           graph.routes.choose("/far", [media["lan"]]),
                                           graph.routes.choose("/nothing", [media["lan"]])))
    net.run(2 * S)
    assert heard == [(S + MS, "b", "a", "x"), (S + MS, "c", "a", "x"), (S + 5 * MS, "b", "a", "y")]
    assert [fate for fate in net.fates if fate[3] != "delivered"] == [
        (2, "c", S, "no_route", -1, -1)]
    # The first that matches counts: the second one of /far has never matched.
    assert net.graph.routes.unmatched() == ["/far", "/nothing"]


def test_preference_is_the_order_of_a_topics_media():
    """wifi first, though lan is the first of all; c, which is not on wifi, gets it by lan."""
    heard = []
    net = Net({"a": talker([(S, "x")]), "b": listener(heard), "c": listener(heard)}, ideal("1 ms"),
              further={"wifi": (ideal("5 ms"), (), ["a", "b"])},
              routes=lambda graph, media: graph.routes.choose("/talk", [media["wifi"],
                                                                        media["lan"]]))
    net.run(2 * S)
    assert heard == [(S + MS, "c", "a", "x"), (S + 5 * MS, "b", "a", "x")]

"""ROS 1 with one master: whole logs of how it starts and of what a broken network does to it."""

import pytest
from graphs import MS, Net, S, listener, silent, talker
from rosnets import apart, beliefs, control, master, seen, stop

from desim.errors import InputError
from desim.middleware.ros.master import Master, Registry, Uri
from desim.middleware.ros.ros1 import Ros1
from desim.middleware.ros.sizes import CALLS
from netmodels.ideal import Ideal
from netmodels.rules.outage import Outage


def net(nodes, rules=(), **params):
    params.setdefault("master", "m")
    params.setdefault("poll", "0 s")
    return Net(nodes, Ideal(Ideal.Params(delay="10 ms")), rules, middleware=Ros1(
        Ros1.Params(**params)))


def process(net, host):
    return net.graph.middleware.processes.on(net.graph.host(host).index)


# ------------------------------------------------------------------------------------ cold start

COLD = [
    (0, "a", "m", "registerPublisher", 78), (0, "b", "m", "registerSubscriber", 78),
    (10, "m", "b", "registerSubscriber", 78), (10, "m", "a", "registerPublisher", 78),
    (20, "b", "m", "registerSubscriber", 70), (20, "b", "m", "registerSubscriber", 494),
    (20, "a", "m", "registerPublisher", 70), (20, "a", "m", "registerPublisher", 492),
    (30, "m", "b", "registerSubscriber", 477), (30, "m", "b", "publisherUpdate", 78),
    (30, "m", "a", "registerPublisher", 570),
    (40, "b", "m", "publisherUpdate", 78),
    (50, "m", "b", "publisherUpdate", 70), (50, "m", "b", "publisherUpdate", 585),
    (60, "b", "a", "requestTopic", 78), (60, "b", "m", "publisherUpdate", 359),
    (70, "a", "b", "requestTopic", 78),
    (80, "b", "a", "requestTopic", 70), (80, "b", "a", "requestTopic", 504),
    (90, "a", "b", "requestTopic", 453),
    (100, "b", "a", "requestTopic", 71), (100, "b", "a", "tcpros", 78),
    (110, "a", "b", "requestTopic", 71), (110, "a", "b", "tcpros", 78),
    (120, "b", "a", "tcpros", 70), (120, "b", "a", "tcpros_header", 219),
    (130, "a", "b", "tcpros_header", 2250 + 2 * 70),
]


def test_the_whole_log_of_a_cold_start():
    """Register (two round trips: TCP, call), be told (two), requestTopic (two), TCPROS (two)."""
    cold = net({"a": talker([]), "b": listener([]), "m": silent}).run(S)
    rows = [(round(row[0] * 1000), *row[1:]) for row in control(cold) if row[3] != "ack"]
    assert sorted(rows, key=lambda row: row[0]) == COLD
    assert beliefs(cold) == [(0.06, "b", "a", "/talk", 1)]
    assert seen(cold) == [(0.14, "a", "online")]


def test_sizes_matter(monkeypatch):
    """The twin: a call of 5 % more bytes."""
    sizes = CALLS["registerSubscriber"]
    monkeypatch.setitem(CALLS, "registerSubscriber",
                        sizes._replace(call=round(sizes.call * 1.05)))
    with pytest.raises(AssertionError):
        test_the_whole_log_of_a_cold_start()


def test_a_call_grows_with_the_addresses_in_it():
    """Four publishers: the last subscriber's answer has four addresses, and it is told nothing."""
    crowd = net({**{name: talker([]) for name in "abcd"}, "m": silent, "x": silent})
    stop(crowd, "x", 1, 2, listener([]))
    crowd.run(3 * S)
    answers = [row for row in control(crowd, "registerSubscriber") if row[1] == "m"]
    assert answers[-1][-1] == 407 + 4 * 58 + 70
    assert control(crowd, "publisherUpdate") == []


def says(*at_s, start=0):
    return [(round(at * S), str(at)) for at in at_s if at >= start]


# --------------------------------------------------------------------------------- the lost master


def test_links_outlive_a_lost_master_and_new_ones_cannot_form():
    """The master stops at 2 s; b goes on hearing a, and d, which starts at 3 s, hears nobody."""
    old, new = [], []
    lost = net({"a": talker(says(1, 5, 50)), "b": listener(old), "d": silent, "m": silent})
    stop(lost, "m", 2)
    stop(lost, "d", 2.5, 3, listener(new))
    lost.run(100 * S)
    assert [text for *_, text in old] == ["1", "5", "50"]
    assert new == []
    context = lost.graph.context
    assert (context.beliefs.matches, context.beliefs.missing, context.beliefs.ghosts) == (2, 1, 0)


def test_a_master_that_comes_late_is_found_by_the_next_syn():
    """It starts at 10 s. SYNs went at 0, 1, 3, 7 and 15 s: the last one is answered."""
    heard = []
    late = net({"a": talker(says(14, 17), latch=True), "b": listener(heard), "m": silent})
    late.graph.host("m").stop()
    late.at(10 * S, late.graph.host("m").start)
    late.run(20 * S)
    assert [row[0] for row in control(late, "registerPublisher") if row[-1] == 78
            and row[1] == "a"] == [0, 1, 3, 7, 15]
    assert [(time_ns / S, text) for time_ns, _, _, text in heard] == [(15.16, "14"), (17.01, "17")]


@pytest.mark.parametrize(("client", "again_s"), [("roscpp", 127.05), ("rospy", 127.2)])
def test_an_unreachable_master_is_called_again_when_tcp_has_given_up(client, again_s):
    """1 + 2 + 4 + ... + 64 s, then the library's own pause: no more than seven SYNs in two
    minutes."""
    def check(**params):
        cut = net({"a": talker([]), "m": silent}, [apart("m")], client=client, **params)
        cut.run(200 * S)
        syns = [row[0] for row in control(cut, "registerPublisher")]
        assert syns == [0, 1, 3, 7, 15, 31, 63, *(again_s + after for after in (0, 1, 3, 7, 15, 31,
                                                                               63))]
    check()
    with pytest.raises(AssertionError):
        check(tcp={"first_rto": "1.05 s"})


def test_a_restarted_master_knows_nobody_and_nobody_tells_it():
    """It is back at 3 s. d subscribes at 4 s and never hears of a, which is there; e advertises at
    5 s and d hears it."""
    heard, old = [], []
    again = net({"a": talker(says(1, 10, 20)), "b": listener(old), "d": silent, "e": silent,
                 "m": silent})
    stop(again, "m", 2, 3)
    stop(again, "d", 2.5, 4, listener(heard))
    stop(again, "e", 2.5, 5, talker(says(10, 20)))
    again.run(30 * S)
    assert [text for *_, text in old] == ["1", "10", "20"]
    assert [(host, text) for _, _, host, text in heard] == [("e", "10"), ("e", "20")]
    registry = master(again, "m")
    assert [sorted(registry.publishers["/talk"]), sorted(registry.subscribers["/talk"])] == [
        [3], [2]]
    # b and d each miss a publisher.
    assert again.graph.context.beliefs.missing == 2


# -------------------------------------------------------------------------------------- the dead


def test_the_dead_stay_registered():
    """a dies at 2 s. At 5 s d subscribes and is told of it; it calls and is never answered."""
    ghost = net({"a": talker(says(1)), "b": listener([]), "d": silent, "m": silent})
    stop(ghost, "a", 2)
    stop(ghost, "d", 2.5, 5, listener([]))
    ghost.run(1000 * S)
    assert beliefs(ghost) == [(0.06, "b", "a", "/talk", 1), (5.04, "d", "a", "/talk", 1)]
    assert ghost.graph.context.beliefs.ghosts == 2
    assert ghost.graph.context.beliefs.divergence == 1
    assert list(master(ghost, "m").publishers["/talk"]) == [0]
    # d sends its SYN seven times and gives up, as roscpp does; nobody lists a again.
    assert [row[0] for row in control(ghost, "requestTopic") if row[1] == "d"] == [
        5.04 + after for after in (0, 1, 3, 7, 15, 31, 63)]


def test_an_idle_link_to_the_dead_is_noticed_by_keepalive():
    """a falls silent at 2 s: 60 s idle, then nine probes 10 s apart, and one more interval: after
    150 s. The last that b had of a was at 130 ms."""
    def check(**params):
        dead = net({"a": talker([]), "b": listener([]), "m": silent}, **params)
        stop(dead, "a", 2)
        dead.run(300 * S)
        assert seen(dead) == [(0.14, "a", "online"), (150.14, "a", "offline")]
    check()
    with pytest.raises(AssertionError):
        check(tcp={"keepalive_interval": "9.5 s"})


def test_a_restarted_node_takes_its_name_from_the_dead_one():
    """a comes back at 5 s with an empty memory and a new address. The master drops what the old
    one registered, tells b, and b leaves the old link for a new one; what a says is latched."""
    heard = []
    back = net({"a": talker(says(1, 4, 6), latch=True), "b": listener(heard), "m": silent})
    stop(back, "a", 3, 5)
    back.run(10 * S)
    assert [text for *_, text in heard] == ["1", "6"]
    assert list(process(back, "b").subscriptions["/talk"].links) == [Uri(0, 2)]
    assert [row[1:3] for row in control(back, "shutdown")][:2] == [("m", "a"), ("a", "m")]
    assert beliefs(back) == [(0.06, "b", "a", "/talk", 1)]
    assert seen(back) == [(0.14, "a", "online"), (5.04, "a", "offline"),
                          (5.12, "a", "online")]


def reconnects(**params):
    """Seconds between b's attempts to reach the old address of a, which has restarted unknown to
    the master."""
    lost = net({"a": talker([]), "b": listener([]), "m": silent}, **params)
    stop(lost, "m", 1)
    stop(lost, "a", 2, 3)
    lost.run(250 * S)
    times = [row[0] for row in control(lost, "tcpros") if row[1] == "b" and row[-1] == 78][1:]
    return [after - before - 0.02 for before, after in zip(times, times[1:],
                                                                  strict=False)]


def test_roscpp_reconnects_after_times_that_double():
    """Each attempt is refused after a round trip of 20 ms; then 0.2, 0.4, ... 20 s pass."""
    expected = pytest.approx([0.2, 0.4, 0.8, 1.6, 3.2, 6.4, 12.8, 20, 20, 20, 20, 20, 20, 20],
                             rel=1e-6)
    assert reconnects()[:14] == expected
    assert reconnects(reconnect_first="105 ms")[:14] != expected
    assert reconnects(reconnect_most="19 s")[:14] != expected


def test_rospy_leaves_a_refused_link():
    assert reconnects(client="rospy") == []


def test_the_first_reconnect_is_after_a_tenth_of_a_second():
    """b notices at its first keepalive probe, 60 s after it last heard of a, and a round trip."""
    lost = net({"a": talker([]), "b": listener([]), "m": silent})
    stop(lost, "m", 1)
    stop(lost, "a", 2, 3)
    lost.run(61 * S)
    syns = [row[0] for row in control(lost, "tcpros") if row[1] == "b" and row[-1] == 78]
    assert syns[1] == pytest.approx(60.14 + 0.02 + 0.1)


# ------------------------------------------------------------------------------ publisherUpdate


def told_s(unreachable, **params):
    """When b hears of a publisher that comes at 10 s, with so many subscribers cut off from the
    master."""
    names = [f"x{i}" for i in range(unreachable)]
    crowd = net({**{name: listener([]) for name in names}, "b": silent, "m": silent, "p": silent},
                [apart(*names, start="5 s")], **params)
    stop(crowd, "b", 1, 2, listener([]))  # it subscribes last
    stop(crowd, "p", 1, 10, talker([]))
    crowd.run(600 * S)
    return [row[0] for row in beliefs(crowd) if row[1] == "b"]


def test_three_unreachable_subscribers_block_all_updates():
    """Each worker waits 127 s for a connection; with two of them cut off, the third one works."""
    assert told_s(2) == [pytest.approx(10.06)]
    assert told_s(3) == [pytest.approx(10.03 + 127 + 0.03)]
    assert told_s(3, workers=4) == [pytest.approx(10.06)]
    assert told_s(3, tcp={"first_rto": "1.1 s"}) != [pytest.approx(10.03 + 127 + 0.03)]


def test_updates_are_one_at_a_time_for_each_node():
    """The second task for a node waits, while those for others overtake it."""
    calls, done = [], []
    told = Master(3, lambda task, over: (calls.append((task.topic, task.uri.host)),
                                         done.append(over)))
    for topic in ("/one", "/two"):
        for host in (1, 2):
            told.register_subscriber(topic, Uri(host, 1))
    told.register_publisher("/one", Uri(0, 1))
    told.register_publisher("/two", Uri(0, 1))
    assert calls == [("/one", 1), ("/one", 2)]
    done[1]()
    assert calls[2:] == [("/two", 2)]
    done[0]()
    assert calls[3:] == [("/two", 1)]


def test_a_new_address_bumps_the_old_one():
    registry = Registry()
    assert registry.register(registry.publishers, "/map", Uri(1, 1)) is None
    assert registry.register(registry.subscribers, "/pose", Uri(1, 1)) is None
    assert registry.register(registry.publishers, "/map", Uri(1, 2)) == Uri(1, 1)
    assert registry.of(registry.publishers, "/map") == (Uri(1, 2),)
    assert registry.of(registry.subscribers, "/pose") == ()
    assert not registry.unregister(registry.publishers, "/map", Uri(1, 1))
    assert registry.unregister(registry.publishers, "/map", Uri(1, 2))


# ------------------------------------------------------------------------------------ requestTopic


def asked_s(client, rule, until_s):
    """When b, which is told of a at 10 s while it cannot reach it, asks it."""
    cut = net({"a": silent, "b": listener([]), "m": silent}, [rule], client=client)
    stop(cut, "a", 1, 10, talker([]))
    cut.run(until_s * S)
    return [row[0] for row in control(cut, "requestTopic") if row[1] == "b"]


def test_roscpp_asks_once_and_rospy_again():
    """The SYNs end after 127 s; rospy calls anew 1, 2, 4, ... s later."""
    rule = Outage(Outage.Params(links=[["a", "b"]]))
    first = [10.06 + after for after in (0, 1, 3, 7, 15, 31, 63)]
    assert asked_s("roscpp", rule, 400) == pytest.approx(first)
    assert asked_s("rospy", rule, 140)[:8] == pytest.approx([*first, 10.06 + 128])


# ------------------------------------------------------------------------------------ messages


@pytest.mark.parametrize(("tcp_nodelay", "heard_ms"), [(False, 5140), (True, 5120)])
def test_a_late_subscriber_gets_what_is_latched(tcp_nodelay, heard_ms):
    """Six round trips, 120 ms, and one more where Nagle's algorithm lets the message wait until
    the publisher's header is acknowledged."""
    heard = []
    late = net({"a": talker(says(1), latch=True), "d": silent, "m": silent},
               tcp_nodelay=tcp_nodelay)
    stop(late, "d", 2, 5, listener(heard))
    late.run(10 * S)
    assert heard == [(heard_ms * MS, "d", "a", "1")]


def test_an_outage_fills_the_outbox_and_the_socket_and_the_newest_get_through():
    """Cut off from 1.5 s to 3.5 s, ten messages a second: the socket takes what its buffer holds,
    then the outbox keeps the newest two. TCP's timeout comes round after the network does."""
    heard, times = [], [1 + i / 10 for i in range(40)]
    full = net({"a": talker(says(*times), size_bytes=4000, queue=2), "b": listener(heard, queue=0),
                "m": silent}, [apart("b", start="1.5 s", until="3.5 s")]).run(20 * S)
    counts = full.counts("/talk")
    assert list(counts.dropped) == ["outbox_full"]
    assert counts.delivered + counts.dropped["outbox_full"] == 40
    assert len(heard) == counts.delivered
    assert [text for *_, text in heard] == sorted((text for *_, text in heard), key=float)
    assert heard[-1][3] == "4.9"


def test_what_waits_for_a_dead_subscriber_is_dropped_when_it_is_noticed():
    """b restarts at 3 s. What a had sent meanwhile is refused by a reset, dropped as link_closed;
    what it says after the new link goes there."""
    heard = []
    dead = net({"a": talker(says(1, 2.5, 2.6, 6)), "b": listener(heard), "m": silent})
    stop(dead, "b", 2, 3)
    dead.run(10 * S)
    assert [text for *_, text in heard] == ["1", "6"]
    assert [fate[3] for fate in sorted(dead.fates)] == ["delivered", "link_closed", "link_closed",
                                                        "delivered"]


def test_udpros_sends_without_asking_again():
    """No connection: b asks once, a sends. When b dies a goes on, and each message is lost."""
    heard = []
    udp = net({"a": talker(says(1, 3, 6), transport="datagram"), "b": listener(heard),
               "m": silent})
    stop(udp, "b", 2, 5)
    udp.run(10 * S)
    assert [text for *_, text in heard] == ["1", "6"]
    assert udp.counts("/talk").dropped == {"host_down": 1}
    assert control(udp, "tcpros") == []


def test_nodes_of_one_host_need_no_master():
    heard = []
    net({"a": {"mouth": talker(says(1)), "ear": listener(heard)}, "m": silent},
        [apart("m")]).run(2 * S)
    assert heard == [(S, "a", "a", "1")]


def test_what_ros1_does_not_have():
    with pytest.raises(InputError, match="no broadcast; allowed: via unicast"):
        net({"a": talker([], via="broadcast"), "m": silent})
    with pytest.raises(InputError, match=r"master: no host 'n'.*allowed: a, m"):
        net({"a": silent, "m": silent}, master="n")


@pytest.mark.parametrize(("hosts", "master_"), [
    (("base", "robot_0", "workstation"), "workstation"), (("base", "a"), "base"),
    (("robot_10", "robot_2"), "robot_2")])
def test_where_the_master_is(hosts, master_):
    usual = net(dict.fromkeys(hosts, silent), master=None).run(0)
    assert list(usual.graph.middleware.processes.masters) == [usual.graph.host(master_).index]

"""ROS 1 with one master: whole logs of how it starts and of what a broken network does to it."""

import pytest
from graphs import MS, S, listener, silent, talker
from rosnets import apart, beliefs, control, master, says, seen, stop
from rosnets import one_master as net
from tcphosts import Losing

from desim.middleware.ros.master import Master, Registry, Uri
from desim.middleware.ros.sizes import CALLS
from netmodels.rules.outage import Outage


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


# --------------------------------------------------------------------------------- the lost master


def test_links_outlive_a_lost_master_and_new_ones_cannot_form():
    """The master stops at 2 s; b goes on hearing a, and d, which starts at 3 s, hears nobody."""
    def check(lost_s):
        old, new = [], []
        lost = net({"a": talker(says(1, 5, 50)), "b": listener(old), "d": silent, "m": silent})
        stop(lost, "m", lost_s)
        stop(lost, "d", 2.5, 3, listener(new))
        lost.run(100 * S)
        assert [text for *_, text in old] == ["1", "5", "50"]
        assert new == []
        beliefs = lost.graph.context.beliefs
        assert (beliefs.matches, beliefs.missing, beliefs.ghosts) == (2, 1, 0)
    check(2)
    check(3.015)  # the registration is on its way
    with pytest.raises(AssertionError):
        check(3.05)


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


def test_rospy_reconnects_after_thirty_seconds_of_patience_and_times_that_double():
    """Cut off, b finds its link dead by keepalive; each attempt then meets silence."""
    def gaps(**params):
        cut = net({"a": talker([]), "b": listener([]), "m": silent}, [apart("a", start="1 s")],
                  client="rospy", **params).run(600 * S)
        assert seen(cut) == [(0.14, "a", "online"), (150.14, "a", "offline")]
        calls = [row[0] for row in control(cut, "tcpros") if row[1] == "b" and row[-1] == 78
                 and row[0] > 1]
        # Of each attempt's SYNs (0, 1, 3, 7, 15 s) the first.
        starts = [after for before, after in zip([0, *calls], calls, strict=False)
                  if after - before > 16]
        return [after - before for before, after in zip(starts, starts[1:], strict=False)]
    expected = pytest.approx([30 + wait for wait in (2, 4, 8, 16, 32, 32, 32)])
    assert gaps()[:7] == expected
    assert gaps(connect_timeout="28.5 s")[:7] != expected
    assert gaps(reconnect_most="30 s")[:7] != expected


def test_the_first_reconnect_is_after_a_tenth_of_a_second():
    """b notices at its first keepalive probe, 60 s after it last heard of a, and a round trip."""
    lost = net({"a": talker([]), "b": listener([]), "m": silent})
    stop(lost, "m", 1)
    stop(lost, "a", 2, 3)
    lost.run(61 * S)
    syns = [row[0] for row in control(lost, "tcpros") if row[1] == "b" and row[-1] == 78]
    assert syns[1] == pytest.approx(60.14 + 0.02 + 0.1)


def test_a_header_that_comes_late_does_not_take_the_link_from_a_younger_connection():
    """b's first header (0.12 s) is lost. The master takes a back and lists it anew, so that b hangs
    up and calls again; the first header, sent once more at 0.32 s, comes behind the second one,
    and the FIN right after it."""
    heard = []
    late = net({"a": talker(says(0.3, 0.35, 0.4, 0.5)), "b": listener(heard), "m": silent},
               [Losing(4, source=1, least_bytes=219)])
    lists, a = late.graph.middleware.processes.masters[2], process(late, "a").uri
    late.at(150 * MS, lambda: lists.unregister_publisher("/talk", a))
    late.at(160 * MS, lambda: lists.register_publisher("/talk", a))
    late.run(2 * S)
    assert [row[:3] for row in control(late, "tcpros_header")] == [
        (0.12, "b", "a"), (0.24, "b", "a"), (0.25, "a", "b"), (0.32, "b", "a"), (0.33, "a", "b")]
    assert [(time_ns // MS, text) for time_ns, *_, text in heard] == [
        (310, "0.3"), (370, "0.35"), (430, "0.4"), (510, "0.5")]


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


def test_an_answer_is_noticed_at_the_next_poll():
    """By each process at a time of its own: in the mean half a period later."""
    def delays_s(**params):
        names = [f"b{i}" for i in range(40)]
        polled = net({"a": talker([]), **{name: listener([]) for name in names}, "m": silent},
                     **params).run(2 * S)
        return [seen(polled, name)[0][0] - beliefs_of(polled, name) - 0.08 for name in names]
    late = delays_s(poll="100 ms")
    assert 0 <= min(late) < 0.02 and 0.08 < max(late) < 0.1
    assert sum(late) / len(late) == pytest.approx(0.05, abs=0.02)
    assert max(delays_s(poll="200 ms")) > 0.11
    assert delays_s() == pytest.approx([0] * 40)


def beliefs_of(net, host):
    return next(row[0] for row in beliefs(net) if row[1] == host)

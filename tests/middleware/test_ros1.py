"""ROS 1 with one master: whole logs of how it starts, tells of changes and is asked."""

from itertools import pairwise

import pytest
from graphs import S, listener, silent, talker
from ros_networks import GIVEN_UP_S, SYNS_S, apart, beliefs, control, seen, stop
from ros_networks import one_master as net

from desim.middleware.ros1.master import IdleThreads, Master, MasterRegistry, MasterThreads, Uri
from desim.middleware.ros1.sizes import CALLS
from desim.middleware.ros1.xmlrpc import XmlrpcThread
from netmodels.rules.outage import Outage

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


def test_the_whole_log_of_a_poll():
    """a and b ask for all topics once a second: 306 B there; back, 385 B and 160 B for each of two
    topics of two processes; on the connection of their registrations."""
    rows = control(net({"a": talker([]), "b": talker([]), "m": silent}, polling="1 s",
                       polled_topics=2).run(4 * S), "getPublishedTopics")
    first_s = {host: next(row[0] for row in rows if row[1] == host) for host in "ab"}
    assert all(0.0 <= time_s < 1.0 for time_s in first_s.values())
    expected = [(first_s[host] + k + late_s, *ends, "getPublishedTopics", size_bytes + 70)
                for k in range(4) for host in "ab" for late_s, ends, size_bytes in (
                    (0.0, (host, "m"), 306), (0.01, ("m", host), 385 + 2 * 2 * 160))]
    assert sorted(rows) == [(pytest.approx(time_s), *rest) for time_s, *rest in sorted(expected)]


def test_a_poll_waits_for_the_answer_to_the_one_before():
    """The master is cut off from 1.0 to 1.3 s: the question that falls into it comes 0.2 s and a
    round trip late, or 0.6 s, and the next one when it is answered."""
    cut = Outage(Outage.Params(hosts=["m"], **{"from": "1 s", "until": "1.3 s"}))
    rows = control(net({"a": talker([]), "m": silent}, [cut], polling="100 ms",
                       polled_topics=0).run(3 * S), "getPublishedTopics")
    answered = [row[0] for row in rows if row[1:3] == ("m", "a")]
    at_once_s, *gaps_s, late_s = sorted(after - before for before, after in pairwise(answered))
    assert at_once_s == pytest.approx(0.02)  # a round trip
    assert gaps_s == pytest.approx([0.1] * len(gaps_s))
    assert 0.3 < late_s < 0.8


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


# ------------------------------------------------------------------------------ publisherUpdate


def updates(unreachable, **params):
    """A publisher comes at 10 s, with so many subscribers cut off from the master and b, which
    subscribed last: all frames of publisherUpdate, and what is believed."""
    names = [f"x{i}" for i in range(unreachable)]
    crowd = net({**{name: listener([]) for name in names}, "b": silent, "m": silent, "p": silent},
                [apart(*names, start="5 s")], **params)
    stop(crowd, "b", 1, 2, listener([]))
    stop(crowd, "p", 1, 10, talker([]))
    crowd.run(600 * S)
    return (sorted((round(row[0], 3), *row[1:]) for row in control(crowd, "publisherUpdate")),
            beliefs(crowd))


def expected(unreachable, at_s):
    """``updates`` where b is called at this time."""
    syns = [(10.03 + after, "m", f"x{i}", "publisherUpdate", 78) for i in range(unreachable)
            for after in SYNS_S]
    call = [(0, "m", "b", 78), (0.01, "b", "m", 78), (0.02, "m", "b", 70), (0.02, "m", "b", 585),
            (0.03, "b", "m", 359), (30.04, "m", "b", 71), (30.05, "b", "m", 71)]
    return (sorted((round(row[0], 3), *row[1:]) for row in [
        *syns, *((at_s + after, *ends, "publisherUpdate", size) for after, *ends, size in call)]),
        [(pytest.approx(at_s + 0.03), "b", "p", "/talk", 1)])


def test_three_unreachable_subscribers_block_all_updates():
    """Each worker waits 131 s for a connection; with two of them cut off, the third one works."""
    blocked = expected(3, 10.03 + GIVEN_UP_S)
    assert updates(2) == expected(2, 10.03)
    assert updates(3) == blocked
    assert updates(3, workers=4) == expected(3, 10.03)
    assert updates(3, tcp={"first_rto": "1.1 s"}) != blocked


def test_updates_are_not_blocked_where_no_worker_waits(monkeypatch):
    """A twin: each call is made at once."""
    monkeypatch.setattr(MasterThreads, "add",
                        lambda threads, task: threads._call(task, lambda: None))
    assert updates(3) == expected(3, 10.03)


def test_updates_are_one_at_a_time_for_each_node():
    """The second task for a node waits, while those for others overtake it."""
    calls, done = [], []
    rosmaster = Master(IdleThreads(0, [0, 0, 0], int, None), lambda task, over: (
        calls.append((task.topic, task.uri.host)), done.append(over)))
    for topic in ("/one", "/two"):
        for host in (1, 2):
            rosmaster.register_subscriber(topic, Uri(host, 1))
    rosmaster.register_publisher("/one", Uri(0, 1))
    rosmaster.register_publisher("/two", Uri(0, 1))
    assert calls == [("/one", 1), ("/one", 2)]
    done[1]()
    assert calls[2:] == [("/two", 2)]
    done[0]()
    assert calls[3:] == [("/two", 1)]


def test_a_new_address_bumps_the_old_one():
    registry = MasterRegistry()
    assert registry.register(registry.publishers, "/map", Uri(1, 1)) is None
    assert registry.register(registry.subscribers, "/pose", Uri(1, 1)) is None
    assert registry.register(registry.publishers, "/map", Uri(1, 2)) == Uri(1, 1)
    assert registry.of(registry.publishers, "/map") == (Uri(1, 2),)
    assert registry.of(registry.subscribers, "/pose") == ()
    assert not registry.unregister(registry.publishers, "/map", Uri(1, 1))
    assert registry.unregister(registry.publishers, "/map", Uri(1, 2))


def test_a_node_keeps_its_name_until_its_last_registration():
    registry, node = MasterRegistry(), Uri(1, 1)
    registry.register(registry.publishers, "/map", node)
    registry.register(registry.subscribers, "/pose", node)
    registry.unregister(registry.publishers, "/map", node)
    assert registry.nodes == {1: node}
    registry.unregister(registry.subscribers, "/pose", node)
    assert registry.nodes == {}


# ------------------------------------------------------------------------------------ requestTopic


def asked_s(client, rule, until_s):
    """The times at which b asks a, of which it learns at 10 s while it cannot reach it."""
    cut = net({"a": silent, "b": listener([]), "m": silent}, [rule], client=client)
    stop(cut, "a", 1, 10, talker([]))
    cut.run(until_s * S)
    return [row[0] for row in control(cut, "requestTopic") if row[1] == "b"]


def test_roscpp_asks_once_and_rospy_again():
    """The SYNs end after 131 s; rospy has 60 s of patience, and calls anew 1, 2, 4, ... s later."""
    rule = Outage(Outage.Params(links=[["a", "b"]]))
    first = [10.06 + after for after in SYNS_S]
    assert asked_s("roscpp", rule, 400) == pytest.approx(first)
    within = [at for at in first if at < 70]
    assert asked_s("rospy", rule, 190) == pytest.approx([
        at + later for later in (0, 61, 61 + 62) for at in within if at + later < 190])


def test_a_round_of_roscpp_ends_a_period_after_its_last_event():
    """Rounds of 100 from 0 on. An event at 30 has the first one go on until 130, one at 110, behind
    its period, ends it; then it is quiet; and one at the end of a round is in the next one."""
    thread = XmlrpcThread(100, 0)
    assert [thread.round_end_ns(now) for now in (0, 60, 100, 101)] == [100, 100, 100, 200]
    thread.event(30)
    assert thread.round_end_ns(31) == 130
    thread.event(110)
    assert thread.round_end_ns(110) == 110 and thread.round_end_ns(111) == 210
    thread.event(410)
    assert thread.round_end_ns(411) == 510


def test_a_link_takes_two_rounds_of_the_subscriber():
    """From the update that tells it to the connection: the rest of a round, then one in which it is
    answered."""
    def connects_s(**params):
        run = net({"a": talker([]), "b": listener([]), "m": silent}, **params).run(2 * S)
        asked, linked = (next(row[0] for row in control(run, kind) if row[1] == "b")
                         for kind in ("requestTopic", "tcpros"))
        return round(linked - asked, 3)
    assert 0.1 < connects_s(poll="100 ms") - connects_s() < 0.2
    assert connects_s(poll="120 ms") != connects_s(poll="100 ms")


def test_a_thread_of_the_master_looks_every_100_ms():
    """Three that fell asleep at 0, 20 and 50: work that comes at 130 waits until 150, and more that
    comes then until 200."""
    calls, agenda, now = [], [], 130
    threads = IdleThreads(100, [0, 20, 50], lambda: now, lambda time, fn: agenda.append((time, fn)))
    rosmaster = Master(threads, lambda task, over: calls.append((now, task.uri.host)))
    for host in (1, 2):
        rosmaster.register_subscriber("/one", Uri(host, 1))
    rosmaster.register_publisher("/one", Uri(0, 1))
    while agenda:
        now, fn = agenda.pop(0)
        fn()
    assert calls == [(150, 1), (200, 2)]


def test_rospy_ends_where_it_meets_no_master_and_roscpp_waits():
    """Until TCP gives up."""
    def heard(client, back_s):
        log = []
        run = net({"a": talker([(S, "one")], latch=True), "b": listener(log), "m": silent},
                  client=client)
        stop(run, "m", 0, back_s)
        run.run((back_s + 10) * S)
        return [text for *_, text in log], sorted(row[2] for row in run.rows("gave_up"))
    assert heard("roscpp", GIVEN_UP_S + 5) == (["one"], [])
    assert heard("rospy", GIVEN_UP_S + 5) == ([], ["a", "b"])
    assert heard("rospy", 5) == (["one"], [])


def beliefs_of(net, host):
    return next(row[0] for row in beliefs(net) if row[1] == host)

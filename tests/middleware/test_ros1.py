"""ROS 1 with one master: whole logs of how it starts, tells of changes and is asked."""

import pytest
from graphs import S, listener, silent, talker
from rosnets import GIVEN_UP_S, SYNS_S, apart, beliefs, control, seen, stop
from rosnets import one_master as net

from desim.middleware.ros.master import Master, Registry, Uri, Workers
from desim.middleware.ros.sizes import CALLS
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


def told(unreachable, at_s):
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
    blocked = told(3, 10.03 + GIVEN_UP_S)
    assert updates(2) == told(2, 10.03)
    assert updates(3) == blocked
    assert updates(3, workers=4) == told(3, 10.03)
    assert updates(3, tcp={"first_rto": "1.1 s"}) != blocked


def test_updates_are_not_blocked_where_no_worker_waits(monkeypatch):
    """A twin: each call is made at once."""
    monkeypatch.setattr(Workers, "add", lambda workers, task: workers._call(task, lambda: None))
    assert updates(3) == told(3, 10.03)


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
    """The SYNs end after 131 s; rospy calls anew 1, 2, 4, ... s later."""
    rule = Outage(Outage.Params(links=[["a", "b"]]))
    first = [10.06 + after for after in SYNS_S]
    assert asked_s("roscpp", rule, 400) == pytest.approx(first)
    assert asked_s("rospy", rule, 143) == pytest.approx([
        *first, 10.06 + GIVEN_UP_S + 1])


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

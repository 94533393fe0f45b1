"""ROS 1 with one master: the loss of a master, a node or a link.

What outlives it, and for how long?
"""

import pytest
from graphs import MS, S, listener, silent, talker
from ros_networks import SYNS_S, apart, beliefs, control, master, says, seen, stop
from ros_networks import one_master as net
from tcp_hosts import Losing

from desim.middleware.ros1.client import Process
from desim.middleware.ros1.master import Uri
from desim.middleware.ros1.processes import Processes


def process(net, host):
    return net.graph.middleware.processes.on(net.graph.host(host).index)


def when_one_stops(monkeypatch, do):
    """A model that hears of it by magic: ``do(processes, host)`` after each stop."""
    switched = Processes.switched

    def switch(processes, host, up):
        switched(processes, host, up)
        if not up:
            do(processes, host)

    monkeypatch.setattr(Processes, "switched", switch)


# --------------------------------------------------------------------------------- the lost master


def lost_master(lost_s=2):
    """The master stops; d subscribes at 3 s. Who heard what when, what was believed, matches,
    missing ones and ghosts in the end, and the control frames from then on."""
    old, new = [], []
    lost = net({"a": talker(says(1, 5, 50)), "b": listener(old), "d": silent, "m": silent})
    stop(lost, "m", lost_s)
    stop(lost, "d", 2.5, 3, listener(new))
    lost.run(100 * S)
    truth = lost.graph.context.beliefs
    return ([(time_ns / S, host, text) for time_ns, host, _, text in old + new], beliefs(lost),
            (truth.matches, truth.missing, truth.ghosts),
            sorted((round(row[0], 3), *row[1:]) for row in control(lost)
                   if row[0] >= 3 and row[3] != "ack"))


LOST = (
    [(1.01, "b", "1"), (5.01, "b", "5"), (50.01, "b", "50")],
    [(0.06, "b", "a", "/talk", 1)],
    (2, 1, 0),
    # The connections to the master are closed after 30 s without a call, and the FIN is sent again.
    sorted([*((3 + after, "d", "m", "registerSubscriber", 78) for after in SYNS_S),
            *((round(30.04 + after, 3), *fin)
              for after in (0, *(0.22 * 2**k for k in range(9))) for fin in (
                ("a", "m", "registerPublisher", 71), ("b", "m", "registerSubscriber", 71)))]))


def test_links_outlive_a_lost_master_and_new_ones_cannot_form():
    """It stops at 2 s; b goes on hearing a, and d hears nobody."""
    assert lost_master() == LOST
    assert lost_master(3.015)[:3] == LOST[:3]  # the registration is on its way
    heard, believed, counts, _ = lost_master(3.05)  # d has its answer
    assert counts == (2, 0, 0)
    assert believed == [*LOST[1], (3.04, "d", "a", "/talk", 1)]
    assert heard == [*LOST[0], (5.01, "d", "5"), (50.01, "d", "50")]


def test_links_end_where_processes_hang_up_with_the_master(monkeypatch):
    """A twin: a process that has lost the master drops its links."""
    def hang_up(processes, host):
        for other in (0, 1) if host == 3 else ():
            for subscription in processes.on(other).subscriptions.values():
                for link in subscription.links.values():
                    link.drop()

    when_one_stops(monkeypatch, hang_up)
    heard, *_ = lost_master()
    assert heard == LOST[0][:1]


def test_new_links_form_where_processes_need_no_master(monkeypatch):
    """A twin: they know each other without asking."""
    def call(process, _=None):
        topic, running = process._calls[0][1], map(process.processes.on, (0, 1))
        process._registered(True, tuple(one.uri for one in running if topic in one.publications))

    monkeypatch.setattr(Process, "_call", call)
    heard, believed, counts, frames = lost_master()
    assert heard == [*LOST[0], (5.01, "d", "5"), (50.01, "d", "50")]
    assert [row[1:] for row in believed] == [("b", "a", "/talk", 1), ("d", "a", "/talk", 1)]
    assert counts == (2, 0, 0)
    assert frames != LOST[3]


def test_a_master_that_comes_late_is_found_by_the_next_syn():
    """It starts at 10 s. SYNs went at 0, 1, 2, 3, 4, 5, 7 and 11 s: the last one is answered."""
    heard = []
    late = net({"a": talker(says(10.5, 13), latch=True), "b": listener(heard), "m": silent})
    late.graph.host("m").stop()
    late.at(10 * S, late.graph.host("m").start)
    late.run(20 * S)
    assert [row[0] for row in control(late, "registerPublisher") if row[-1] == 78
            and row[1] == "a"] == [0, 1, 2, 3, 4, 5, 7, 11]
    assert [(time_ns / S, text) for time_ns, _, _, text in heard] == [
        (11.16, "10.5"), (13.01, "13")]


@pytest.mark.parametrize(("client", "again_s"), [("roscpp", 131.05), ("rospy", None)])
def test_an_unreachable_master_is_called_again_when_tcp_has_given_up(client, again_s):
    """Five times a second, 2 + 4 + ... + 64 s, then the library's own pause: no more than eleven
    SYNs in two minutes. A rospy process ends then."""
    def check(**params):
        cut = net({"a": talker([]), "m": silent}, [apart("m")], client=client, **params)
        cut.run(200 * S)
        syns = [row[0] for row in control(cut, "registerPublisher")]
        assert syns == [*SYNS_S, *(again_s + after for after in SYNS_S if again_s)]
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


def a_death():
    """a dies at 2 s, and d subscribes at 5 s. What was believed, how many ghosts there are, who is
    registered, and what d sent that was more than an acknowledgement."""
    ghost = net({"a": talker(says(1)), "b": listener([]), "d": silent, "m": silent})
    stop(ghost, "a", 2)
    stop(ghost, "d", 2.5, 5, listener([]))
    ghost.run(1000 * S)
    assert ghost.graph.context.beliefs.matches == 0
    return (beliefs(ghost), ghost.graph.context.beliefs.ghosts,
            list(master(ghost, "m").publishers["/talk"]),
            [(round(time_s, 3), *rest) for time_s, source, *rest in control(ghost)
             if source == "d" and rest[1] != "ack"])


D_REGISTERS = [(5, "m", "registerSubscriber", 78), (5.02, "m", "registerSubscriber", 70),
               (5.02, "m", "registerSubscriber", 494)]
DEATH = (
    [(0.06, "b", "a", "/talk", 1), (5.04, "d", "a", "/talk", 1)], 2, [0],
    # It sends its SYN eleven times and gives up, as roscpp does; nobody lists a again.
    sorted([*D_REGISTERS, (35.04, "m", "registerSubscriber", 71),
            *((5.04 + after, "a", "requestTopic", 78) for after in SYNS_S)]))


def test_the_dead_stay_registered():
    """At 5 s d is told of a; it calls and is never answered."""
    assert a_death() == DEATH


def test_the_dead_are_struck_off_by_a_master_that_hears_of_it(monkeypatch):
    """A twin: it strikes off who stops, and tells b."""
    def strike_off(processes, host):
        for lists in processes.masters.values():
            lists.unregister_publisher("/talk", Uri(host, 1))

    when_one_stops(monkeypatch, strike_off)
    believed, ghosts, registered, _ = a_death()
    assert [row[1:] for row in believed] == [("b", "a", "/talk", 1), ("b", "a", "/talk", 0)]
    assert (ghosts, registered) == (0, [])


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


def late_header():
    """b's first header (0.12 s) is lost. The master takes a back and lists it anew, so that b hangs
    up and calls again; the FIN shows what is missing, but the first header is lost once more at
    0.18 s, and comes at 0.4 s behind the second one, with the FIN right after it."""
    heard = []
    late = net({"a": talker(says(0.3, 0.35, 0.4, 0.5)), "b": listener(heard), "m": silent},
               [Losing(4, 6, source=1, least_bytes=219)])
    lists, a = late.graph.middleware.processes.masters[2], process(late, "a").uri
    late.at(150 * MS, lambda: lists.unregister_publisher("/talk", a))
    late.at(160 * MS, lambda: lists.register_publisher("/talk", a))
    late.run(2 * S)
    assert [row[:3] for row in control(late, "tcpros_header")] == [
        (0.12, "b", "a"), (0.18, "b", "a"), (0.24, "b", "a"), (0.25, "a", "b"), (0.4, "b", "a"),
        (0.41, "a", "b")]
    return [(time_ns // MS, text) for time_ns, *_, text in heard]


def test_a_header_that_comes_late_does_not_take_the_link_from_a_younger_connection(monkeypatch):
    """A twin: the header that comes last, and not the connection that was called last, has the
    link."""
    assert late_header() == [(310, "0.3"), (360, "0.35"), (410, "0.4"), (510, "0.5")]

    def linked(process, link, by):
        if link.process.alive:
            publication = process.publications[link.topic]
            publication.connections[link.process.host] = by
            process._serve_link(publication, link)

    monkeypatch.setattr(Process, "linked", linked)
    assert late_header() != [(310, "0.3"), (360, "0.35"), (410, "0.4"), (510, "0.5")]

"""Streams and datagrams: sizes on the wire, whole logs of what they do in trouble."""

import pytest
from graphs import MS, Net, S, listener, silent, talker
from tcp_hosts import Takes

from desim.middleware.headers import datagram_frame, stream_frame
from desim.ports import Deliver, Drop
from desim.testing import ImmediateNetwork
from netmodels.access_link import AccessLink
from netmodels.rules.loss import Loss
from netmodels.rules.partition import Partition
from netmodels.rules.timing import Duplication


def link(**params):
    return AccessLink(AccessLink.Params(**params))


def partition(start, until):
    return Partition(Partition.Params(groups=[["b"]], **{"from": start, "until": until}))


@pytest.mark.parametrize(("size_bytes", "on_wire", "segments"), [
    (797, 871, 1), (1517, 1661, 2), (1605, 1749, 2), (738, 812, 1), (48, 122, 1), (118, 192, 1),
    (640_109, 671_123, 443), (160_109, 167_883, 111), (85, 159, 1), (1444, 1518, 1)])
def test_stream_sizes_are_those_of_tcpros(size_bytes, on_wire, segments):
    """Scan, scan with intensities, odometry, twist, tf, two maps, pose: message + 4 B, in
    segments of 1448 B with 14 + 4 + 20 + 32 B of headers."""
    assert stream_frame(size_bytes) == (on_wire, segments)


def test_datagram_sizes_are_those_of_udpros():
    """1492 B of a message in each datagram; 8 UDPROS, 8 UDP, 20 IP, 18 Ethernet around them."""
    assert datagram_frame(797) == (797 + 4 + 54, 1)
    assert datagram_frame(1488) == (1546, 1)
    assert datagram_frame(1489) == (1493 + 2 * 54, 2)
    assert datagram_frame(640_109)[1] == 430


def test_stream_over_a_partition_resumes_at_the_next_timeout():
    """Cut off from 1 s to 2.5 s: the first frame is lost, sent again as a probe after 0.2 s, after
    a timeout of 0.2 s, and of 0.4 and 0.8 s, each a little longer on ticks, and gets through
    with the last of these, 0.16 s after the network was whole again. Of what is said meanwhile the
    outbox of one keeps the newest."""
    heard = []
    net = Net({"a": talker([(S // 2, "before"), (S, "one"), (S + 1, "two"), (2 * S, "three"),
                            (2 * S + 1, "four"), (5 * S, "five")]), "b": listener(heard)},
              rules=[partition("1 s", "2.5 s")]).run(10 * S)
    back_ns = 2656 * MS
    assert heard == [(S // 2, "b", "a", "before"), (back_ns, "b", "a", "one"),
                     (back_ns, "b", "a", "four"), (5 * S, "b", "a", "five")]
    again = [(time_ms * MS, kind, *ends, 2, last) for time_ms in (1000, 1204, 1408, 1824)
             for kind, ends, last in (("frame", "ab", 174), ("lost", "ba", "partitioned"))]
    assert net.rows("frame", "lost", "dropped") == [
        (S // 2, "frame", "a", "b", 1, 174), *again,
        (2 * S, "dropped", "b", "a", 3, "outbox_full"),
        (2 * S + 1, "dropped", "b", "a", 4, "outbox_full"),
        (back_ns, "frame", "a", "b", 2, 174), (back_ns, "frame", "a", "b", 5, 174),
        (5 * S, "frame", "a", "b", 6, 174)]
    assert net.fates == [(1, "b", S // 2, "delivered", S // 2, S // 2),
                         (3, "b", 2 * S, "outbox_full", -1, -1),
                         (4, "b", 2 * S + 1, "outbox_full", -1, -1),
                         (2, "b", back_ns, "delivered", S, back_ns),
                         (5, "b", back_ns, "delivered", back_ns, back_ns),
                         (6, "b", 5 * S, "delivered", 5 * S, 5 * S)]


def test_timeouts_double_up_to_two_minutes():
    net = Net({"a": talker([(0, "hello")]), "b": listener([])},
              rules=[partition("0 s", "1 h")]).run(1000 * S)
    sent_ns = [row[0] for row in net.rows("frame")]
    gaps_s = [(b - a) / S for a, b in zip(sent_ns, sent_ns[1:], strict=False)]
    exact_s = [0.2, *(0.2 * 2**k for k in range(10)), *[120] * 6]
    assert len(gaps_s) == len(exact_s)
    assert all(exact <= gap <= 1.13 * exact for gap, exact in zip(gaps_s, exact_s, strict=True))
    assert gaps_s[:4] == [0.204, 0.204, 0.424, 0.832]


def repaired_ns(lost):
    """The time that a message of five segments takes over 1 ms, where its packets ``lost`` are lost
    once. Another one went before it."""
    heard = []
    Net({"a": talker([(0, "one"), (S, "two")], size_bytes=7000), "b": listener(heard)},
        link(rate="1 Gb/s", latency="1 ms"), [Takes(lost, (2,))]).run(3 * S)
    return heard[1][0] - S


def test_a_gap_is_repaired_within_a_round_trip_and_an_end_after_a_probe():
    """12 us a segment. The word of what came takes as long as the shortest way of a frame; at the
    end of a train nothing says what is missing until two round trips and 8 ms later, on ticks of
    4 ms, it is probed."""
    size_bytes, _ = stream_frame(7000)
    rest_ns, full_ns = (MS + bytes_ * 8 for bytes_ in (size_bytes - 1518, 1518))
    assert repaired_ns((1,)) == 2 * rest_ns + full_ns
    last_ns = MS + (size_bytes - 4 * 1518) * 8
    probed_ns = repaired_ns((4,)) - last_ns
    assert probed_ns % (4 * MS) == 0 and 0 < probed_ns - (MS + 4 * 1518 * 8) * 6 - 8 * MS < 8 * MS


def test_one_message_is_on_the_wire_and_the_outbox_keeps_the_newest():
    """1 ms per message of 125 B on the wire: of five said at once, with a queue of two, the first
    is on its way and the last two wait."""
    heard = []
    says = [(0, word) for word in ("one", "two", "three", "four", "five")]
    net = Net({"a": talker(says, size_bytes=51, queue=2), "b": listener(heard)},
              link(rate="1 Mb/s")).run(S)
    assert heard == [(MS, "b", "a", "one"), (2 * MS, "b", "a", "four"), (3 * MS, "b", "a", "five")]
    assert net.counts("/talk").dropped == {"outbox_full": 2}


def test_an_unbounded_outbox_loses_nothing_and_keeps_the_order():
    heard = []
    says = [(0, str(k)) for k in range(100)]
    Net({"a": talker(says, queue=0), "b": listener(heard)},
        link(rate="1 Mb/s"), [Loss(Loss.Params(probability="30 %"))]).run(3600 * S)
    assert [text for *_, text in heard] == [text for _, text in says]


@pytest.mark.parametrize("packets", [30, 120, None])
def test_what_the_own_interface_refuses_stays_in_the_socket(packets):
    """Messages of 111 packets to three hosts at once over 10 Mb/s, where so many find a place."""
    heard = []
    hosts = {"a": talker([(S, "map")], size_bytes=160_000)} | dict.fromkeys("bcd", listener(heard))
    net = Net(hosts, link(rate="10 Mb/s", queue_packets=packets)).run(10 * S)
    last_ns = max(time_ns for time_ns, *_ in heard) - S
    line_ns = 3 * stream_frame(160_000)[0] * 8 * 100
    assert len(heard) == 3 and line_ns <= last_ns < 1.01 * line_ns
    assert bool(net.rows("lost")) == bool(packets) and net.waiting() == 0
    medium = net.medium
    assert medium.packets_delivered == 3 * 111
    assert medium.packets_intended == 3 * 111 + sum(medium.packets_dropped.values())


def test_links_do_not_wait_for_each_other():
    """``c`` hears while the link to ``b`` is cut."""
    heard = []
    Net({"a": talker([(0, "one"), (1, "two")]), "b": listener(heard), "c": listener(heard)},
        rules=[partition("0 s", "1 s")]).run(2 * S)
    assert heard == [(0, "c", "a", "one"), (1, "c", "a", "two"),
                     (1_664 * MS, "b", "a", "one"), (1_664 * MS, "b", "a", "two")]


def test_a_copy_is_a_datagram_s_message_again_and_nothing_to_a_stream():
    for transport, times in ("datagram", 2), ("stream", 1):
        heard = []
        net = Net({"a": talker([(0, "one")], transport=transport), "b": listener(heard)},
                  rules=[Duplication(Duplication.Params(probability=1.0))]).run(S)
        counts = net.counts("/talk")
        assert heard == [(0, "b", "a", "one"), (MS, "b", "a", "one")][:times]
        assert (counts.intended, counts.delivered, counts.repeated) == (1, 1, 1)
        assert counts.queued == counts.called == times and net.medium.copies == 1
        assert len(net.rows("delivered")) == 1
        assert net.rows("repeated") == [(MS, "repeated", "b", "a", 1, "/talk")]


def test_nobody_gets_copies_who_was_down():
    heard = []
    net = Net({"a": talker([(0, "one")], transport="datagram"), "b": listener(heard)},
              rules=[Duplication(Duplication.Params(probability=1.0, after="2 s"))])
    net.at(S, net.graph.host("b").stop)
    net.run(5 * S)
    assert len(heard) == 1 and net.medium.copies == 0


def test_a_datagram_that_is_lost_stays_lost():
    heard = []
    net = Net({"a": talker([(0, "one"), (2 * S, "two")], transport="datagram"),
               "b": listener(heard)}, rules=[partition("0 s", "1 s")]).run(10 * S)
    assert heard == [(2 * S, "b", "a", "two")]
    assert net.counts("/talk").dropped == {"partitioned": 1}
    assert net.rows("frame", "lost", "dropped") == [
        (0, "frame", "a", "b", 1, 158), (0, "dropped", "b", "a", 1, "partitioned"),
        (2 * S, "frame", "a", "b", 2, 158)]


def test_a_broadcast_is_one_frame_for_all_and_one_row_for_those_out_of_reach():
    class Near(ImmediateNetwork):
        reasons = ("out_of_reach",)

        def send(self, frame):
            self._context.settle_many(frame, frame.receivers[:1], Deliver(5))
            self._context.settle_many(frame, frame.receivers[1:], Drop("out_of_reach"))

    heard = []
    net = Net({"a": talker([(0, "all")], via="broadcast"),
               **{host: listener(heard) for host in "bcd"}}, Near()).run(S)
    assert heard == [(5, "b", "a", "all")]
    assert [row for row in net.rows() if row[1] not in ("host_started", "sent")] == [
        (0, "frame", "a", "medium/lan", 1, 158), (0, "out_of_reach", "medium/lan", "a", 1, 2),
        (5, "delivered", "b", "a", 1, 5), (5, "callback", "b", "a", 1, "/talk")]
    counts = net.counts("/talk")
    assert (counts.intended, counts.delivered, counts.dropped) == (3, 1, {"out_of_reach": 2})
    assert net.medium.frames == 1
    assert net.medium.bytes_on_air == 158


def test_no_way_is_a_reason():
    for options in ({}, {"transport": "datagram"}, {"via": "broadcast"}):
        net = Net({"a": talker([(0, "one")], **options), "b": listener([]), "c": silent})
        net.graph.host("b").media.clear()
        net.run(S)
        assert net.counts("/talk").dropped == {"no_route": 1}
        assert net.medium.frames == 0


def test_a_sender_that_stops_takes_its_outbox_with_it():
    """Its frame on the way arrives; what waited does not, nor does it come back with the host."""
    heard = []
    says = [(0, "one"), (0, "two"), (5 * S, "after")]
    net = Net({"a": talker(says), "b": listener(heard)}, link(rate="1 Mb/s", latency="1 s"))
    net.at(MS, net.graph.host("a").stop)
    net.at(2 * S, net.graph.host("a").start)
    net.run(10 * S)
    assert [text for *_, text in heard] == ["one", "after"]
    assert net.counts("/talk").dropped == {"sender_down": 1}


def test_a_sender_that_stops_while_it_waits_for_its_timeout():
    net = Net({"a": talker([(0, "one"), (0, "two")]), "b": listener([])},
              rules=[partition("0 s", "1 h")])
    net.at(S, net.graph.host("a").stop)
    net.run(10 * S)
    assert net.counts("/talk").dropped == {"sender_down": 2}
    assert net.rows("frame")[-1][0] < S


def test_a_receiver_that_stops_closes_the_links_to_it():
    """The frame on the way finds nobody; a new link begins when the host is back."""
    heard = []
    says = [(0, "one"), (1, "two"), (1500 * MS, "to nobody"), (5 * S, "after")]
    net = Net({"a": talker(says), "b": listener(heard)}, link(rate="1 Mb/s", latency="1 s"))
    net.at(MS, net.graph.host("b").stop)
    net.at(2 * S, net.graph.host("b").start)
    net.run(10 * S)
    assert [text for *_, text in heard] == ["after"]
    counts = net.counts("/talk")
    assert counts.dropped == {"link_closed": 1, "host_down": 1}
    assert counts.intended == 3, "while b was down nobody listened"


def test_a_frame_of_a_former_connection_is_not_heard_by_the_new_one():
    heard = []
    net = Net({"a": talker([(0, "old")]), "b": listener(heard)}, link(rate="1 Mb/s", latency="1 s"))
    net.at(MS, net.graph.host("b").stop)
    net.at(2 * MS, net.graph.host("b").start)
    net.run(10 * S)
    assert heard == []
    assert net.counts("/talk").dropped == {"link_closed": 1}

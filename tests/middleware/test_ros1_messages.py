"""ROS 1 with one master: what becomes of messages, and what there is not."""

import pytest
from graphs import MS, S, listener, silent, talker
from ros_networks import apart, control, says, stop
from ros_networks import one_master as net
from tcp_hosts import Losing

from desim.errors import InputError


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


def test_a_writer_that_blocks_fills_the_socket():
    """poll() says full when a third of the buffer is left; rospy's sendall() goes on."""
    delivered = {}
    for client in "roscpp", "rospy":
        cut = net({"a": talker(says(*(1 + i / 10 for i in range(80))), size_bytes=1000, queue=2),
                   "b": listener([], queue=0), "m": silent},
                  [apart("b", start="1.5 s", until="7.5 s")], client=client).run(30 * S)
        delivered[client] = cut.counts("/talk").delivered
    assert 30 < delivered["roscpp"] < delivered["rospy"] - 8


def test_a_fate_has_the_instants_of_the_first_and_the_last_frame():
    """The frame of the first message is lost. After a round trip and 200 ms the second one, which
    Nagle's algorithm holds, goes as a probe; its acknowledgement shows what is missing. The third
    one is sent to nobody until TCP gives up, and the fourth one is its probe."""
    sent = net({"a": talker(says(1, 1.005, 2.5, 2.51)), "b": listener([], queue=0), "m": silent},
               [Losing(4, source=0, least_bytes=174), apart("b", start="2.495 s")]).run(1000 * S)
    assert [(reason, *(time_ns // MS for time_ns in times if time_ns >= 0))
            for _, _, _, reason, *times in sent.fates] == [
        ("delivered", 1000, 1240), ("delivered", 1220, 1220), ("link_closed", 2500, 827_780),
        ("link_closed", 2720, 2720)]


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
    with pytest.raises(InputError, match=r"^\.via: ROS 1 has no broadcast; allowed: unicast$"):
        net({"a": talker([], via="broadcast"), "m": silent})
    with pytest.raises(InputError, match=r"master: no host 'n'.*allowed: a, m"):
        net({"a": silent, "m": silent}, master="n")


@pytest.mark.parametrize(("hosts", "master_"), [
    (("base", "robot_0", "workstation"), "workstation"), (("base", "a"), "base"),
    (("robot_10", "robot_2"), "robot_2")])
def test_where_the_master_is(hosts, master_):
    usual = net(dict.fromkeys(hosts, silent), master=None).run(0)
    assert list(usual.graph.middleware.processes.masters) == [usual.graph.host(master_).index]

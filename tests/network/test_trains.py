"""A train can lose some of its packets: what rules, models and senders make of it."""

import pytest
from graphs import MS, Net, listener, talker
from lossy import Loses
from tcp_hosts import Pair, Takes, link

from desim import ports
from desim.errors import ModelError
from desim.middleware.headers import stream_frame
from desim.middleware.tcp.parameters import runs
from desim.ports import FULL_PACKET_BYTES, Drop
from desim.testing import Bench
from netmodels.access_link import AccessLink


def test_a_rule_takes_packets_out_and_the_model_never_sees_them():
    """Ten full packets but for the last: without the numbers 0, 4 and 9."""
    model = Loses()
    bench = Bench(model, 2, rules=[Takes((0, 4)), Takes((4, 9))])
    bench.send(0, "host_1", "host_2", 9 * 1518 + 100, 10, "train")
    assert bench.run() == [(5, "train", "host_1", "host_2", "arrived in part")]
    assert bench.parts == [("train", "host_2", {0: "taken", 4: "taken", 9: "taken"})]
    assert model.given == [(7, 7 * 1518)]
    medium = bench.medium
    assert (medium.intended, medium.delivered, medium.dropped) == (1, 1, {})
    assert (medium.packets_intended, medium.packets_delivered) == (10, 7)
    assert medium.packets_dropped == {"taken": 3}
    assert medium.bytes_on_air == 7 * 1518 == medium.rx_bytes[1]
    assert medium.tx_bytes[0] == 9 * 1518 + 100


def test_a_model_counts_the_packets_that_it_was_given():
    """Of the numbers 0 to 5 a rule takes 1 and 2: the model's 1 and 3 are 3 and 5."""
    bench = Bench(Loses(r1=((1,), (3,))), 2, rules=[Takes((1, 2))])
    bench.send(0, "host_1", "host_2", 600, 6, "train")
    bench.run()
    assert bench.parts == [("train", "host_2", {1: "taken", 2: "taken", 3: "spilt", 5: "burnt"})]
    assert bench.medium.packets_dropped == {"taken": 2, "spilt": 1, "burnt": 1}
    assert bench.medium.packets_delivered == 2


def test_a_broadcast_loses_packets_receiver_by_receiver():
    model = Loses(r2=((0,), (0, 1)), r3=((), (0, 1, 2)))
    bench = Bench(model, 4, rules=[Takes((1,))])
    bench.send(0, "host_1", ["host_2", "host_3", "host_4"], 3 * 1518, 3, "train", broadcast=True)
    bench.run()
    assert model.given == [(3, 3 * 1518)], "it goes whole, since others want what one lacks"
    assert bench.parts == [("train", "host_2", {1: "taken"}),
                           ("train", "host_3", {0: "spilt", 1: "taken"})]
    assert [(receiver, fate) for *_, receiver, fate in bench.log] == [
        ("host_4", "burnt"), ("host_2", "arrived in part"), ("host_3", "arrived in part")]
    medium = bench.medium
    assert medium.packets_dropped == {"taken": 3, "spilt": 1, "burnt": 2}
    assert medium.packets_intended == 9 == medium.packets_delivered + 6
    assert (medium.delivered, medium.dropped) == (2, {"burnt": 1})


def test_what_is_refused_of_a_broadcast_train_is_refused_once():
    """A full queue takes the packets 0 and 2 for none of three receivers: 1518 + 100 B."""
    model = Loses(**dict.fromkeys(("r1", "r2", "r3"), ((0, 2),)))
    model.refuses = ("spilt",)
    bench = Bench(model, 4)
    bench.send(0, "host_1", ["host_2", "host_3", "host_4"], 2 * 1518 + 100, 3, broadcast=True)
    bench.run()
    assert bench.medium.refused_bytes == 1518 + 100
    assert bench.medium.packets_dropped == {"spilt": 3 * 2}


@pytest.mark.parametrize("where", ["rule", "model"])
def test_the_last_packets_settle_the_frame(where):
    model = Loses(r1=((0, 1, 2),)) if where == "model" else Loses()
    model.send, send = lambda frame: send(frame) and None, model.send
    bench = Bench(model, 2, rules=[Takes((0, 1, 2))] if where == "rule" else [])
    bench.send(0, "host_1", "host_2", 300, 3)
    reason = "spilt" if where == "model" else "taken"
    assert [fate for *_, fate in bench.run()] == [reason]
    assert bench.medium.dropped == {reason: 1} and bench.medium.packets_dropped == {reason: 3}
    assert bench.medium.in_flight() == 0


@pytest.mark.parametrize("packets", [(3,), (-1,), ("1",), (True,), (1.0,)])
def test_only_packets_of_the_train_can_be_lost(packets):
    for rules, model in ([Takes(packets)], Loses()), ([], Loses(r1=(packets,))):
        bench = Bench(model, 2, rules=rules)
        bench.send(0, "host_1", "host_2", 300, 3)
        with pytest.raises(ModelError, match="of a train of 3; wanted: ints from 0 to 2"):
            bench.run()


def test_what_is_settled_loses_nothing_more():
    class Late(Loses):
        def send(self, frame):
            self._context.settle(frame, frame.receivers[0], ports.Deliver(0))
            self._context.settle(frame, frame.receivers[0], Drop("spilt", (1,)))

    for broadcast in False, True:
        bench = Bench(Late(), 2)
        bench.send(0, "host_1", "host_2", 300, 3, broadcast=broadcast)
        with pytest.raises(ModelError, match="settled already or was never intended"):
            bench.run()


def test_the_whole_log_of_a_message_that_is_repaired():
    """Three segments of 1 ms a kB; the second one is lost once and goes alone, when the word of it
    can be back, which takes as long as the others did."""
    heard = []
    net = Net({"a": talker([(0, "word")], size_bytes=3000), "b": listener(heard)},
              link(rate="8 Mb/s"), [Takes((1,))])
    net.run(10 * MS)
    size_bytes, segments = stream_frame(3000)
    first_ns, again_ns = 1000 * (size_bytes - 1518), 1000 * 1518
    assert (size_bytes, segments) == (3004 + 3 * 70, 3)
    assert net.rows("frame", "lost", "delivered") == [
        (0, "frame", "a", "b", 1, size_bytes),
        (first_ns, "lost", "b", "a", 1, "taken"),
        (2 * first_ns, "frame", "a", "b", 1, 1518),
        (2 * first_ns + again_ns, "delivered", "b", "a", 1, 2 * first_ns + again_ns)]
    assert heard == [(2 * first_ns + again_ns, "b", "a", "word")]


def test_a_datagram_lacks_nothing():
    heard = []
    net = Net({"a": talker([(0, "word")], size_bytes=3000, transport="datagram"),
               "b": listener(heard)}, rules=[Takes((1,))]).run(MS)
    assert heard == [] and net.counts("/talk").dropped == {"taken": 1}


def test_tcp_repairs_a_gap_within_a_round_trip():
    """Far below the least retransmission timeout; the twin without a word of what arrived waits
    for it."""
    for packets, soon in ((3,), True), (None, False):
        pair = Pair(link(rate="100 Mb/s", latency="5 ms"), [Takes(packets, (4,))])
        pair.at(0, pair.call)
        pair.at(50 * MS, pair.say, 1, 10_000)
        pair.run(2000 * MS)
        (heard_ns, _), = pair.heard()
        assert (heard_ns < 100 * MS) == soon, heard_ns


@pytest.mark.parametrize("lost, left", [
    ((), [(0, 5)]), ((0,), [(1, 5)]), ((4,), [(0, 4)]), ((1, 2), [(0, 1), (3, 5)]),
    ((0, 2, 4), [(1, 2), (3, 4)])])
def test_runs_of_segments_that_arrived(lost, left):
    assert runs(5, lost) == left


def test_a_broadcast_of_which_rules_and_the_model_lose_all_between_them_is_dropped_there():
    """The rule loses the first of two packets, and the link has no place for the second."""
    class First:
        reasons = ("first",)

        def start(self, context, hosts):
            pass

        def judge(self, frame, receivers):
            return [ports.Drop("first", (0,)) if receiver == 1 else ports.PASS
                    for receiver in receivers]

    bench = Bench(AccessLink(AccessLink.Params(queue="2 kB")), 3, rules=[First()])
    bench.send(0, "host_1", ["host_2", "host_3"], 2 * FULL_PACKET_BYTES, 2, broadcast=True)
    assert {(receiver, fate) for *_, receiver, fate in bench.run()} == {
        ("host_2", "queue_full"), ("host_3", "arrived in part")}
    medium = bench.medium
    assert (medium.delivered, medium.dropped, medium.in_flight()) == (1, {"queue_full": 1}, 0)
    assert medium.packets_dropped == {"first": 1, "queue_full": 2}

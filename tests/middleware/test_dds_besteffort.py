"""DDS data of best effort: sent once, by chance heard, never out of order."""

import math
from fractions import Fraction

import pytest
from ddsnets import conserved, dds
from graphs import MS, Net, S, Words, listener, talker

from desim.scenario.schema.sockets import Sockets
from netmodels.rules.loss import Loss
from netmodels.rules.timing import Reordering

PERIOD_MS, SAYINGS, LOST = 10, 16_000, Fraction(1, 100)


def share_heard(size_bytes):
    """Of 16 000 best-effort messages over a network that loses one packet in a hundred, where
    incomplete datagrams block no others."""
    count = []

    def begin(node):
        node.advertise("/talk", transport="datagram")
        node.timer(Fraction(1000, PERIOD_MS), lambda k: node.publish(
            "/talk", Words("x", size_bytes)), start="zero")

    net = Net({"a": begin, "b": listener(count)}, middleware=dds(),
              rules=[Loss(Loss.Params(probability=float(LOST)))],
              sockets=Sockets(reassembly="1 GB"))
    net.run(5 * S + SAYINGS * PERIOD_MS * MS)
    counts = net.counts("/talk")
    assert conserved(net)
    return counts.delivered / counts.intended


@pytest.mark.parametrize(("size_bytes", "packets"), [(100, 1), (13_000, 9), (60_000, 45)])
def test_any_lost_packet_loses_a_best_effort_message(size_bytes, packets):
    """(1 - p)^n, within three standard deviations; with a tenth more packets it would not be
    that, where there are enough of them to tell."""
    share = share_heard(size_bytes)

    def off(n):
        expected = float((1 - LOST) ** n)
        return abs(share - expected) / math.sqrt(expected * (1 - expected) / SAYINGS)

    assert off(packets) < 3
    assert packets < 40 or off(packets * 1.1) > 3


def test_best_effort_ignores_frames_that_were_overtaken():
    """A frame that is overtaken is of no use: 30 % of them come 25 ms later, one is said every
    10 ms."""
    heard = []
    net = Net({"a": talker([(2 * S + k * 10 * MS, str(k)) for k in range(50)],
                           transport="datagram"), "b": listener(heard, queue=0)},
              rules=[Reordering(Reordering.Params(probability="30 %", delay="25 ms"))],
              middleware=dds()).run(10 * S)
    said = [int(text) for *_, text in heard]
    assert said == sorted(said)
    assert net.counts("/talk").dropped == {"overtaken": 50 - len(said)} and len(said) < 50


def test_a_multicast_is_one_frame_for_all_readers():
    heard = []
    net = Net({"a": talker([(2 * S, "all")], via="broadcast", size_bytes=30_000),
               **{host: listener(heard) for host in "bcd"}}, middleware=dds()).run(3 * S)
    assert sorted((host, text) for _, host, _, text in heard) == [(host, "all") for host in "bcd"]
    assert [row[3] for row in net.rows("frame")] == ["medium/lan"]
    assert conserved(net)

"""UDP sockets: send buffers that block, as Linux has them."""

from collections import deque
from fractions import Fraction

import pytest
from configured import configured
from graphs import Net, silent
from hypothesis import given, settings
from hypothesis import strategies as st

from desim.middleware.contents import Filler
from desim.middleware.dds.dds import Dds
from desim.middleware.host import Host
from desim.middleware.ros1.ros1 import Ros1
from desim.middleware.udp import skb, socket
from desim.middleware.udp.skb import truesize_bytes
from desim.network.carrier import Carrier
from desim.ports import FULL_PACKET_BYTES
from desim.units import airtime_ns
from netmodels.access_link import AccessLink
from netmodels.radio.dcf.radio import DcfRadio

S, MS = 1_000_000_000, 1_000_000
LIMIT = 212_992


def link(rate):
    return AccessLink(AccessLink.Params(rate=rate))


@pytest.mark.parametrize(("size_bytes", "packets", "memory"), [
    (1518, 1, 2304), (146, 1, 768), (64, 1, 768), (600, 1, 1280), (45 * 1518, 45, 45 * 2304)])
def test_packets_take_the_memory_of_their_buffers(size_bytes, packets, memory):
    """SKB_TRUESIZE on x86-64: buffers are powers of two, and an sk_buff takes 256 B."""
    assert truesize_bytes(size_bytes, packets) == memory


# A sender alone on a line, beside a plain model of it.


class Log(Carrier):
    """Notes when messages were made and when their last datagram arrived."""

    def __init__(self, net):
        self.net, self.arrivals, self.made = net, [], []

    def arrived(self, token, receiver):
        born_ns, last = token
        if last:
            self.arrivals.append((born_ns, self.net.kernel.now_ns))


def sent_by_desim(period_ns, packets, datagrams, rate_bps, until_ns):
    """A node makes a message of so many datagrams at each tick."""
    nodes = {}

    def begin(node):
        nodes["a"] = node
        node.timer(Fraction(S, period_ns), make, "zero")

    def make(_):
        node, now_ns = nodes["a"], net.kernel.now_ns
        log.made.append(now_ns)
        for k in range(datagrams):
            node.host.sockets.named("own").send(
                net.medium, (1,), packets * FULL_PACKET_BYTES, packets, False, log,
                (now_ns, k == datagrams - 1), packets, node.name)

    net = Net({"a": begin, "b": silent}, link(f"{rate_bps} b/s"))
    log = Log(net)
    net.run(until_ns)
    return log.made, log.arrivals


def sent_by_the_book(period_ns, packets, datagrams, rate_bps, until_ns):
    """The same, said plainly: ``sock_alloc_send_skb`` lets a datagram through below the limit, and
    else sleeps until ``sock_def_write_space`` finds less than half of it taken."""
    air_ns = airtime_ns(packets * FULL_PACKET_BYTES, rate_bps)
    leaving, free_ns, now_ns, tick = deque(), 0, 0, 0
    made, arrivals = [], []
    while now_ns <= until_ns:
        born_ns = now_ns
        made.append(born_ns)
        for _ in range(datagrams):
            while leaving and leaving[0] <= now_ns:
                leaving.popleft()
            if len(leaving) * packets * 2304 >= LIMIT:
                while 2 * len(leaving) * packets * 2304 >= LIMIT:
                    now_ns = leaving.popleft()
            free_ns = max(free_ns, now_ns) + air_ns
            leaving.append(free_ns)
        arrivals.append((born_ns, free_ns))
        late = now_ns // period_ns
        tick, now_ns = (late, now_ns) if late > tick else (tick + 1, (tick + 1) * period_ns)
    return made, [arrival for arrival in arrivals if arrival[1] <= until_ns]


senders = given(st.integers(1, 200).map(lambda ms: ms * MS), st.integers(1, 45), st.integers(1, 8),
                st.integers(1, 200).map(lambda mbps: mbps * 1_000_000))


@settings(max_examples=60, deadline=None)
@senders
def test_a_sender_waits_as_linux_lets_it(period_ns, packets, datagrams, rate_bps):
    how = period_ns, packets, datagrams, rate_bps, 2 * S
    assert sent_by_desim(*how) == sent_by_the_book(*how)


SATURATING = 33 * MS, 43, 3, 25_000_000, 10 * S  # a picture of 190 kB at 30 Hz over 25 Mb/s


def test_a_saturated_line_is_full_and_data_are_young():
    made, arrivals = sent_by_desim(*SATURATING)
    air_ns = airtime_ns(129 * FULL_PACKET_BYTES, 25_000_000)
    assert len(arrivals) == 10 * S // air_ns
    assert max(arrived_ns - born_ns for born_ns, arrived_ns in arrivals) < 150 * MS
    assert len(made) - len(arrivals) <= 3


@pytest.mark.parametrize("twin", ["no truesize", "nobody blocks", "no half"])
def test_other_sockets_are_not_linux(monkeypatch, twin):
    if twin == "no truesize":
        monkeypatch.setattr(socket, "truesize_bytes", lambda size_bytes, packets: size_bytes)
    elif twin == "nobody blocks":
        monkeypatch.setattr(Host, "block", lambda self, node: None)
        monkeypatch.setattr(Host, "unblock", lambda self, node: None)
    else:
        monkeypatch.setattr(socket, "HALF", 1)
    assert sent_by_desim(*SATURATING) != sent_by_the_book(*SATURATING)
    assert skb.truesize_bytes(1518, 1) == 2304


# Nodes.


def blocking(log, size_bytes=300_000):
    """A node that sends a large datagram message every 100 ms, and has callbacks of other sorts."""
    def begin(node):
        node.advertise("/large", transport="datagram")
        node.advertise("/echo")

        def tick(k):
            log.append((node.now_ns // MS, "tick", k))
            node.publish("/large", Filler(size_bytes))

        node.timer(10, tick, "zero")
        node.after(150 * MS, lambda _: log.append((node.now_ns // MS, "after", 150)))
        node.subscribe("/word", lambda message: log.append(
            (node.now_ns // MS, "heard", message.size_bytes)), queue=2)
    return begin


def chatty(node):
    """Says words of 1 B, 2 B, ... every 60 ms to the nodes of its host."""
    node.advertise("/word")
    node.timer(Fraction(1000, 60), lambda k: node.publish("/word", Filler(k + 1)), "zero")


def reader(node):
    node.latest("/large")


def test_a_blocked_node_skips_ticks_and_its_other_callbacks_wait():
    """202 datagrams of 1528 B at 8 Mb/s take 309 ms. Six parts of 16 fill the buffer; the last one
    has room when 128 have left, after 197 ms. Of the ticks that have passed by then one is made up
    for, and of the messages that came as many are kept as the queue has places."""
    log = []
    net = Net({"a": {"large": blocking(log), "words": chatty}, "b": reader}, link("8 Mb/s"))
    net.run(1 * S)
    assert log == [
        (0, "tick", 0), (197, "heard", 3), (197, "after", 150), (197, "heard", 4), (197, "tick", 1),
        (507, "heard", 8), (507, "heard", 9), (507, "tick", 5),
        (818, "heard", 13), (818, "heard", 14), (818, "tick", 8)]
    large, words = net.counts("/large"), net.counts("/word")
    assert words.overwritten == 17 - 2 * 4
    assert large.intended == large.delivered + net.waiting() == 4 and not large.dropped


def test_a_host_that_stops_loses_what_waits():
    log = []
    net = Net({"a": blocking(log), "b": reader}, link("8 Mb/s"))
    net.at(120 * MS, net.graph.host("a").stop)
    net.at(600 * MS, net.graph.host("a").start)
    net.run(2 * S)
    large = net.counts("/large")
    assert large.dropped == {"sender_down": 1}
    assert large.intended == large.delivered + 1 + net.waiting()
    assert [entry[0] for entry in log if entry[1] == "tick"][:2] == [0, 600]


def radio():
    return DcfRadio(DcfRadio.Params(path_loss={"model": "fixed", "total": "60 dB"}))


@settings(max_examples=25, deadline=None)
@given(st.integers(1, 400_000), st.integers(5, 50),
       st.sampled_from([radio, lambda: link("9 Mb/s")]),
       st.sampled_from(["unicast", "broadcast"]))
def test_what_a_blocked_publisher_has_published_arrives(size_bytes, rate_hz, model, via):
    def begin(node):
        node.advertise("/large", transport="datagram", via=via)
        node.timer(rate_hz, lambda _: node.publish("/large", Filler(size_bytes)), "zero")

    net = Net({"a": begin, "b": reader}, model()).run(1 * S)
    counts, medium = net.counts("/large"), net.medium
    assert not counts.dropped and not medium.dropped
    assert counts.intended == counts.delivered + net.waiting()
    assert medium.intended == medium.delivered + medium.in_flight()
    assert medium.packets_intended >= medium.packets_delivered


class Costs:
    """Each callback of ``large`` takes 5 ms, and all else no time."""

    def callback_ns(self, work):
        return 5 * MS * (work.node == "large")

    def send_ns(self, topic, size_bytes, links):
        return 0

    def receive_ns(self, topic, size_bytes):
        return 0


def test_a_blocked_node_of_a_busy_computer_waits_too():
    """As above, but a callback's messages leave at its end, and a timer that is late starts anew
    from then (roscpp). The computer does other work meanwhile."""
    log = []
    net = Net({"a": {"large": blocking(log), "words": chatty}, "b": reader}, link("8 Mb/s"),
              costs=Costs())
    net.run(600 * MS)
    assert log == [
        (0, "tick", 0), (202, "heard", 3), (207, "heard", 4), (212, "tick", 1),
        (512, "after", 150), (517, "tick", 2)]
    assert net.graph.host("a").missed_ticks == 2


MIDDLEWARES = {
    "direct": lambda: None, "ros1": lambda: Ros1(configured(Ros1.Params, master="a")),
    "cyclonedds": lambda: Dds(configured(Dds.Params, preset="cyclonedds", start_spread="0 ns")),
    "fastdds": lambda: Dds(configured(Dds.Params, preset="fastdds", start_spread="0 ns"))}


@pytest.mark.parametrize("middleware", MIDDLEWARES)
def test_pictures_are_young_under_each_middleware(middleware):
    """187.5 kB at 30 Hz, 45 Mb/s, over a line of 25 Mb/s."""
    def begin(node):
        node.advertise("/large", transport="datagram")
        node.timer(30, lambda _: node.publish("/large", Filler(187_500)), "zero")

    net = Net({"a": begin, "b": reader}, link("25 Mb/s"), middleware=MIDDLEWARES[middleware]())
    net.run(6 * S)
    ages_ns, counts = [row[5] for row in net.rows("delivered")], net.counts("/large")
    assert 80 < len(ages_ns) == counts.delivered and max(ages_ns) < 150 * MS
    assert not counts.dropped and counts.intended == counts.delivered + net.waiting()

"""The receiving side of UDP sockets: reassembly, and buffers that overflow, as Linux has them."""

from collections import deque

import pytest
from configured import configured
from graphs import Net, silent
from hypothesis import given, settings
from hypothesis import strategies as st
from ledgers import stamps_of, sums, with_ledger

from desim.middleware.contents import Filler
from desim.middleware.dds.dds import Dds
from desim.middleware.udp.reassembly import Reassembly
from desim.network.carrier import Carrier
from desim.ports import FULL_PACKET_BYTES, PASS, Drop
from desim.scenario.schema.sockets import Sockets
from desim.units import airtime_ns
from netmodels.access_link import AccessLink

S, MS = 1_000_000_000, 1_000_000
LIMIT = 212_992


def link(rate):
    return AccessLink(AccessLink.Params(rate=rate))


def reader(node):
    node.latest("/large")


class Unlucky:
    """Loses packet 3 of each train of 45 that is sent before 5 s."""

    reasons = ("unlucky",)

    def start(self, context, hosts):
        self._context = context

    def judge(self, frame, receivers):
        lost = frame.segments == 45 and self._context.now_ns < 5 * S
        return [Drop("unlucky", (3,)) if lost else PASS] * len(receivers)


class Fates(Carrier):
    def __init__(self, net):
        self.net, self.all = net, []

    def arrived(self, token, receiver):
        self.all.append((token, "arrived"))

    def arrived_in_part(self, token, receiver, lost):
        self.all.append((token, lost[min(lost)]))

    def lost(self, token, receiver, reason):
        self.all.append((token, reason))


def fragmented(packets, until_ns, rules=(), rate="1 Gb/s", **sockets):
    """One datagram every 100 ms: its number, and what became of it."""
    def begin(node):
        def send(k):
            node.host.sockets.named("own").send(
                net.medium, (1,), packets * FULL_PACKET_BYTES, packets, False, fates, k, packets,
                node.name)
        node.timer(10, send, "zero")

    net = Net({"a": begin, "b": silent}, link(rate), rules=rules, sockets=Sockets(**sockets))
    fates = Fates(net)
    net.run(until_ns)
    return fates.all, net


def test_incomplete_datagrams_fill_the_memory_for_thirty_seconds():
    """Each leaves 44 fragments of 2304 B: 42 of them are more than 4 MiB. From then on no datagram
    begins until one of them has been there for 30 to 32 s, as long timers are late."""
    fates, net = fragmented(45, 40 * S, [Unlucky()])
    assert fates[:42] == [(k, "unlucky") for k in range(42)]
    assert fates[42:308] == [(k, "reassembly_full") for k in range(42, 308)]
    first = next(k for k, fate in fates if fate == "arrived")
    assert first == 308 and {fate for _, fate in fates[first:]} == {"arrived"}
    medium = net.medium
    assert medium.packets_dropped == {"unlucky": 50}  # the rest is lost behind the network


@pytest.mark.parametrize(("how", "lost"), [
    ({"reassembly_time": "3 s"}, 0), ({"reassembly": "1 MB"}, 320)])
def test_other_memories_lose_other_datagrams(how, lost):
    fates, _ = fragmented(45, 40 * S, [Unlucky()], **how)
    assert sum(fate == "reassembly_full" for _, fate in fates) == pytest.approx(lost, abs=30)


def test_a_datagram_that_crosses_the_limit_is_cut_and_fills_the_memory():
    """Room for 50 full packets. 44 of 45 have come of a datagram; seven of the next one end above
    the limit. Then there is none, also for a datagram that misses nothing, until both are gone."""
    memory, size_bytes = Reassembly(50 * 2304, 30 * S), 45 * FULL_PACKET_BYTES

    def refused(now_ns, lost):
        return list(memory.take(now_ns, size_bytes, 45, 45, lost))

    assert refused(0, {3: "unlucky"}) == [3]
    assert refused(1 * S, {}) == list(range(7, 45))
    assert refused(2 * S, {}) == list(range(45))
    assert refused(33 * S, {}) == []
    assert not memory.expiring


def test_single_packets_need_no_reassembly():
    fates, _ = fragmented(1, 6 * S, [Unlucky()], reassembly="0 B")
    assert {fate for _, fate in fates} == {"arrived"}


def read_by_the_book(packets, datagrams, read_ns, until_ns):
    """A thread takes datagrams one by one. One that does not fit into what is free is lost, unless
    nothing is taken. What is read gets free again when it is a quarter of the limit, or when the
    thread has read all that was there when something got free last. Fates in order of the
    datagrams: when it was read, or None."""
    air_ns, memory = airtime_ns(packets * FULL_PACKET_BYTES, 1_000_000_000), packets * 2304
    free_ns, waiting, fates = 0, deque(), []
    taken = read = ahead = 0
    for tick_ns in range(0, until_ns, 20 * MS):
        for k in range(datagrams):
            now_ns = tick_ns + (k + 1) * air_ns
            for idle in (False, True):  # before it comes, and when it has come
                while waiting and waiting[0] <= now_ns:
                    ahead = (ahead or len(waiting)) - 1
                    waiting.popleft()
                    read += memory
                    if not ahead or read >= LIMIT / 4:
                        taken, read, ahead = taken - read, 0, len(waiting)
                if not idle and taken and taken + memory > LIMIT:
                    fates.append(None)
                elif not idle:
                    fates.append(max(free_ns, now_ns))
                    free_ns = fates[-1] + read_ns
                    waiting.append(fates[-1])
                    taken += memory
    return fates


class Reader(Carrier):
    def __init__(self, net):
        self.net, self.fates = net, {}

    def arrived(self, number, receiver):
        self.fates[number] = self.net.kernel.now_ns

    def lost(self, number, receiver, reason):
        assert reason == "receive_buffer_full"
        self.fates[number] = None


def read_by_desim(packets, datagrams, read_ns, until_ns, **sockets):
    def begin(node):
        def send(k):
            if net.kernel.now_ns < until_ns:
                for number in range(k * datagrams, (k + 1) * datagrams):
                    node.host.sockets.named("own").send(
                        net.medium, (1,), packets * FULL_PACKET_BYTES, packets, False, log, number,
                        packets, node.name)
        node.timer(50, send, "zero")

    net = Net({"a": begin, "b": silent}, link("1 Gb/s"),
              sockets=Sockets(read=f"{read_ns} ns", send_buffer="10 MB", **sockets))
    log = Reader(net)
    net.run(10 * until_ns + 60 * S)
    assert net.medium.delivered == net.medium.intended
    return [log.fates[number] for number in range(len(log.fates))]


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 45), st.integers(1, 16), st.integers(1, 5_000_000))
def test_a_thread_reads_as_fast_as_it_can_and_the_rest_is_lost(packets, datagrams, read_ns):
    how = packets, datagrams, read_ns, 1 * S
    assert read_by_desim(*how) == read_by_the_book(*how)


def test_a_larger_receive_buffer_loses_less():
    """A cloud of 197 kB in 14 datagrams of ten packets, each of which takes 0.5 ms to read: three
    of each cloud are lost, and so the cloud."""
    how = 10, 14, 500_000, 1 * S
    assert read_by_desim(*how).count(None) == 50 * 3
    assert None not in read_by_desim(*how, receive_buffer="1 MB")


@pytest.mark.parametrize("read", ["0 s", "70 ms"])
def test_the_parts_of_a_message_are_its_time_in_sockets_too(read):
    def begin(node):
        node.advertise("/large", transport="datagram")
        node.timer(20, lambda _: node.publish("/large", Filler(60_000)), "zero")

    ledger, _ = with_ledger(lambda ledger: Net(
        {"a": begin, "b": reader}, link("8 Mb/s"), ledger=ledger, sockets=Sockets(read=read),
        middleware=Dds(configured(Dds.Params, preset="fastdds", start_spread="0 ns"))).run(4 * S))
    late = [sum(time_ns for part, host, time_ns in parts if (part, host) == ("queue", "b"))
            for parts in stamps_of(ledger)]
    found = sums(ledger)
    assert len(found.latency_ns) > 30 and (found.latency_ns == found.parts_ns).all()
    assert found.by_part["sender's queue"] > 0
    assert (max(late) > 0) == (read != "0 s")

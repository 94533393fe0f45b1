"""The Ethernet switch and the interfaces of its hosts.

Formulas, whole small logs, and what is compiled against the same packet by packet.
"""

import csv
import itertools
from collections import defaultdict
from statistics import mean

import numpy as np
import packet_by_packet
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from packet_by_packet import PacketByPacket

from desim.engine.kernel import Phase
from desim.netcases.case import play as play_case
from desim.network.carrier import Carrier
from desim.ports import packet_sizes
from desim.ports.cases import NOWHERE, Flow, Setup
from desim.testing import Bench
from desim.units import airtime_ns
from netmodels.ethernet import GAP_BYTES, PREAMBLE_BYTES
from netmodels.switch import Switch

GB = 10**9
CABLE_NS = 500
STREAM_MAP = 671_123, 443  # an 800 x 800 grid over TCPROS: bytes with headers, segments
FULL = 1518
DISCIPLINES = ["pfifo", "fq_codel"]


def bench_of(places=4, ahead=None, model=Switch, **params):
    """``ahead=0``: nothing is settled before it is in the switch."""
    switch = model(Switch.Params(**params))
    if ahead is not None:
        switch._ahead_ns = -1
    return Bench(switch, places)


def wire_ns(size_bytes, segments=1, rate_bps=GB):
    return airtime_ns(size_bytes + segments * (PREAMBLE_BYTES + GAP_BYTES), rate_bps)


def heard_ns(size_bytes, segments=1):
    """Until the last bit is there: nobody waits for the gap behind it."""
    return wire_ns(size_bytes, segments) - wire_ns(0) * GAP_BYTES // (PREAMBLE_BYTES + GAP_BYTES)


def arrivals(bench):
    return {label: time_ns for time_ns, label, _, _, fate in bench.run() if fate == "arrived"}


# ------------------------------------------------------------------------------------ one at a time


def test_a_packet_is_stored_and_forwarded():
    """871 B and a preamble of 8 B, twice at 1 Gb/s, and two cables: 15.064 us."""
    bench = bench_of()
    bench.send(0, "host_1", "host_2", 871, label="scan")
    assert arrivals(bench) == {"scan": 15_064} == {"scan": 2 * heard_ns(871) + 2 * CABLE_NS}


def test_the_gap_takes_capacity_but_delays_nobody():
    """Of two packets the second begins a gap after the first one's last bit."""
    bench = bench_of()
    for label in "ab":
        bench.send(0, "host_1", "host_2", 1000, label=label)
    got = arrivals(bench)
    assert got["b"] - got["a"] == wire_ns(1000) == heard_ns(1000) + 96


@pytest.mark.parametrize("size_bytes", [20, 63, 64])
def test_short_packets_are_padded(size_bytes):
    bench = bench_of()
    bench.send(0, "host_1", "host_2", size_bytes, label="short")
    bench.send(0, "host_3", "host_4", 1518 + size_bytes, 2, label="train")
    assert arrivals(bench) == {"short": 2 * heard_ns(64) + 2 * CABLE_NS,
                               "train": wire_ns(1518) + heard_ns(1518) + heard_ns(64)
                               + 2 * CABLE_NS}


def test_a_train_is_pipelined():
    """T + t + 2 propagation: store-and-forward costs one packet, not the train again."""
    bench = bench_of()
    bench.send(0, "host_1", "host_2", *STREAM_MAP, label="map")
    assert arrivals(bench) == {"map": heard_ns(*STREAM_MAP) + heard_ns(FULL) + 2 * CABLE_NS}


def test_packets_to_one_exit_wait_for_each_other():
    """Three senders at once: each receiver's own port is free, the common exit serves in turn."""
    bench = bench_of()
    for source in ("host_2", "host_3", "host_4"):
        bench.send(0, source, "host_1", FULL, label=source)
    first_ns = 2 * heard_ns(FULL) + 2 * CABLE_NS
    assert sorted(arrivals(bench).values()) == [first_ns + k * wire_ns(FULL) for k in range(3)]


def test_full_duplex_ports_do_not_hinder_each_other():
    bench = bench_of()
    for source, receiver in [("host_1", "host_2"), ("host_2", "host_1"), ("host_3", "host_4")]:
        bench.send(0, source, receiver, 1000, label=source)
    assert set(arrivals(bench).values()) == {2 * heard_ns(1000) + 2 * CABLE_NS}


def test_hosts_of_one_port_share_its_rate_and_talk_inside():
    bench = bench_of(ports={"node": ["host_1", "host_2"]}, local_latency="20 us")
    bench.send(0, "host_1", "host_2", *STREAM_MAP, label="inside")
    bench.send(0, "host_1", "host_3", 1000, label="one")
    bench.send(0, "host_2", "host_4", 1000, label="other")
    first_ns = 2 * heard_ns(1000) + 2 * CABLE_NS
    got = arrivals(bench)
    assert got["inside"] == 20_000
    assert sorted((got["one"], got["other"])) == [first_ns, first_ns + wire_ns(1000)]


@pytest.mark.parametrize("queue", DISCIPLINES)
def test_a_broadcast_leaves_its_sender_once(queue):
    bench = bench_of(queue=queue)
    bench.send(0, "host_1", ["host_2", "host_3", "host_4"], 1000, broadcast=True)
    bench.send(0, "host_1", "host_2", 1000, label="next")
    first_ns = 2 * heard_ns(1000) + 2 * CABLE_NS
    assert sorted(entry[0] for entry in bench.run()) == [first_ns] * 3 + [first_ns + wire_ns(1000)]


def test_a_packet_that_comes_in_first_does_not_delay_one_that_was_sent_before():
    """The price of settling a packet when it is sent: 600 B that set out 7 us after 1518 B are in
    the switch first, and leave it 5.0 us later; the long packet should wait for that. It does not,
    unless something longer than 0.25 ms is on its way to the exit."""
    def long_packet(ahead):
        bench = bench_of(ahead=ahead)
        bench.send(0, "host_1", "host_3", FULL, label="long")
        bench.send(7000, "host_2", "host_3", 600, label="short")
        return arrivals(bench)["long"]

    assert long_packet(None) == 2 * heard_ns(FULL) + 2 * CABLE_NS
    assert 0 < long_packet(0) - long_packet(None) < wire_ns(600)


# -------------------------------------------------------------------------------------- disciplines


def crossing(queue):
    """Two maps and a scan behind them, all from one port to three others, and one more map."""
    bench = bench_of(queue=queue)
    bench.send(0, "host_1", "host_2", *STREAM_MAP, label="first map")
    bench.send(1, "host_1", "host_3", *STREAM_MAP, label="second map")
    bench.send(2, "host_1", "host_4", 871, label="scan")
    bench.send(3, "host_1", "host_2", *STREAM_MAP, label="third map")
    return arrivals(bench)


def test_first_in_first_out():
    train, last, scan = wire_ns(*STREAM_MAP), heard_ns(FULL) + 2 * CABLE_NS - 96, wire_ns(871)
    assert crossing("pfifo") == {
        "first map": train + last, "second map": 2 * train + last,
        "scan": 2 * train + 2 * heard_ns(871) + 2 * CABLE_NS,
        "third map": 3 * train + scan + last}


def test_flows_in_turn():
    """A packet of a flow that has just begun goes before those of flows that have had a turn. Two
    maps are sent packet by packet in turn, and a third, of the first one's flow, behind it."""
    train, scan = wire_ns(*STREAM_MAP), wire_ns(871)
    rest = wire_ns(STREAM_MAP[0] - (STREAM_MAP[1] - 1) * FULL)
    got = crossing("fq_codel")
    assert got["scan"] == 2 * wire_ns(FULL) + 2 * heard_ns(871) + 2 * CABLE_NS
    assert got["first map"] == 2 * train - rest + scan - 96 + (rest - 96) + 2 * CABLE_NS
    assert got["second map"] == got["first map"] + wire_ns(FULL) + rest
    assert got["third map"] == 3 * train + scan - 96 + heard_ns(FULL) + 2 * CABLE_NS


@pytest.mark.parametrize("quantum", [1514, 4 * 1514])
def test_turns_are_of_bytes(quantum, monkeypatch):
    """While flows of short and of long packets wait, each gets half of the bytes, to a quantum and
    a packet (Shreedhar and Varghese 1995, theorem 1), not half of the packets."""
    monkeypatch.setattr(packet_by_packet, "QUANTUM_BYTES", quantum)
    bench = bench_of(model=PacketByPacket, rate="10 Mb/s")
    for k in range(400):
        bench.send(0, "host_1", "host_2", 1518, label=("long", k))
        bench.send(0, "host_1", "host_3", 300, label=("short", k))
    counts = [0, 0]
    for (kind, _), _ in sorted(arrivals(bench).items(), key=lambda item: item[1]):
        counts[kind == "short"] += 1514 if kind == "long" else 296
        if counts[1] == 400 * 296:
            break
        fair = abs(counts[0] - counts[1]) <= 1514 + 1514
        if not fair:
            break
    assert fair == (quantum == 1514), "the twin has longer turns"


def command_ms(queue, rate):
    """The mean delay of commands: four robots on a node say 10 a second each to a host that
    they also send maps to, as many as its exit carries, and maps among others beside."""
    bench = bench_of(7, rate=rate, queue=queue, ports={
        "node": ["host_1", "host_2", "host_3", "host_4"]})
    commands = Conversation(bench)
    for robot in range(4):
        for k in range(100):
            commands.send(k * 100_000_000 + robot * 23_000_000, robot, 6, 118, 1)
        for k in range(10):
            Conversation(bench).send(k * GB, robot, 6, 161_000, 107)
            Conversation(bench).send(k * GB, robot, 4, 161_000, 107)
    bench.run()
    return sum(commands.took_ns) / len(commands.took_ns) / 1e6


class Conversation(Carrier):
    """A carrier of its own, and so a flow of its own."""

    def __init__(self, bench):
        self.bench, self.took_ns = bench, []

    def send(self, time_ns, source, receiver, size_bytes, segments):
        self.bench.kernel.at(time_ns, Phase.CONTROL, source, lambda _: self.bench.medium.transmit(
            source, (receiver,), size_bytes, segments, False, self, time_ns))

    def arrived(self, token, receiver):
        self.took_ns.append(self.bench.kernel.now_ns - token)


@pytest.mark.parametrize("queue", DISCIPLINES)
def test_a_slower_lan_is_never_the_better_one(queue):
    """At one sender commands get later as its line gets slower, whatever else waits there: behind
    everything (``pfifo``), or for a packet of each flow whose turn is before (``fq_codel``). What
    stood here before let single packets overtake trains at a sender, so that a queue that moved
    from the switch to a sender made them early: 4 Mb/s was better than 10."""
    late_ms = [command_ms(queue, f"{rate} Mb/s") for rate in (40, 20, 10, 5)]
    assert late_ms == sorted(late_ms)
    if queue == "pfifo":
        assert late_ms[-1] > 1000
    else:
        assert late_ms[-1] < 20


# ------------------------------------------------------------------------------------- a full exit


def test_a_full_exit_drops_packets():
    """Ten packets meet at an exit with room for four full ones: one passes through, what comes
    while it is sent waits, the rest is dropped."""
    bench = Bench(Switch(Switch.Params(buffer="6152 B")), 11)
    for i in range(2, 12):
        bench.send(0, f"host_{i}", "host_1", FULL)
    fates = [fate for *_, fate in bench.run()]
    assert fates.count("arrived") == 4
    assert fates.count("queue_full") == 6


def test_a_train_loses_what_does_not_fit():
    """Two trains of 6 come in together at an exit with room for three packets. In each packet's
    time two come and one leaves: from the third pair on one of each is lost, the higher port's."""
    bench = bench_of(ahead=0, buffer=f"{3 * 1538} B")
    for source in ("host_1", "host_2"):
        bench.send(0, source, "host_3", 6 * FULL, 6, label=source)
    assert [fate for *_, fate in bench.run()] == ["arrived in part", "arrived"]
    assert bench.parts == [("host_2", "host_3", dict.fromkeys((2, 3, 4, 5), "queue_full"))]
    assert (bench.medium.packets_delivered, bench.medium.packets_dropped) == (
        8, {"queue_full": 4})


def test_trains_that_overfill_an_exit_lose_packets():
    """Two maps at once bring an exit to half a megabyte of queue at most: 1 MB holds that. 100 kB
    hold 66 packets; of the 886, 443 leave while all come in, and the rest is lost, to one."""
    for queue, lost in [("1 MB", 0), (f"{65 * 1538} B", 443 - 65), ("1538 B", 443)]:
        bench = bench_of(buffer=queue)
        for source in ("host_1", "host_2"):
            bench.send(0, source, "host_3", *STREAM_MAP)
        bench.run()
        assert abs(bench.medium.packets_dropped.get("queue_full", 0) - lost) <= 1


def overloaded(load, senders, gap_share=1.0, packets=101):
    """Periodic senders of 1518 B to one host, at ``load`` of 10 Mb/s. A packet takes as long as in
    ns-3, which has no preamble: 1224 us with the gap."""
    rate_bps = round(1538 * 8 / 1224e-6 * gap_share)
    switch = Switch(Switch.Params(rate=f"{rate_bps} b/s", buffer=f"{packets * 1538} B",
                                  propagation="5 us"))
    hosts = [f"host_{k}" for k in range(senders)]
    flows = [Flow(host, ("sink",), 1518, 1472, "periodic", round(senders * 1214.4e3 / load))
             for host in hosts]
    found = play_case(Setup(switch, dict.fromkeys([*hosts, "sink"], NOWHERE), flows,
                            5 * GB, warm_up_ns=GB))
    return found["loss"], found["delay_p99_ms"]


@pytest.mark.parametrize(("load", "senders"), [(1.2, 5), (2.0, 30)])
def test_a_full_exit_is_that_of_ns3(load, senders, reference):
    """The queue of 100 packets of a bridge's port: loss within 0.001; the delay of a full queue
    within 0.5 %, when the way into the switch is added, which is at 1 Gb/s there and as slow as the
    exit here. Twins: a rate 5 % off, a queue 5 % shorter."""
    with open(reference / "ns3" / "s1_csma_bridge_switch.csv", newline="") as file:
        rows = [row for row in csv.DictReader(file) if int(row["n_senders"]) == senders
                and float(row["offered_load"]) == load and float(row["delay_ms"]) < 1]
    lost = mean(float(row["loss_ratio"]) for row in rows)
    late_ms = mean(float(row["p99_owd_ms"]) for row in rows) + 1.2

    def close(found):
        return abs(found[0] - lost) <= 0.001, abs(found[1] / late_ms - 1) <= 0.005

    assert close(overloaded(load, senders)) == (True, True)
    if load == 1.2:
        assert not close(overloaded(load, senders, gap_share=0.95))[0]
        assert close(overloaded(load, senders, packets=96)) == (True, False)


def test_packet_sizes_add_up():
    assert packet_sizes(1661, 2) == (1518, 143)
    assert packet_sizes(300, 3) == (100, 100, 100)
    assert packet_sizes(3093, 2) == (1547, 1546)
    for size_bytes, segments in [STREAM_MAP, (1, 1), (17, 4), (45_541, 30)]:
        assert sum(packet_sizes(size_bytes, segments)) == size_bytes
        assert len(packet_sizes(size_bytes, segments)) == segments


# -------------------------------------------------------------------------------- packet by packet

sizes = st.one_of(st.just((871, 1)), st.integers(20, 1518).map(lambda size: (size, 1)),
                  st.one_of(st.integers(2, 8), st.integers(2, 120)).map(
                      lambda n: (n * 1518 - 700, n)))
traffic = st.lists(st.tuples(st.one_of(st.just(0), st.integers(0, 2_000_000)), st.integers(1, 4),
                             st.integers(0, 5), sizes), max_size=25)
HOSTS = [f"host_{k}" for k in range(1, 6)]


def play(frames, **params):
    """A frame without a receiver goes to all."""
    bench = bench_of(5, **params)
    for label, (time_ns, source, receiver, (size_bytes, segments)) in enumerate(frames):
        if receiver == 0:
            bench.send(time_ns, f"host_{source}", [h for h in HOSTS if h != f"host_{source}"],
                       size_bytes, segments, label=label, broadcast=True)
        elif source != receiver:
            bench.send(time_ns, f"host_{source}", f"host_{receiver}", size_bytes, segments,
                       label=label)
    bench.run()
    return bench


@settings(max_examples=80, deadline=None)
@given(traffic, st.sampled_from(DISCIPLINES), st.sampled_from(["4 kB", "60 kB", "4 MB"]),
       st.sampled_from([{}, {"node": ["host_1", "host_2"]}]))
def test_trains_are_what_their_packets_are(frames, queue, buffer, ports):
    """To the nanosecond, at a load of up to 25 trains in 2 ms: arrivals, and which packets are
    lost."""
    trains, single = (play(frames, queue=queue, buffer=buffer, ports=ports, ahead=0, **how)
                      for how in ({}, {"model": PacketByPacket}))
    assert sorted(trains.log, key=str) == sorted(single.log, key=str)
    assert trains.parts == single.parts
    assert trains.medium.model.busy_ns(range(5)) == single.medium.model.busy_ns(range(5))


SATURATING = [(k * 1000, 1 + k % 4, 5, (6000, 4)) for k in range(24)] + [
    (k * 1500, 1 + k % 4, 1 + (k + 1) % 4, (300, 1)) for k in range(40)]


@pytest.mark.parametrize(("name", "wrong"), [("QUANTUM_BYTES", 1514 * 93 // 100)])
def test_the_twin_another_quantum_is_seen(name, wrong, monkeypatch):
    def logs():
        return [play(SATURATING, ahead=0, **how).log for how in ({}, {"model": PacketByPacket})]

    trains, single = logs()
    assert trains == single
    monkeypatch.setattr(packet_by_packet, name, wrong)
    trains, single = logs()
    assert trains != single


@pytest.mark.parametrize("model", [Switch, PacketByPacket])
@pytest.mark.parametrize(("buffer_bytes", "held"), [(2 * 1538, 2), (2 * 1538 - 1, 1)])
def test_a_buffer_holds_what_fits_to_the_last_byte(model, buffer_bytes, held):
    """Of three packets that come at once each takes 1538 B of the wire."""
    bench = bench_of(ahead=0, model=model, buffer=f"{buffer_bytes} B")
    for source in ("host_2", "host_3", "host_4"):
        bench.send(0, source, "host_1", FULL, label=source)
    assert len(arrivals(bench)) == held


def test_the_twin_a_smaller_buffer_is_seen():
    lost = [play(SATURATING, ahead=0, buffer=buffer, **how).medium.packets_dropped["queue_full"]
            for buffer, how in (("20 kB", {}), ("20 kB", {"model": PacketByPacket}), ("18 kB", {}))]
    assert lost[0] == lost[1] < lost[2]


@settings(max_examples=60, deadline=None)
@given(traffic, st.sampled_from(DISCIPLINES))
def test_what_is_settled_ahead_is_off_by_less_than_is_stated(frames, queue):
    """Four senders: what three others put into the switch in 0.25 ms, and a packet of each."""
    soon, exact = (play(frames, queue=queue, ahead=ahead) for ahead in (None, 0))
    soon, exact = ({entry[1:4]: entry[0] for entry in bench.log} for bench in (soon, exact))
    assert soon.keys() == exact.keys()
    for label, time_ns in soon.items():
        assert abs(time_ns - exact[label]) <= 4 * wire_ns(FULL) + 3 * 250_000


def at_random(load, size=(871, 1), count=3000):
    """Time, source and destination of frames of one size that eight hosts send to each other."""
    chance = np.random.default_rng(7)
    times_ns = np.cumsum(chance.exponential(wire_ns(*size) / 8 / load, count)).astype(int).tolist()
    pairs = chance.integers(0, 8, (count, 2)).tolist()
    return [(time_ns, source, to) for time_ns, (source, to) in zip(times_ns, pairs, strict=True)
            if source != to]


def mean_delay_ns(packets, ahead, size=(871, 1)):
    bench = bench_of(8, ahead=ahead)
    for number, (time_ns, source, to) in enumerate(packets):
        bench.send(time_ns, f"host_{source + 1}", f"host_{to + 1}", *size, label=number)
    bench.run()
    return np.mean([entry[0] - packets[entry[1]][0] for entry in bench.log])


def mean_delay_in_order_of_sending_ns(packets):
    """Each packet takes its exit's next time when it is sent, whenever it gets there."""
    sent_ns, left_ns, delays_ns = [0] * 8, [0] * 8, []
    for time_ns, source, to in packets:
        sent_ns[source] = max(sent_ns[source], time_ns) + wire_ns(871)
        left_ns[to] = max(left_ns[to], sent_ns[source] + CABLE_NS) + wire_ns(871)
        delays_ns.append(left_ns[to] + CABLE_NS - time_ns)
    return np.mean(delays_ns)


@pytest.mark.parametrize(("load", "share"), [(0.3, 0.01), (0.6, 0.02), (0.9, 0.06)])
def test_on_average_settling_ahead_costs_a_few_per_cent(load, share):
    """The twin serves exits in the order in which packets are sent."""
    packets = at_random(load)
    exact_ns = mean_delay_ns(packets, 0)
    assert mean_delay_ns(packets, None) == pytest.approx(exact_ns, rel=share)
    if load > 0.5:
        assert mean_delay_in_order_of_sending_ns(packets) > (1 + share) * exact_ns


@pytest.mark.parametrize(("load", "share"), [(0.3, 0.08), (0.6, 0.05), (0.9, 0.01)])
def test_on_average_trains_that_are_settled_ahead_are_early_by_a_few_per_cent(load, share):
    """Two trains that meet at an exit interleave; the one that was settled first does not."""
    size = 4554, 3
    packets = at_random(load, size)
    exact_ns = mean_delay_ns(packets, 0, size)
    assert mean_delay_ns(packets, None, size) == pytest.approx(exact_ns, rel=share)


# ------------------------------------------------------------------------------------------- laws


@settings(max_examples=60, deadline=None)
@given(traffic, st.sampled_from(DISCIPLINES), st.sampled_from(["2 kB", "30 kB", "4 MB"]))
def test_every_packet_arrives_or_is_dropped(frames, queue, buffer):
    medium = play(frames, queue=queue, buffer=buffer).medium
    assert medium.in_flight() == 0
    assert medium.packets_intended == (
        medium.packets_delivered + sum(medium.packets_dropped.values()))
    assert buffer != "4 MB" or not medium.packets_dropped


@settings(max_examples=60, deadline=None)
@given(traffic, st.sampled_from(DISCIPLINES))
def test_a_line_works_while_anything_waits(frames, queue):
    """All that a port sends in one go is through when its wire times are over: the last arrives a
    cable, its own storing and what meets it at its exit later, never before."""
    frames = [(0, source, 5, size) for _, source, _, size in frames]
    bench = play(frames, queue=queue, ahead=0)
    into = dict.fromkeys(range(1, 5), 0)
    for _, source, _, size in frames:
        into[source] += sum(max(wire_ns(64), wire_ns(one)) for one in packet_sizes(*size))
    busy_ns = bench.medium.model.busy_ns(range(5))
    assert busy_ns[:4] == list(into.values()) and busy_ns[9] == sum(into.values())
    if frames:
        last_ns = max(entry[0] for entry in bench.log)
        assert max(into.values()) <= last_ns <= sum(into.values()) + max(
            wire_ns(FULL), 0) + 2 * CABLE_NS


@settings(max_examples=60, deadline=None)
@given(traffic, st.sampled_from(DISCIPLINES), st.sampled_from([None, 0]))
def test_what_is_sent_first_arrives_first(frames, queue, ahead):
    """Of one flow in any case, of a port to one exit in ``pfifo``; senders count in order of time,
    and of labels in one instant."""
    frames = [frame for frame in frames if frame[2]]
    pairs = defaultdict(list)
    for time_ns, label, source, receiver, fate in play(frames, queue=queue, ahead=ahead).log:
        assert fate == "arrived"
        pairs[source, receiver].append((time_ns, (frames[label][0], label)))
    for log in pairs.values():
        assert [sent for _, sent in log] == sorted(sent for _, sent in log)


@settings(deadline=None)
@given(traffic, st.sampled_from(["1 kB", "4 kB", "4 MB"]), st.sampled_from(DISCIPLINES))
def test_busy_time_never_falls(frames, buffer, queue):
    bench, seen = bench_of(5, buffer=buffer, queue=queue), []
    for label, (time_ns, source, receiver, (size_bytes, segments)) in enumerate(frames):
        if receiver and source != receiver:
            bench.send(time_ns, f"host_{source}", f"host_{receiver}", size_bytes, segments,
                       label=label)
    for k in range(60):
        bench.kernel.at(k * 100_000, Phase.OBSERVE, 0,
                        lambda _: seen.append(bench.medium.model.busy_ns(range(5))))
    bench.run()
    for before, after in itertools.pairwise(seen):
        assert all(0 <= one <= other for one, other in zip(before, after, strict=True))


@settings(deadline=None)
@given(traffic, st.sampled_from(DISCIPLINES))
def test_nothing_is_faster_than_the_wire(frames, queue):
    bench = play(frames, queue=queue)
    for time_ns, label, *_ in bench.log:
        sent_ns, _, _, (size_bytes, segments) = frames[label]
        assert time_ns >= sent_ns + heard_ns(size_bytes, segments) + 2 * CABLE_NS

"""The Ethernet switch against formulas, and its trains against packets sent one by one."""

import itertools

from hypothesis import given, settings
from hypothesis import strategies as st

from desim.kernel import Phase
from desim.testing import Bench
from desim.units import airtime_ns
from netmodels.ethernet import GAP_BYTES, segment_sizes
from netmodels.switch import Switch

GB = 10**9
CABLE_NS = 500
STREAM_MAP = 671_123, 443  # an 800 x 800 grid over TCPROS: bytes with headers, segments


def bench_of(places=4, **params):
    return Bench(Switch(Switch.Params(**params)), places)


def wire_ns(size_bytes, segments=1, rate_bps=GB):
    return airtime_ns(size_bytes + segments * GAP_BYTES, rate_bps)


def arrivals(bench):
    return {label: time_ns for time_ns, label, _, _, fate in bench.run() if fate == "arrived"}


def test_a_packet_is_stored_and_forwarded():
    """871 B and 20 B of preamble and gap, twice at 1 Gb/s, and two cables: 15.256 us."""
    bench = bench_of()
    bench.send(0, "host_1", "host_2", 871, label="scan")
    assert arrivals(bench) == {"scan": 2 * 7128 + 2 * CABLE_NS}


def test_a_train_is_pipelined():
    """T + t + 2 propagation: store-and-forward costs one packet, not the train again."""
    bench = bench_of()
    bench.send(0, "host_1", "host_2", *STREAM_MAP, label="map")
    assert arrivals(bench) == {"map": wire_ns(*STREAM_MAP) + wire_ns(1518) + 2 * CABLE_NS}


def test_packets_to_one_exit_wait_for_each_other():
    """Three senders at once: each receiver's own port is free, the common exit serves in turn."""
    bench = bench_of()
    for source in ("host_2", "host_3", "host_4"):
        bench.send(0, source, "host_1", 1518, label=source)
    one = wire_ns(1518)
    times_ns = sorted(arrivals(bench).values())
    assert times_ns == [2 * one + 2 * CABLE_NS, 3 * one + 2 * CABLE_NS, 4 * one + 2 * CABLE_NS]


def test_a_packet_that_comes_in_first_does_not_delay_one_that_was_sent_before():
    """The price of settling a packet when it is sent: 600 B that set out 7 us after 1518 B are in
    the switch first, and leave it 5.0 us later; the long packet should wait for the last 4.7 us of
    that. It does not, unless a train is expected there."""
    def long_packet(at_ns):
        bench = bench_of()
        bench.send(at_ns, "host_1", "host_3", 1518, label="long")
        bench.send(at_ns + 7000, "host_2", "host_3", 600, label="short")
        if at_ns:  # a train is expected at the exit: nothing is settled beforehand
            bench.send(0, "host_4", "host_3", 3000, 2, label="train")
        return arrivals(bench)["long"] - at_ns

    early_ns = 2 * wire_ns(1518) + 2 * CABLE_NS
    assert long_packet(0) == early_ns
    assert 0 < long_packet(1) - early_ns <= 3 * wire_ns(1518)


def test_full_duplex_ports_do_not_hinder_each_other():
    bench = bench_of()
    for source, receiver in [("host_1", "host_2"), ("host_2", "host_1"), ("host_3", "host_4")]:
        bench.send(0, source, receiver, 1000, label=source)
    assert set(arrivals(bench).values()) == {2 * wire_ns(1000) + 2 * CABLE_NS}


def test_a_packet_goes_between_two_of_a_trains():
    """It waits for one full packet of the train on its own port, not for five milliseconds, and
    the trains that come after it wait for it."""
    bench = bench_of()
    bench.send(0, "host_1", "host_2", *STREAM_MAP, label="first map")
    bench.send(1, "host_1", "host_3", *STREAM_MAP, label="second map")
    bench.send(2, "host_1", "host_4", 871, label="scan")
    bench.send(3, "host_1", "host_2", *STREAM_MAP, label="third map")
    train, full, scan = wire_ns(*STREAM_MAP), wire_ns(1518), wire_ns(871)
    assert arrivals(bench) == {"first map": train + full + 2 * CABLE_NS,
                               "second map": 2 * train + full + 2 * CABLE_NS,
                               "third map": 3 * train + scan + full + 2 * CABLE_NS,
                               "scan": 2 + full + 2 * scan + 2 * CABLE_NS}


def test_hosts_of_one_port_share_its_rate_and_talk_inside():
    bench = bench_of(ports={"node": ["host_1", "host_2"]}, local_latency="20 us")
    bench.send(0, "host_1", "host_2", *STREAM_MAP, label="inside")
    bench.send(0, "host_1", "host_3", 1000, label="one")
    bench.send(0, "host_2", "host_4", 1000, label="other")
    one = wire_ns(1000)
    got = arrivals(bench)
    assert got["inside"] == 20_000
    assert sorted((got["one"], got["other"])) == [2 * one + 2 * CABLE_NS, 3 * one + 2 * CABLE_NS]


def test_a_broadcast_leaves_its_sender_once():
    bench = bench_of()
    bench.send(0, "host_1", ["host_2", "host_3", "host_4"], 1000, broadcast=True)
    bench.send(0, "host_1", "host_2", 1000, label="next")
    one = wire_ns(1000)
    assert sorted(entry[0] for entry in bench.run()) == [2 * one + 2 * CABLE_NS] * 3 + [
        3 * one + 2 * CABLE_NS]


def test_a_full_exit_drops_packets():
    """Ten packets meet at an exit with room for four full ones: one passes through, what comes
    while it is sent waits, the rest is dropped."""
    bench = Bench(Switch(Switch.Params(queue="6152 B")), 11)
    for i in range(2, 12):
        bench.send(0, f"host_{i}", "host_1", 1518)
    fates = [fate for *_, fate in bench.run()]
    assert fates.count("arrived") == 4
    assert fates.count("queue_full") == 6


def test_trains_that_overfill_an_exit_are_lost():
    """Two maps at once bring an exit to half a megabyte of queue at most: 1 MB holds that, 100 kB
    does not; one map alone needs one packet."""
    for queue, lone, both in [("1 MB", 1, 2), ("100 kB", 1, 0), ("1538 B", 1, 0)]:
        for senders, expected in [(("host_1",), lone), (("host_1", "host_2"), both)]:
            bench = bench_of(queue=queue)
            for source in senders:
                bench.send(0, source, "host_3", *STREAM_MAP)
            assert [fate for *_, fate in bench.run()].count("arrived") == expected


def test_segment_sizes_add_up():
    assert segment_sizes(1661, 2) == (1518, 143)
    assert segment_sizes(300, 3) == (100, 100, 100)
    assert segment_sizes(3093, 2) == (1547, 1546)
    for size_bytes, segments in [STREAM_MAP, (1, 1), (17, 4), (45_541, 30)]:
        assert sum(segment_sizes(size_bytes, segments)) == size_bytes
        assert len(segment_sizes(size_bytes, segments)) == segments


traffic = st.lists(st.tuples(
    st.integers(0, 2_000_000), st.integers(1, 4), st.integers(1, 5),
    st.one_of(st.just((871, 1)), st.integers(64, 1518).map(lambda size: (size, 1)),
              st.one_of(st.integers(2, 8), st.integers(2, 120)).map(
                  lambda n: (n * 1518 - 700, n)))), max_size=25)


@settings(max_examples=120, deadline=None)
@given(traffic)
def test_a_train_is_off_by_less_than_a_packet_of_each_train_that_comes_in(frames):
    """The bounds that the model states: four senders, so no more than four trains come in at once,
    and one full packet is 12.3 us; and 0.1 ms from each of three others for packets that are
    settled when they are sent. The packet-by-packet mode is the measure."""
    logs = []
    for per_segment in (False, True):
        bench = bench_of(places=5, per_segment=per_segment)
        for label, (time_ns, source, receiver, (size_bytes, segments)) in enumerate(frames):
            if source != receiver:
                bench.send(time_ns, f"host_{source}", f"host_{receiver}", size_bytes, segments,
                           label=label)
        logs.append(arrivals(bench))
    trains, packets = logs
    assert trains.keys() == packets.keys()
    for label, time_ns in trains.items():
        assert abs(time_ns - packets[label]) <= 4 * wire_ns(1518) + 3 * 100_000


def test_what_is_foreseen_and_what_is_announced_share_an_exit():
    """A train of eight packets is settled when it is sent, one of nine in the same instant is not:
    both together take as long as packet by packet, and an exit is never busy for less or longer."""
    logs = []
    for per_segment in (False, True):
        bench = bench_of(places=3, per_segment=per_segment)
        for k in range(50):
            bench.send(k * 150_000, "host_1", "host_3", 8 * 1518, 8, label=(k, 8))
            bench.send(k * 150_000, "host_2", "host_3", 9 * 1518, 9, label=(k, 9))
        last_ns = max(arrivals(bench).values())
        logs.append((last_ns, bench.medium.model.busy_ns([2])))
    (trains_ns, trains_busy), (packets_ns, packets_busy) = logs
    assert trains_busy == packets_busy == [0, 50 * 17 * wire_ns(1518)]
    assert abs(trains_ns - packets_ns) <= wire_ns(1518)


@given(traffic, st.sampled_from(["1 kB", "4 kB", "4 MB"]))
def test_busy_time_never_falls(frames, queue):
    bench, seen = bench_of(places=5, queue=queue), []
    for label, (time_ns, source, receiver, (size_bytes, segments)) in enumerate(frames):
        if source != receiver:
            bench.send(time_ns, f"host_{source}", f"host_{receiver}", size_bytes, segments,
                       label=label)
    for k in range(60):
        bench.kernel.at(k * 100_000, Phase.OBSERVE, 0,
                        lambda _: seen.append(bench.medium.model.busy_ns(range(5))))
    bench.run()
    for before, after in itertools.pairwise(seen):
        assert all(0 <= one <= other for one, other in zip(before, after, strict=True))


@given(traffic)
def test_nothing_is_faster_than_the_wire(frames):
    bench, born = bench_of(places=5), {}
    for label, (time_ns, source, receiver, (size_bytes, segments)) in enumerate(frames):
        if source != receiver:
            bench.send(time_ns, f"host_{source}", f"host_{receiver}", size_bytes, segments,
                       label=label)
            born[label] = time_ns + wire_ns(size_bytes, segments) + 2 * CABLE_NS
    for label, time_ns in arrivals(bench).items():
        assert time_ns >= born[label]

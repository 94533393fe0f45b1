"""``ideal``, ``disk`` and ``link`` against closed formulas."""

import math
import random
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim.testing import Bench
from desim.units import airtime_ns
from netmodels.access_link import AccessLink
from netmodels.bus import Bus
from netmodels.disk import Disk
from netmodels.ideal import Ideal

MS = 10**6


def link(**params):
    return AccessLink(AccessLink.Params(**params))


@given(st.integers(1, 10**7), st.integers(1, 10**10), st.integers(0, 10**9))
def test_link_delay_is_size_over_rate_plus_latency(size_bytes, rate_bps, latency_ns):
    bench = Bench(link(rate=f"{rate_bps} b/s", latency=f"{latency_ns} ns"), 2)
    bench.send(0, "host_1", "host_2", size_bytes)
    arrived_ns = bench.run(10**20)[0][0]
    assert 0 <= arrived_ns - latency_ns - Fraction(size_bytes * 8 * 10**9, rate_bps) < 1


def test_link_queue_drops_the_tail():
    """1 ms each at 1 Mb/s: of five at once 375 B hold the one that is being sent and two more; a
    millisecond later there is room again."""
    bench = Bench(link(rate="1 Mb/s", queue="375 B"), 2)
    for label in range(5):
        bench.send(0, "host_1", "host_2", 125, label=label)
    bench.send(MS, "host_1", "host_2", 125, label="later")
    assert [(time_ns // MS, label, fate) for time_ns, label, _, _, fate in bench.run()] == [
        (0, 3, "queue_full"), (0, 4, "queue_full"), (1, 0, "arrived"), (2, 1, "arrived"),
        (3, 2, "arrived"), (4, "later", "arrived")]


def test_link_queue_can_be_counted_in_packets():
    """1 ms for each packet of 125 B: of four at once the first is being sent, two wait, and the
    queue is full. A millisecond later there is room for one of a train's ten, and 2 ms later, since
    that leaves, for one more."""
    bench = Bench(link(rate="1 Mb/s", queue_packets=2), 2)
    for label in range(4):
        bench.send(0, "host_1", "host_2", 125, label=label)
    bench.send(MS, "host_1", "host_2", 1250, 10, label="train")
    bench.send(MS + 1, "host_1", "host_2", 125, label="behind it")
    bench.send(3 * MS, "host_1", "host_2", 125, label="later")
    assert [(time_ns // MS, label, fate) for time_ns, label, _, _, fate in bench.run()] == [
        (0, 3, "queue_full"), (1, 0, "arrived"), (1, "behind it", "queue_full"), (2, 1, "arrived"),
        (3, 2, "arrived"), (4, "train", "arrived in part"), (5, "later", "arrived")]
    assert bench.parts == [("train", "host_2", dict.fromkeys(range(1, 10), "queue_full"))]


def test_a_train_that_is_longer_than_the_room_loses_its_end():
    """Of ten packets of 125 B an idle link with 500 B takes four: what is dropped was never sent.
    The same by packets: one is sent at once, and three wait."""
    for how in ({"queue": "500 B"}, {"queue_packets": 3}):
        bench = Bench(link(rate="1 Mb/s", **how), 2)
        bench.send(0, "host_1", "host_2", 1250, 10, label="train")
        assert bench.run() == [(4 * MS, "train", "host_1", "host_2", "arrived in part")]
        assert bench.parts == [("train", "host_2", dict.fromkeys(range(4, 10), "queue_full"))]
        assert bench.medium.tx_bytes[0] == 500 and bench.medium.refused_bytes == 750


@given(st.lists(st.tuples(st.integers(0, 20 * MS), st.integers(1, 30)), max_size=12),
       st.integers(0, 20), st.sampled_from(["link", "fifo", "csma", "csma_cd"]))
def test_trains_find_the_room_that_their_packets_find(sent, limit, kind):
    """Packets sent at once, as a train or one by one, have the same fates; conserved in packets."""
    def played(single):
        model = link(rate="1 Mb/s", queue_packets=limit) if kind == "link" else Bus(Bus.Params(
            arbitration=kind, rate="1 Mb/s", propagation="0 ns", queue_packets=limit + 1))
        bench = Bench(model, 2)
        for label, (time_ns, packets) in enumerate(sent):
            for k in range(packets if single else 1):
                bench.send(time_ns, "host_1", "host_2", 125 if single else 125 * packets,
                           1 if single else packets, label=(time_ns, label, k))
        bench.run()
        return bench.medium

    train, single = played(False), played(True)
    assert train.packets_dropped == single.packets_dropped
    assert train.packets_delivered == single.packets_delivered
    assert train.packets_intended == train.packets_delivered + sum(train.packets_dropped.values())


def test_link_queues_are_each_hosts_own():
    bench = Bench(link(rate="1 Mb/s", queue_packets=0), 3)
    for source in ("host_1", "host_2", "host_1"):
        bench.send(0, source, "host_3", 125)
    assert sorted((source, fate) for _, _, source, _, fate in bench.run()) == [
        ("host_1", "arrived"), ("host_1", "queue_full"), ("host_2", "arrived")]


def test_a_frame_larger_than_the_queue_passes_an_idle_link():
    bench = Bench(link(rate="1 Mb/s", queue="250 B"), 2)
    bench.send(0, "host_1", "host_2", 12_500)
    assert bench.run()[0][0] == 100 * MS


def mean_wait(load, rate):
    """Poisson frames of 125 B over a link of ``rate``, at ``load`` of 1 Mb/s: the mean wait in ms
    and its standard error, from 20 batches of 2000."""
    draw, time_s, batches = random.Random(11), 0.0, 20
    bench, born = Bench(link(rate=rate), 2), []
    for label in range(2000 * batches):
        time_s += draw.expovariate(load / 0.001)
        born.append(round(time_s * 1e9))
        bench.send(born[-1], "host_1", "host_2", 125, label=label)
    waits = [(time_ns - born[label]) / MS - 1.0 for time_ns, label, *_ in bench.run(10**15)]
    means = [sum(waits[2000 * i:2000 * (i + 1)]) / 2000 for i in range(batches)]
    mean = sum(means) / batches
    return mean, math.sqrt(sum((m - mean) ** 2 for m in means) / (batches - 1) / batches)


@pytest.mark.parametrize("load", [0.3, 0.5, 0.7])
def test_link_is_an_m_d_1_queue(load):
    """Mean wait Lq / lambda = rho / (2 (1 - rho)) service times (Pollaczek-Khinchine), with 99.9 %
    confidence (t = 3.88 of 19 degrees of freedom), which is to be narrower than 15 % of it."""
    mean, error = mean_wait(load, "1 Mb/s")
    assert 3.88 * error < 0.15 * mean
    assert abs(mean - load / (2 * (1 - load))) < 3.88 * error


@pytest.mark.parametrize("load", [0.3, 0.5, 0.7])
def test_the_twin_a_link_of_93_percent_of_the_rate_is_not_that_queue(load):
    mean, error = mean_wait(load, "0.93 Mb/s")
    assert abs(mean - load / (2 * (1 - load))) > 3.88 * error


def test_ideal_is_never_in_the_way():
    bench = Bench(Ideal(Ideal.Params(delay="3 ms")), 3)
    for size_bytes in (100, 10**9):
        bench.send(0, "host_1", ["host_2", "host_3"], size_bytes, broadcast=True)
    assert [time_ns for time_ns, *_ in bench.run()] == [3 * MS] * 4


PLACES = {"a": (0.0, 0.0), "edge": (30.0, 40.0), "beyond": (30.0, 40.001), "none": (math.nan, 0.0)}


def test_disk_reaches_its_edge_and_no_farther():
    bench = Bench(Disk(Disk.Params(range="50 m", rate="1 Mb/s")), PLACES)
    for receiver in ("edge", "beyond", "none"):
        bench.send(0, "a", receiver, 125, label=receiver)
    bench.send(10 * MS, "a", ["beyond", "edge", "none"], 125, label="all", broadcast=True)
    assert [(time_ns // MS, label, receiver, fate)
            for time_ns, label, _, receiver, fate in bench.run()] == [
        (0, "beyond", "beyond", "out_of_range"), (1, "edge", "edge", "arrived"),
        (3, "none", "none", "arrived"), (10, "all", "beyond", "out_of_reach"),
        *((11, "all", receiver, "arrived") for receiver in sorted(
            ("edge", "none"), key=lambda host: bench.names.id(host)))]


@given(st.lists(st.tuples(st.integers(0, 10**7), st.integers(1, 10**5)), min_size=1, max_size=30))
def test_disk_sends_one_frame_after_another(frames):
    """Never before size / rate, never out of order, and busy without a gap while frames wait."""
    bench = Bench(Disk(Disk.Params(rate="54 Mb/s")), 2)
    frames.sort()
    for label, (time_ns, size_bytes) in enumerate(frames):
        bench.send(time_ns, "host_1", "host_2", size_bytes, label=label)
    free_ns, expected = 0, []
    for label, (time_ns, size_bytes) in enumerate(frames):
        free_ns = max(free_ns, time_ns) + airtime_ns(size_bytes, 54 * 10**6)
        expected.append((free_ns, label))
    assert [entry[:2] for entry in bench.run()] == expected


def test_disk_senders_do_not_hinder_each_other():
    bench = Bench(Disk(Disk.Params(rate="1 Mb/s")), 4)
    for source in ("host_1", "host_2", "host_3"):
        bench.send(0, source, "host_4", 125)
    assert [time_ns for time_ns, *_ in bench.run()] == [MS] * 3

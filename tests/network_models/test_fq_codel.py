"""CoDel's control law and the turns of flows, against RFC 8289 and RFC 8290 by hand."""

from math import sqrt
from types import SimpleNamespace

import numpy as np
import pytest
from test_access_points import NOWHERE, S, wifi

from desim.testing import Bench
from netmodels.infrastructure.codel import CoDel
from netmodels.infrastructure.fq_codel import (
    Backlog,
    FqCodel,
    FqCodelConstants,
    memory_bytes,
)
from netmodels.infrastructure.packet_queue import Waiting

MS = 10**6


def packet(flow="a", size_bytes=1500, since_ns=0, number=0):
    hop = SimpleNamespace(trip=SimpleNamespace(flow=flow), receivers=(1,), broadcast=False)
    return Waiting(hop, number, size_bytes, since_ns)


def drops_ms(waits_ms, interval_ms=100, until_ms=1000):
    """The times at which a queue drops that is served every millisecond, packets having waited
    for so long."""
    queue, found = CoDel(5 * MS, interval_ms * MS, 0), []
    for now_ms in range(until_ms):
        while len(queue.waiting) < 100:
            queue.push(packet(since_ns=0))
        queue.waiting = type(queue.waiting)(
            one._replace(since_ns=(now_ms - waits_ms(now_ms)) * MS) for one in queue.waiting)
        dropped = []
        queue.pop(now_ms * MS, dropped)
        found += [now_ms] * len(dropped)
    return found


def law_ms(first_ms, drops, count=1):
    """The times of drops by the control law, each at the next service."""
    times, at_ms = [first_ms], first_ms
    for number in range(count, count + drops - 1):
        at_ms += 100 / sqrt(number)
        times.append(at_ms)
    return times


def test_the_control_law():
    """Packets wait for 5 ms from the start: the first drop comes one interval later, the next ones
    after 100, 70.7, 57.7, 50, ... ms."""
    found = drops_ms(lambda _: 5)
    expected = law_ms(100, len(found))
    assert len(found) > 15
    assert all(0 <= at - due < 1 for at, due in zip(found, expected, strict=True))


def test_the_twin_with_another_interval_drops_at_other_times():
    found = drops_ms(lambda _: 5, interval_ms=110)
    assert not all(0 <= at - due < 1 for at, due in zip(found, law_ms(100, len(found)),
                                                        strict=True))


def test_who_waits_less_loses_nothing_and_one_short_wait_begins_anew():
    assert drops_ms(lambda _: 4) == []
    assert drops_ms(lambda now_ms: 4 if now_ms % 100 == 99 else 50) == []


def test_drops_go_on_where_they_ended_if_that_was_recent():
    """Ten drops, a pause of 50 ms without, and again: the rate is that of the last ones."""
    ends_ms = int(law_ms(100, 10)[-1]) + 2
    found = drops_ms(lambda now_ms: 4 if ends_ms < now_ms < ends_ms + 50 else 9)
    again = found[10:]
    assert len(found[:10]) == 10 and again[0] == ends_ms + 50 + 100
    expected = law_ms(again[0], len(again), count=9)  # 10 less the 1 of the last time
    assert all(0 <= at - due < 1 for at, due in zip(again, expected, strict=True))


def test_the_last_packet_is_never_dropped():
    queue, dropped = CoDel(5 * MS, 100 * MS, 0), []
    for now_ms in range(1000):
        queue.push(packet(since_ns=(now_ms - 50) * MS))
        assert queue.pop(now_ms * MS, dropped) is not None
    assert dropped == []


def served(queue, count, now_ns=0):
    return [queue.pop(now_ns, []).hop.trip.flow for _ in range(count)]


def test_flows_share_bytes_and_not_packets():
    """Packets of 1514 and of 500 B: about three small ones in each turn (RFC 8290, 4.2)."""
    queue = FqCodel(FqCodelConstants())
    queue.push(0, [packet("large", 1514) for _ in range(100)])
    queue.push(0, [packet("small", 500) for _ in range(300)])
    order = served(queue, 200)
    large, small = order.count("large") * 1514, order.count("small") * 500
    assert abs(large - small) <= 2 * 1514


def test_a_flow_that_begins_goes_first_once():
    queue = FqCodel(FqCodelConstants())
    queue.push(0, [packet("bulk", 1514) for _ in range(50)])
    assert served(queue, 10) == ["bulk"] * 10
    queue.push(0, [packet("probe", 100)])
    assert served(queue, 2) == ["probe", "bulk"]
    queue.push(0, [packet("probe", 100)])  # it is no new flow any more: it waits for its turn
    assert "probe" in served(queue, 3)


def test_where_there_is_no_room_the_fattest_flow_loses_half_from_its_head():
    """At most 32 (net/fq_impl.h, fq_flow_drop)."""
    queue = FqCodel(FqCodelConstants(limit=60))
    assert queue.push(0, [packet("thin") for _ in range(10)]) == []
    dropped = queue.push(0, [packet("fat", number=k) for k in range(51)])
    assert [one.number for one, _ in dropped] == list(range(25))
    assert {(one.hop.trip.flow, reason) for one, reason in dropped} == {("fat", "queue_full")}
    queue = FqCodel(FqCodelConstants(limit=1000))
    dropped = queue.push(0, [packet(number=k) for k in range(1001)])
    assert len(dropped) == 32
    queue = FqCodel(FqCodelConstants(memory="15 kB"))
    assert len(queue.push(0, [packet() for _ in range(11)])) == 5


def test_the_queues_of_a_radio_share_its_limits():
    """Linux has one struct fq for all stations (net/mac80211/tx.c, ieee80211_txq_setup_flows): a
    packet for one may cost those of another. Queues with limits of their own drop nothing."""
    backlog = Backlog(60, 16 << 20)
    first, second = (FqCodel(FqCodelConstants(limit=60), backlog) for _ in range(2))
    assert first.push(0, [packet("fat", number=k) for k in range(51)]) == []
    dropped = second.push(0, [packet("thin") for _ in range(10)])
    assert {(one.hop.trip.flow, reason) for one, reason in dropped} == {("fat", "queue_full")}
    assert [one.number for one, _ in dropped] == list(range(25))
    assert second.push(0, [packet("thin") for _ in range(24)]) == []  # there is room again
    apart = [FqCodel(FqCodelConstants(limit=60)) for _ in range(2)]
    assert not any(queue.push(0, [packet() for _ in range(51)]) for queue in apart)


def test_radios_that_do_not_know_vht_keep_less():
    """4 MB, "64 max-size aggregates in 802.11n" (ieee80211_txq_setup_flows), else 16 MB."""
    assert [memory_bytes(standard) >> 20 for standard in ("11g", "11n", "11ac", "11ax")] == [
        4, 4, 16, 16]


@pytest.mark.parametrize("empty", [True, False])
def test_a_flow_that_begins_again_knows_its_last_drops(empty):
    """It drops eight packets, is empty or waits for less than 5 ms, and after 50 ms waits for too
    long again: drops go on at the rate of the last seven."""
    queue, found = FqCodel(FqCodelConstants(target="5 ms", limit=10**6, memory="1 GB")), []
    late = [packet(since_ns=-10 * MS) for _ in range(2000)]
    queue.push(0, late)
    for now_ms in range(1000):
        if now_ms == 520:
            queue.take_out(1)
            queue.push(0, [packet(since_ns=520 * MS)] * (not empty))
        if now_ms == 570:
            queue.push(0, late)
        dropped = []
        queue.pop(now_ms * MS, dropped)
        found += [now_ms] * len(dropped)
    expected = [*law_ms(100, 8), *law_ms(670, len(found) - 8, count=7)]
    assert len(found) > 12 and all(0 <= at - due < 1 for at, due in zip(
        found, expected, strict=True))


def test_what_is_taken_out_is_gone():
    queue = FqCodel(FqCodelConstants())
    queue.push(0, [packet("a"), packet("b")])
    assert len(queue.take_out(2)) == 0 and len(queue.take_out(1)) == 2
    assert queue.pop(0, []) is None


def probe(queue, seconds=10):
    """Delays in ms of a packet to one robot every 20 ms, beside 150 % of what the air carries to
    another one; and how long the last of those packets that arrived has waited, and the reasons of
    losses."""
    bench = Bench(wifi(infrastructure={"queue": queue}), {"a": (5, 0), "b": (0, 5),
                                                          "base": NOWHERE})
    for k in range(seconds * 1000 * 10 // 3):
        bench.send(k * 300_000, "base", "a", 1518, label=k * 300_000)
    for k in range(seconds * 50):
        bench.send(k * 20 * MS, "base", "b", 164, label=k * 20 * MS)
    found = {"a": [], "b": []}
    for time_ns, label, _, receiver, fate in bench.run(seconds * S):
        if fate == "arrived":
            found[receiver].append((time_ns - label) / MS)
    return np.array(found["b"][50:]), found["a"][-1], set(bench.medium.dropped)


def test_bufferbloat():
    """A packet of 1518 B takes 248 us, the acknowledgement and what is around them 145.5 us. The
    radio takes in 54 of them: 12 ms at 54 Mb/s, 225 us each. In order, a probe waits behind all
    500, in turn behind these 54 alone. CoDel brings the flood itself slowly down: it does
    not give way, and fills the 4 MB of all queues."""
    each_ms = (248 + 16 + 28 + 34 + 7.5 * 9) / 1e3
    bloated, last_ms, lost = probe("fifo")
    assert np.median(bloated) == pytest.approx(500 * each_ms, rel=0.02)
    assert last_ms == pytest.approx(500 * each_ms, rel=0.03)
    assert lost == {"downlink_queue_full"}
    fair, _, lost = probe("fq_codel")
    assert np.median(fair) == pytest.approx(54 * each_ms, rel=0.03)
    assert fair.max() < 57 * each_ms and lost == {
        "downlink_codel", "downlink_queue_full"}

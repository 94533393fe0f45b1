"""Aggregates of packets and their block acknowledgements, in the stations and in the radio."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from stations import NS3, air, same_power

from desim import plugins
from desim.errors import InputError
from desim.network.passages import Passages
from desim.testing import Bench, check_network
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.dcf.stations import (
    GIVEN_UP,
    LAPSED,
    NEVER,
    RECEIVED,
    Aggregation,
    Reception,
)
from netmodels.radio.errors import packet_error
from netmodels.radio.high_throughput import high_throughput

N = high_throughput("11n", 20, 1, None, 36)
MCS0, MCS7 = N.rate(6.5), N.rate(65.0)
END_NS = 10**12
ACK_NS, BLOCK_ACK_NS = 28_000, 32_000  # at 24 Mb/s


def stations(power_mw=None, **options):
    return air(N, same_power(3) if power_mw is None else power_mw,
               aggregation=options.pop("aggregation", Aggregation()), **options)


def played(one, until_ns=END_NS):
    """All outcomes up to then."""
    found = []
    while one.next_ns <= until_ns:
        found += one.advance(one.next_ns)
    return found


def test_what_waits_for_one_receiver_goes_at_once():
    """41 packets of 1070 B with their delimiters, each but the last padded to 1072 B, are the most
    within 5.484 ms: 5448 us, as ns-3 sends them. All have arrived at the same time."""
    one = stations()
    for _ in range(60):
        one.enqueue(0, 0, 2, 1066, MCS7)
    found = played(one)
    times = sorted({time_ns for time_ns, *_ in found})
    assert [sum(row[0] == at for row in found) for at in times] == [41, 19]
    assert times[0] == 5_448_000
    later = times[1] - times[0] - N.sifs_ns - BLOCK_ACK_NS - N.difs_ns
    assert (later - N.airtime_ns(18 * 1072 + 1070, MCS7)) % N.slot_ns == 0
    assert one.counts(END_NS).transmitted.tolist() == [2, 0, 0]


def test_what_has_arrived_behind_a_broadcast_is_not_sent_again():
    """The aggregate has the packets in front of and behind a broadcast, which then goes."""
    one = stations()
    for dest in (2, -1, 2):
        one.enqueue(0, 0, dest, 1066, MCS7 if dest >= 0 else 0)
    found = [row for row in played(one) if row[1] == RECEIVED and row[4] == 2]
    assert [row[3] for row in found] == [0, 2, 1]
    assert one.counts(END_NS).transmitted[0] == 2


def test_one_alone_goes_without_a_block():
    one = stations()
    one.enqueue(0, 0, 2, 1066, MCS7)
    assert [row[:2] for row in played(one)] == [(168_000, RECEIVED)]
    assert one.airtimes_ns(10**9)[0].tolist() == [168_000, 0, ACK_NS]


def test_packets_for_others_go_by_themselves_and_frames_keep_their_order():
    one = stations()
    for dest in (1, 2, 1, 2, 1):
        one.enqueue(0, 0, dest, 1066, MCS7, packets=2)
    found = [(position, dest) for _, what, _, position, dest, _ in played(one) if what == RECEIVED]
    assert found == [(0, 1), (2, 1), (4, 1), (1, 2), (3, 2)]
    assert one.counts(END_NS).transmitted.tolist() == [2, 0, 0]


@pytest.mark.parametrize(("aggregation", "sizes"), [
    (Aggregation(packets=5), [5, 5, 2]), (Aggregation(packets=256), [12]),
    (Aggregation(size_bytes=3216), [3] * 4),
    (Aggregation(size_bytes=3213), [2] * 6), (Aggregation(time_ns=500_000), [3] * 4)])
def test_limits_of_an_aggregate(aggregation, sizes):
    """3 * 1072 = 3216 B, of which the last 2 need no padding: 3214 B."""
    one = stations(aggregation=aggregation)
    one.enqueue(0, 0, 2, 1066, MCS7, packets=12)
    played(one)
    assert one.counts(END_NS).transmitted[0] == len(sizes)


@pytest.mark.parametrize(("aggregation", "sizes"), [
    (Aggregation(amsdu_bytes=3839), [4 * 3188]),
    (Aggregation(amsdu_bytes=3154, packets=3), [3 * 3188, 3184]),
    (Aggregation(amsdu_bytes=3153), [6 * 2136]), (Aggregation(amsdu_bytes=1050), [12 * 1072 - 2]),
    (Aggregation(amsdu_bytes=3839, size_bytes=4 * 3188 - 1052), [4 * 3188 - 1052, 1066])])
def test_packets_in_a_row_go_as_one(aggregation, sizes):
    """Of 1036 B without the 30 B around them. With headers of 14 B 1050 B, padded to 1052 B but for
    the last: three are 3154 B, with 30 B around them and the delimiter 3188 B; two are 2102 B, and
    2136 B. What is alone at the end has no delimiter."""
    one = stations(aggregation=aggregation)
    one.enqueue(0, 0, 2, 1066, MCS7, packets=12)
    found = played(one)
    assert one.counts(END_NS).transmitted[0] == len(sizes)
    assert one.airtimes_ns(END_NS)[0][0] == sum(N.airtime_ns(size, MCS7) for size in sizes)
    assert len(found) == 1


@pytest.mark.parametrize("amsdu_bytes", [0, 3839])
def test_what_goes_as_one_is_lost_together(amsdu_bytes):
    """At 23.5 dB, sent once: twelve packets of 1066 B, three in each A-MSDU, of which more
    are lost, as it is as long as one of 3184 B (ns-3's closed form), within 3.3 standard errors."""
    many = 3 if amsdu_bytes else 1
    share = float(packet_error(60, 10 ** 2.35, 3188 if amsdu_bytes else 1072))
    one = stations(snr(23.5), tries=1, limit=12, aggregation=Aggregation(amsdu_bytes=amsdu_bytes))
    lost = []
    for number in range(400):
        one.enqueue(number * 10**8, 0, 1, 1066, MCS7, packets=12)
        own = [packet for _, what, *_, packet in played(one, (number + 1) * 10**8 - 1)
               if what == GIVEN_UP]
        lost.append(own)
        assert amsdu_bytes == 0 or {k for k in range(12) if k // 3 in {p // 3 for p in own}
                                    } == set(own)
    each = 400 * 12 // many
    assert sum(map(len, lost)) / 4800 == pytest.approx(
        share, abs=3.3 * (share * (1 - share) / each) ** 0.5)


def test_what_went_as_one_does_so_again_and_alone():
    """Nobody answers. A third packet, which comes later, is not joined to the first two."""
    one = stations(np.zeros((3, 3)), aggregation=Aggregation(amsdu_bytes=3839), tries=2)
    one.enqueue(0, 0, 2, 1066, MCS0, packets=2)
    first_ns = N.airtime_ns(2132, MCS0)
    played(one, first_ns)
    one.enqueue(first_ns, 0, 2, 1066, MCS0)
    while one.counts(one.next_ns - 1).transmitted[0] < 2:
        played(one, one.next_ns)
    sent_ns = one.airtimes_ns(one.next_ns - 1)[0][0]
    assert sent_ns - first_ns == N.airtime_ns(2136 + 1070, MCS0) != N.airtime_ns(3184, MCS0)


def snr(db):
    """Received powers so far above the noise."""
    return np.full((2, 2), 10 ** ((Reception().noise_dbm + db) / 10))


@pytest.mark.parametrize("aggregation", [
    Aggregation(), Aggregation(packets=256, size_bytes=10**6, time_ns=10**9)])
def test_each_packet_is_lost_by_itself_and_repeated_alone(aggregation):
    """At 23.5 dB 15.3 % of 1000 B at MCS 7 have an error (ns-3's closed form): sent once, packets
    of 1066 B in aggregates, with delimiters, fail as often, within 3.3 standard errors of 6400."""
    share = float(packet_error(60, 10 ** 2.35, 1072))
    one = stations(snr(23.5), tries=1, limit=640, aggregation=aggregation)
    lost = sent = 0
    for _ in range(10):
        now_ns = one.next_ns if one.next_ns < NEVER else sent * 10**6
        one.enqueue(now_ns, 0, 1, 1066, MCS7, packets=640)
        lost += sum(what == GIVEN_UP for _, what, *_ in played(one))
        sent += 640
    assert lost / sent == pytest.approx(share, abs=3.3 * (share * (1 - share) / sent) ** 0.5)


def test_a_block_has_as_many_packets_as_it_may():
    """300 of 100 B: 256 in one of 26.6 kB. Each counts, also those from the 65th on."""
    one = stations(snr(20.5), tries=1, aggregation=Aggregation(packets=256))
    one.enqueue(0, 0, 1, 100, MCS7, packets=300)
    lost = {packet for _, what, *_, packet in played(one) if what == GIVEN_UP}
    assert one.counts(END_NS).transmitted[0] == 2
    assert all(any(k <= packet < k + 50 for packet in lost) for k in range(0, 300, 50))


def test_blocks_of_256_are_of_11ax():
    with pytest.raises(InputError, match=r"\.constants\.aggregate_packets: 11ac has at most 64"):
        DcfRadio.Params(standard="11ac", constants={"aggregate_packets": 65}).aggregated()
    assert DcfRadio.Params(standard="11ax", preset="ns3_3_44").aggregated().packets == 256
    assert DcfRadio.Params(standard="11ax").aggregated().packets == 64


@pytest.mark.parametrize(("params", "text"), [
    ({"standard": "11n", "amsdu": "4066 B"}, "11n has at most 4065 B within aggregates"),
    ({"standard": "11ax", "amsdu": "3839 B", "aggregation": False},
     "only within aggregates; not with aggregation: false"),
    ({"standard": "11g", "amsdu": "3839 B"}, "11g has none; allowed with 11n, 11ac, 11ax")])
def test_amsdus_that_there_are_not(params, text):
    with pytest.raises(InputError, match=rf"^\.amsdu: {text}$"):
        DcfRadio.Params(**params).of_standard()


@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 3_000), st.sampled_from((1, 2)), st.integers(1, 30)),
                min_size=1, max_size=25),
       st.floats(21.0, 24.0), st.integers(1, 4), st.booleans(), st.booleans(),
       st.sampled_from((0, 1600, 3839)), st.sampled_from((5, 64, 256)))
def test_every_packet_has_one_fate_and_frames_arrive_in_order(frames, db, tries, requests, old,
                                                              amsdu_bytes, most):
    power_mw = np.full((3, 3), 10 ** ((Reception().noise_dbm + db) / 10))
    one = stations(power_mw, tries=tries, limit=1000, lifetime_ns=20_000_000 if old else None,
                   aggregation=Aggregation(most, requests=requests,
                                           amsdu_bytes=amsdu_bytes))
    now_ns, given_, lost, over = 0, {}, {}, {1: [], 2: []}

    def take(rows):
        for _, what, _, position, dest, packet in rows:
            if what == RECEIVED:
                over[dest].append(position)
            else:
                assert what in (GIVEN_UP, LAPSED) and packet not in lost.setdefault(position, [])
                lost[position].append(packet)

    for wait_us, dest, packets in frames:
        now_ns += 1000 * wait_us
        take(played(one, now_ns))
        position = one.enqueue(now_ns, 0, dest, 500, MCS7, packets)
        assert one.fit == packets
        given_[position] = dest
    take(played(one))
    for dest in (1, 2):
        assert over[dest] == [position for position, to in given_.items() if to == dest]


def test_who_never_answers_is_given_up():
    """Nobody hears station 0: seven transmissions, and each packet is over."""
    power_mw = same_power(2)
    power_mw[:] = 0.0
    for requests in (False, True):
        one = stations(power_mw, aggregation=Aggregation(requests=requests))
        one.enqueue(0, 0, 1, 1066, MCS7, packets=20)
        found = played(one)
        assert sum(what == GIVEN_UP for _, what, *_ in found) == 20
        assert found[-1][1] == RECEIVED  # it leaves the queue


def test_a_request_comes_first_after_a_collision():
    """Two stations begin together. With requests as in ns-3 the next frame is one of 24 B, without
    the aggregate again: it takes the longer until all have arrived."""
    ends = {}
    for requests in (False, True):
        one = stations(reception=NS3, aggregation=Aggregation(requests=requests))
        for station in (0, 1):
            one.enqueue(0, station, 2, 1066, MCS7, packets=20)
        found = played(one)
        assert sum(what == RECEIVED for _, what, *_ in found) == 2
        ends[requests] = one.counts(END_NS).transmitted.sum()
    assert ends[True] > ends[False]


@pytest.mark.parametrize(("rts_bytes", "guarded"), [(3213, True), (3214, False), (None, False)])
def test_an_aggregate_above_the_threshold_asks_first(rts_bytes, guarded):
    """Three packets are 3214 B with delimiters and padding. RTS and CTS at 6 Mb/s: 52 and 44 us."""
    one = stations(aggregation=Aggregation(rts_bytes=rts_bytes))
    one.enqueue(0, 0, 2, 1066, MCS7, packets=3)
    data_ns = N.airtime_ns(3214, MCS7)
    assert played(one)[0][0] == data_ns + guarded * (52_000 + 44_000 + 2 * N.sifs_ns)
    assert one.airtimes_ns(END_NS)[0].tolist() == [
        data_ns + guarded * 52_000, 0, BLOCK_ACK_NS + guarded * 44_000]


@pytest.mark.parametrize(("db", "mcs"), [(40, 7), (23, 6), (13.5, 3), (5, 0)])
def test_rates_adapt_to_what_arrives_of_an_aggregate(db, mcs):
    """ARF goes to the fastest MCS that half of a packet of 1066 B get through with, by the closed
    form, and tries the next one now and then."""
    schemes = (6, 12, 18, 24, 36, 48, 54, 60)
    half = [k for k, scheme in enumerate(schemes)
            if packet_error(scheme, 10 ** (db / 10), 1072) < 0.5]
    assert half[-1] == mcs
    power_db = 16.0206 - Reception().noise_dbm - db
    bench = Bench(DcfRadio(DcfRadio.Params(**RADIO | {
        "path_loss": {"model": "fixed", "total": f"{power_db} dB"}, "rate_control": {}})), 2)
    for label in range(400):
        bench.send(label * 5_000_000, "host_1", "host_2", 5 * 1046, 5, label)
    bench.run()
    chosen = bench.medium.model.air.stations._arrays.states[0].choices[0, 1]
    assert abs(N.rates[chosen].mcs - mcs) <= 1


def test_broadcasts_go_alone_at_6_mbps():
    one = stations()
    one.enqueue(0, 0, -1, 264, N.rate(6))
    assert played(one)[-1][0] == N.airtime_ns(264, N.rate(6))


RADIO = {"standard": "11n", "channel": 36, "path_loss": {"model": "fixed", "total": "60 dB"}}


def bench_of(*rules, hosts=2, **params):
    return Bench(DcfRadio(DcfRadio.Params(**RADIO | params)), hosts, rules=rules)


@pytest.mark.parametrize("aggregation", [True, False])
def test_a_train_takes_as_long_as_its_aggregate(aggregation):
    """Within 16 slots of backoff for each; alone, each has its acknowledgement."""
    bench = bench_of(aggregation=aggregation)
    bench.send(0, "host_1", "host_2", 40 * 1046, 40, 0)
    bench.run()
    [(arrived_ns, *_)] = bench.log
    rate = bench.medium.model.rate
    alone_ns = N.airtime_ns(1066, rate)
    whole_ns = N.airtime_ns(39 * 1072 + 1070, rate) if aggregation else (
        40 * alone_ns + 39 * (N.sifs_ns + ACK_NS + N.difs_ns))
    assert whole_ns <= arrived_ns <= whole_ns + 39 * 15 * N.slot_ns


@pytest.mark.parametrize(("p", "params"), [(0.3, {}), (0.7, {}), (0.3, {"amsdu": "3839 B"})])
def test_rules_take_single_packets_which_are_repeated(p, params):
    """1 - p^7 of the packets arrive: 3.3 standard errors of 4000."""
    cls = plugins.load("rule", "loss")
    bench = bench_of(cls(cls.Params(probability=p)), **params)
    for label in range(100):
        bench.send(label * 50_000_000, "host_1", "host_2", 40 * 1046, 40, label)
    bench.run()
    medium = bench.medium
    share = medium.packets_delivered / medium.packets_intended
    assert share == pytest.approx(1 - p**7, abs=3.3 * (p**7 * (1 - p**7) / 4000) ** 0.5)
    assert set(medium.dropped) <= {"retry_limit"}


def test_the_parts_of_a_frames_time_add_up():
    """Also of a frame that comes while the one that it goes with is at the head of the queue."""
    passages = Passages()
    bench = Bench(DcfRadio(DcfRadio.Params(**RADIO)), 3, passages=passages)
    for label in range(40):
        bench.send(label * 30_000, "host_1", "host_3", 1046, 1, label)
        bench.send(label * 30_000, "host_2", "host_3", 1046, 1, 100 + label)
    bench.run()
    assert len(bench.spent) == 80
    for *_, taken_ns, stamps in bench.spent:
        assert sum(stamp.time_ns for stamp in stamps) == taken_ns
        assert all(stamp.time_ns >= 0 for stamp in stamps)


@pytest.mark.parametrize("params", [
    {"standard": "11n", "mcs": 7}, {"standard": "11n", "channel": 36, "aggregation": False},
    {"standard": "11ac", "channel": 36, "amsdu": "7935 B", "rate_control": {"model": "ideal"}},
    {"standard": "11ax", "channel": 36, "width": "80 MHz", "streams": 2, "preset": "ns3_3_44"}])
def test_the_radio_keeps_the_contract(params):
    check_network(DcfRadio, **params)


def test_packets_arrive_each_at_its_own_end_where_they_are_apart():
    """Ten packets in equal parts of the aggregate behind its preamble of 36 us (ns-3 hands each on
    when it is over); the block acknowledgement comes when it would otherwise."""

    def sent(apart):
        one = stations(aggregation=Aggregation(apart=apart))
        for _ in range(10):
            one.enqueue(0, 0, 2, 1066, MCS7)
        return [row[0] for row in played(one) if row[1] == RECEIVED], one.airtimes_ns(END_NS)[0]

    (together, on_air), (apart, still_on_air) = sent(False), sent(True)
    first_ns, length_ns = N.rates[MCS7].payload_ns, together[0] - N.rates[MCS7].payload_ns
    assert together == [together[0]] * 10
    assert apart == [first_ns + k * length_ns // 10 for k in range(1, 11)]
    assert on_air.tolist() == still_on_air.tolist()


def test_packets_that_are_apart_wait_for_one_in_front():
    """Some packets have errors: whole frames go on in order, each with its last packet."""

    def arrived(apart):
        one = stations(np.full((3, 3), 10**-7.05), aggregation=Aggregation(apart=apart),
                       reception=Reception())
        for number in range(200):
            one.enqueue(0, 0, 2, 1066, MCS7, packets=1 + number % 3)
        return [(row[0], row[3]) for row in played(one) if row[1] == RECEIVED]

    apart, together = arrived(True), arrived(False)
    assert [position for _, position in apart] == list(range(200))
    assert len({at for at, _ in apart}) > 2 * len({at for at, _ in together})

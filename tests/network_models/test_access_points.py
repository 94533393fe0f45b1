"""Access points: what the air carries twice, and how stations get to one and change it."""

import math
import random

import numpy as np
import pytest
from stations import air, same_power, saturate

from desim.errors import InputError
from desim.netcases.case import play
from desim.ports.cases import Flow, Setup
from desim.scenario.load import from_mapping
from desim.testing import Bench, check_network
from netmodels.radio.radio import Radio
from netmodels.radio.standards import STANDARDS, A, Standard

US, MS, S = 10**3, 10**6, 10**9
UDP = 1046  # 1000 B of UDP: 1064 B on the air
AIR_BYTES = 1064
QUIET = {"beacon_frame": None}
NOWHERE = (math.nan, math.nan)


def wifi(*access_points, standard="11a", infrastructure=None, **params):
    """A radio with access points at (x, channel), by default one at 0 on channel 36."""
    places = access_points or ((0, 36 if standard == "11a" else 1),)
    own = {"wired": ["base"], "constants": QUIET} | (infrastructure or {})
    return Radio.build(Radio.Params(
        standard=standard, infrastructure=own, access_points=[
            {"at": [f"{x} m", "0 m"], "channel": channel} for x, channel in places], **params))


def times_us(standard, sizes, rate_mbps):
    """Data, SIFS and acknowledgement of packets, without the waits before them."""
    rate = standard.rate(rate_mbps)
    return sum(standard.airtime_ns(size, rate) + standard.sifs_ns
               + standard.airtime_ns(14, standard.reply_rate(rate)) for size in sizes) / US


# ----------------------------------------------------------------------------------- the contract


@pytest.mark.parametrize(("standard", "channels", "infrastructure"), [
    ("11g", [1, 6], {"wired": ["host_3"], "constants": {"beacon": "100 s"}}),
    ("11a", [36, 36], {"wired": [], "constants": {"beacon": "100 s", "beacon_frame": None},
                       "security": "open"})], ids=["two channels", "one channel"])
def test_it_keeps_the_contract(standard, channels, infrastructure):
    check_network(Radio, standard=standard, infrastructure=infrastructure, access_points=[
        {"at": [f"{60 * k} m", "0 m"], "channel": channel} for k, channel in enumerate(channels)])


def test_the_same_again():
    def log():
        bench = Bench(wifi(infrastructure={"constants": {}}), {"a": (5, 0), "b": (0, 5),
                                                               "base": NOWHERE})
        for k in range(100):
            bench.send(k * 3 * MS, "ab"[k % 2], ["base", "b", "a"][k % 3] if k % 3 != 1 + k % 2
                       else "base", UDP, label=k)
        return bench.run(S)

    assert log() == log() and len(log()) == 100


@pytest.mark.parametrize("queue", ["fifo", "fq_codel"])
@pytest.mark.parametrize("multicast", ["flood", "unicast"])
def test_every_frame_has_one_fate(queue, multicast):
    """Trains and broadcasts between stations that scan, sleep, stop and start, in short queues."""
    model = wifi((0, 36), (30, 44), queue=20, infrastructure={
        "queue": queue, "multicast": multicast, "power_save": True, "constants": {},
        "fq_codel": {"limit": 20},
        "roaming": {"threshold": "0 dBm", "often": "1 s", "better": "0 dB", "scan": "known"}})
    hosts = {f"h{k}": (5.0 * k, 3.0) for k in range(7)} | {"base": NOWHERE}
    bench = Bench(model, hosts)
    draw, sent = random.Random(1), 0
    for number in range(600):
        source, *others = draw.sample(sorted(hosts), len(hosts))
        several, segments = draw.random() < 0.3, draw.choice([1, 1, 5, 30])
        receivers = others[:3] if several else others[0]
        sent += 3 if several else 1
        bench.send(draw.randrange(6 * S), source, receivers, 1000 * segments, segments, number,
                   several)
    for at_s, up in (2, False), (3, True):
        bench.book(at_s * S, lambda up: bench.medium.switched(1, up), up)
    for at_s, up in (3, False), (4, True):
        bench.book(at_s * S + 1, lambda up: model.switch_access_point("ap_1", up), up)
    log = bench.run(60 * S)
    medium = bench.medium
    assert not medium.in_flight() and len(log) == len({(row[1], row[3]) for row in log}) == sent
    assert medium.packets_intended == medium.packets_delivered + sum(
        medium.packets_dropped.values())
    assert len({*medium.dropped}) >= 3 and medium.delivered > sent / 2


def test_the_radio_has_a_place_for_each_packet_that_it_takes_in():
    """Of packets of 60 B a thousand fill 5 ms of air: more than the radio's queue has places for.
    The others wait in front of it, where FQ-CoDel has places for thousands."""
    bench = Bench(wifi((0, 36), standard="11ax", queue=100),
                  {**{f"h{k}": (4.0 + k, 1.0) for k in range(5)}, "base": NOWHERE})
    for number in range(1000):
        bench.send(S + number * 4 * US, "base", f"h{number % 5}", 60, label=number)
    assert [row[-1] for row in bench.run(2 * S)] == ["arrived"] * 1000


# ---------------------------------------------------------------------------- frames and their way


def busy_us(source, receiver, *access_points, **options):
    """For how long one frame, sent when nobody else sends, keeps the air of each access point."""
    bench = Bench(wifi(*access_points, **options),
                  {"a": (5, 0), "b": (35, 0), "c": (0, 5), "base": NOWHERE})
    broadcast = not isinstance(receiver, str)
    bench.send(S, source, receiver, UDP, broadcast=broadcast)
    bench.run(2 * S)
    assert {fate for *_, fate in bench.log} == {"arrived"}
    return [ns / US for ns in bench.medium.model.busy_ns(range(4))]


def test_robot_to_robot_takes_the_air_twice():
    """180 us of data and 28 us of acknowledgement (24 Mb/s), 16 us apart in which nobody sends. Of
    what others send it hears 4 us less: until it has found the preamble."""
    once = 180 + 28 - 4
    assert times_us(A, [AIR_BYTES], 54) == once + 16 + 4
    assert busy_us("a", "base") == [once]
    assert busy_us("base", "a") == [once]
    assert busy_us("a", "c") == [2 * once]


def test_the_twin_with_two_access_points_takes_each_air_once():
    """They hang on different channels, and each hears its own frame alone."""
    once = 180 + 28 - 4
    assert busy_us("a", "b", (0, 36), (40, 44)) == [once, once]
    both = busy_us("a", "b", (0, 36), (40, 36))
    assert both == [pytest.approx(2 * once, abs=8)] * 2


@pytest.mark.parametrize(("standard", "options", "down_us"), [
    ("11a", {}, A.airtime_ns(AIR_BYTES, A.rate(6)) / US),
    ("11g", {}, 192 + 8 * AIR_BYTES),  # 1 Mb/s, long preamble
    ("11g", {"basic_rates": ["6 Mb/s", "12 Mb/s", "24 Mb/s"]}, 1444 + 6),
    ("11g", {"broadcast_rate": "54 Mb/s"}, 180 + 6)])
def test_a_broadcast_comes_down_once_at_the_lowest_basic_rate(standard, options, down_us):
    """Up as a unicast frame with its acknowledgement, down without."""
    up_us = times_us(STANDARDS[standard], [AIR_BYTES], 54) - STANDARDS[standard].sifs_ns / US - 4
    assert busy_us("a", ["b", "c", "base"], standard=standard, **options) == [
        pytest.approx(up_us + down_us)]


@pytest.mark.parametrize(("multicast", "unicast", "broadcast"), [
    ("flood", 1, (1, 1)), ("snooping", 1, (1, 0)), ("unicast", 3, (0, 0))])
def test_ways_of_multicast(multicast, unicast, broadcast):
    """From one station to two others at the first of two access points; the second one has another
    station, which is no receiver."""
    bench = Bench(wifi((0, 36), (40, 44), infrastructure={"multicast": multicast}),
                  {"a": (5, 0), "b": (0, 5), "c": (0, -5), "d": (40, 5), "base": NOWHERE})
    bench.send(S, "a", ["b", "c"], UDP, broadcast=True)
    assert {fate for *_, fate in bench.run(2 * S)} == {"arrived"}
    once, slow = 180 + 28 - 4, A.airtime_ns(AIR_BYTES, A.rate(6)) / US
    assert [ns / US for ns in bench.medium.model.busy_ns(range(4))] == [
        unicast * once + broadcast[0] * slow, broadcast[1] * slow]


def test_wires_take_their_time():
    """From a wired host to a wired one over two cables of 100 Mb/s: preamble and packet twice."""
    wires = {"rate": "100 Mb/s", "propagation": "1 us"}
    bench = Bench(wifi(infrastructure={"wired": ["base", "server"], "wires": wires}),
                  {"base": NOWHERE, "server": NOWHERE, "a": (5, 0)})
    bench.send(S, "base", "server", UDP)
    (time_ns, *_, fate), = bench.run(2 * S)
    assert fate == "arrived" and time_ns - S == 2 * ((8 + UDP) * 80 + US)


def goodput(source, receiver, **options):
    """Packets a second of a saturated flow, of 10 s."""
    setup = Setup(wifi(**options), {"a": (1, 0), "c": (0, 1), "base": NOWHERE},
                  [Flow(source, (receiver,), UDP, 1000, "saturated", backlog=8)], 11 * S, S)
    return play(setup)["goodput_mbps"] / 8e-3


def test_saturation_through_an_access_point():
    """One station alone: DIFS, 7.5 slots on the average, data and acknowledgement. From robot to
    robot the access point contends with the station for as many packets, so that half of what two
    stations carry arrives."""
    alone = 1e6 / (34 + 7.5 * 9 + times_us(A, [AIR_BYTES], 54))
    assert goodput("a", "base") == pytest.approx(alone, rel=0.01)
    assert goodput("base", "a") == pytest.approx(alone, rel=0.01)
    two = saturate(air(A, same_power(2)), [(0, 1), (1, 0)], AIR_BYTES, A.rate(54), 11.0, 1.0)
    assert goodput("a", "c") == pytest.approx(two.packets_per_s / 2, rel=0.015)


def alone_per_s(standard, slot_us):
    """Packets a second of one station: DIFS, half of the least window, data, acknowledgement."""
    return 1e6 / (standard.sifs_ns / US + (2 + standard.cw_min / 2) * slot_us
                  + times_us(standard, [AIR_BYTES], 54))


def test_an_access_point_of_802_11g_has_short_slots(monkeypatch):
    """All stations have ERP. The twin keeps those that they have ad hoc, of 802.11b."""
    own = STANDARDS["11g"]
    assert goodput("a", "base", standard="11g") == pytest.approx(alone_per_s(own, 9), rel=0.01)
    monkeypatch.setattr(Standard, "with_short_slots", lambda standard: standard)
    assert goodput("a", "base", standard="11g") == pytest.approx(alone_per_s(own, 20), rel=0.01)


def test_slots_of_other_standards_stay():
    for name, slot_ns in ("11a", 9_000), ("11b", 20_000):
        assert STANDARDS[name].with_short_slots().slot_ns == slot_ns


def test_the_twin_with_slots_a_tenth_longer_shows():
    alone = 1e6 / (16 + 2 * 9.9 + 7.5 * 9.9 + times_us(A, [AIR_BYTES], 54))
    assert goodput("a", "base") != pytest.approx(alone, rel=0.01)


# ------------------------------------------------------------------------------ who hangs on whom


def test_who_hangs_on_nothing_sends_nothing_and_gets_nothing():
    bench = Bench(wifi(), {"a": (5, 0), "far": (1e4, 0), "base": NOWHERE, "lost": NOWHERE})
    bench.send(S, "far", "base", UDP, label="from")
    bench.send(S, "a", "lost", UDP, label="to")
    bench.send(S, "base", "far", UDP, label="wired to")
    bench.send(S, "base", ["a", "far"], UDP, label="all", broadcast=True)
    fates = {(label, receiver): fate for _, label, _, receiver, fate in bench.run(2 * S)}
    assert fates == {("from", "base"): "not_associated", ("to", "lost"): "receiver_not_associated",
                     ("wired to", "far"): "receiver_not_associated",
                     ("all", "far"): "receiver_not_associated", ("all", "a"): "arrived"}
    assert bench.medium.refused_bytes == UDP  # the first was never sent


@pytest.mark.parametrize(("security", "frames"), [("open", 4), ("wpa2", 8)])
def test_a_station_that_is_switched_on_scans_and_joins(security, frames):
    """Eleven channels of 64 ms and 28 of 112 ms, then each frame on the air and 1 ms in its
    receiver, the association a tick behind the authentication."""
    bench = Bench(wifi(infrastructure={"associated": False, "security": security}), {
        "a": (5, 0), "base": NOWHERE})
    bench.run(10 * S)
    model = bench.medium.model
    (joined,) = model.associations.handovers
    count, size_bytes = model.control()
    assert count == frames and size_bytes == {"open": 322, "wpa2": 344 + 626}[security]
    scanned_ns = model.associations._stations[0].scanned_ns
    took_ms = (joined.time_ns - scanned_ns) / MS - 11 * 64 - 28 * 112 - 4 - (frames - 2)
    assert 0 < took_ms < 0.3 * (frames - 2)
    assert (joined.left, joined.gap_ns) == (None, joined.time_ns)


def walk(infrastructure, speed_mps=2.0, far_m=60.0):
    """A robot that sends a packet to the base every 10 ms goes from one access point to another,
    40 m apart: the measures, and the handovers. Free space on 5.18 and 5.22 GHz, 16 dBm:
    -65 dBm at 51.6 m, so the threshold is set to what is there at 30 m."""
    model = wifi((0, 36), (40, 44), path_loss={"model": "log_distance", "exponent": 3},
                 rate="6 Mb/s", infrastructure=infrastructure)
    setup = Setup(model, {"robot": (0.0, 0.0), "base": NOWHERE},
                  [Flow("robot", ("base",), 146, 100, "periodic", 10 * MS)], 40 * S, 0,
                  motion={"robot": ((int(far_m / speed_mps * S), far_m, 0.0),)})
    return play(setup), model.associations.handovers


ROAMING = {"threshold": "-70 dBm", "scan": "known"}


def test_a_walk_event_by_event():
    """The mean of the signal, which is rounded down twice, is -71 dBm when -72 dBm come, at 16.0206
    - L1 - 30 log d = -71.5, where L1 = 46.73 dB is free space over 1 m at 5.18 GHz. The scan visits
    both channels, 204 ms apart; then the other one is not yet 8 dB stronger. The next one, 3 s
    later, brings the change."""
    roaming = ROAMING | {"often": "3 s", "better": "8 dB"}
    _, (handover,) = walk({"roaming": roaming})
    weak_m = 10 ** ((16.0206 - 46.73 + 71.5) / 30)  # 22.9 m
    scans = [weak_m / 2.0 + 3 * k for k in range(4)]

    def gain_db(x_m):
        return 30 * math.log10(math.hypot(x_m, 2) / math.hypot(40 - x_m, 2))

    first = next(at for at in scans if gain_db(2 * at) >= 8)
    assert first == scans[1]
    assert (handover.left, handover.access_point) == ("ap_0", "ap_1")
    took_s = 2 * 0.112 + 0.204 + 0.012
    assert first + took_s < handover.time_ns / S < first + took_s + 6 * 0.1024


def test_gaps():
    """802.11r saves the four frames of the handshake: 4 ms in their receivers, and their time on
    the air. An open network takes as long but for the sizes. Each waits for a tick of 4 ms."""
    _, (full,) = walk({"roaming": ROAMING | {"often": "1 s"}})
    _, (fast,) = walk({"roaming": ROAMING | {"often": "1 s"}, "fast_transition": True})
    _, (open_,) = walk({"roaming": ROAMING | {"often": "1 s"}, "security": "open"})
    assert 4 + 6 < full.gap_ns / MS < 4 + 6 + 4
    assert 4 + 2 < fast.gap_ns / MS < 4 + 2 + 3
    assert 4 + 2 < open_.gap_ns / MS < fast.gap_ns / MS
    assert full.gap_ns - fast.gap_ns > 4 * MS


def test_what_a_change_costs():
    """Packets that are sent in the gap are lost."""
    measures, (handover,) = walk({"roaming": ROAMING | {"often": "1 s"}})
    lost = measures["lost"]
    assert set(lost) == {"not_associated"}
    assert abs(lost["not_associated"] - handover.gap_ns / (10 * MS)) <= 2


@pytest.mark.parametrize(("source", "receiver", "period_ms", "lost"), [
    ("robot", "base", 1, set()), ("base", "robot", 3, set()),
    ("base", "robot", 1, {"downlink_queue_full"})])
def test_packets_wait_for_a_scan(source, receiver, period_ms, lost):
    """22 % of them for up to 112 ms, if a scan of two channels begins every second, in the station
    and at the access point, which keeps 64. Without scans nobody waits."""
    p99_ms = {}
    for often in "1 s", None:
        model = wifi((0, 36), (40, 44), infrastructure={"roaming": {
            "threshold": "0 dBm", "scan": "known", "often": often}})
        setup = Setup(model, {"robot": (5.0, 0.0), "base": NOWHERE},
                      [Flow(source, (receiver,), 146, 100, "periodic", period_ms * MS)], 20 * S, 0)
        measures = play(setup)
        p99_ms[often] = measures["delay_p99_ms"]
        assert set(measures["lost"]) == (lost if often else set())
    assert (50 if lost else 100) < p99_ms["1 s"] < (64.5 if lost else 113) and p99_ms[None] < 1


def test_the_twin_that_never_looks_stays_until_it_hears_nothing():
    roaming = {"often": None, "seldom": None}
    measures, handovers = walk({"roaming": roaming})
    assert not handovers and set(measures["lost"]) <= {"retry_limit"}
    _, (handover,) = walk({"roaming": roaming}, speed_mps=20.0, far_m=120.0)
    assert handover.left == "ap_0" and handover.gap_ns > 3.84 * S


def test_what_waits_at_the_access_point_before_is_lost():
    """Frames for a robot go to its old access point until the new one has caught the wires."""
    model = wifi((0, 36), (40, 44), rate="6 Mb/s", infrastructure={"roaming": ROAMING | {
        "often": "1 s"}}, path_loss={"model": "log_distance", "exponent": 3})
    setup = Setup(model, {"robot": (0.0, 0.0), "base": NOWHERE},
                  [Flow("base", ("robot",), 1046, 1000, "periodic", 2 * MS)], 40 * S, 0,
                  motion={"robot": ((30 * S, 60.0, 0.0),)})
    lost = play(setup)["lost"]
    assert set(lost) >= {"retry_limit", "roamed"}
    assert len(model.associations.handovers) == 1


def test_a_host_that_stops_and_starts_joins_again():
    bench = Bench(wifi(), {"a": (5, 0), "base": NOWHERE})
    bench.book(S, lambda up: bench.medium.switched(0, up), False)
    bench.send(2 * S, "a", "base", UDP)
    bench.book(3 * S, lambda up: bench.medium.switched(0, up), True)
    bench.send(9 * S, "a", "base", UDP)
    assert [fate for *_, fate in bench.run(10 * S)] == ["not_associated", "arrived"]
    (joined,) = bench.medium.model.associations.handovers
    assert joined.gap_ns == joined.time_ns - S


# ------------------------------------------------------------------------------------ power save


def delays_ms(power_save, source, receivers, period_ms, count=400, **constants):
    """Delays of packets in ms, in order of sending; all arrive."""
    bench = Bench(wifi(infrastructure={"power_save": power_save, "constants": constants}),
                  {"a": (5, 0), "b": (0, 5), "base": NOWHERE})
    for k in range(count):
        bench.send(S + k * period_ms * MS, source, receivers, UDP, label=S + k * period_ms * MS,
                   broadcast=not isinstance(receivers, str))
    log = bench.run(S + count * period_ms * MS + S)
    assert {fate for *_, fate in log} == {"arrived"}
    return np.array([(time_ns - label) / MS for time_ns, label, *_ in log])


def test_a_frame_for_a_station_that_sleeps_waits_for_a_beacon():
    """One every 337 ms, at any time between two beacons: half an interval on the average, a whole
    one at most, and the frames of waking. What comes within 100 ms of the last frame does not wait;
    neither does what a station sends."""
    slept = delays_ms(True, "base", "a", 337)
    assert slept.mean() == pytest.approx(102.4 / 2, rel=0.1) and 95 < slept.max() < 106
    assert delays_ms(False, "base", "a", 337).max() < 5
    assert np.median(delays_ms(True, "base", "a", 50)) < 1
    assert delays_ms(True, "a", "base", 337).max() < 5


def test_the_twin_with_longer_beacon_intervals_waits_longer():
    assert delays_ms(True, "base", "a", 337, beacon="112.64 ms").mean() > 102.4 / 2 * 1.05


@pytest.mark.parametrize("dtim", [1, 3])
def test_broadcasts_wait_for_a_dtim(dtim):
    slept = delays_ms(True, "base", ["a"], 337, dtim=dtim)
    assert slept.mean() == pytest.approx(dtim * 102.4 / 2, rel=0.12)
    assert slept.max() < dtim * 102.4 + 8


# ----------------------------------------------------------------------------------- bad input


@pytest.mark.parametrize(("params", "text"), [
    ({"access_points": ((0, 40),), "standard": "11g"},
     ".access_points.0.channel: there is no channel 40 of 20 MHz in 2.4 GHz; allowed: "
     "1 to 14"),
    ({"access_points": ((0, 36), (9, 40)), "standard": "11n", "width": "40 MHz"},
     ".access_points.1.channel: 40 overlaps channel 36 of access point 0, which this model knows "
     "nothing of; allowed: the same, or one outside of 36 to 40"),
    ({"access_points": ((0, 36), (9, 37))},
     ".access_points.1.channel: there is no channel 37 of 20 MHz in 5 GHz; allowed: 36, 40, 44, "
     "48, 52, 56, 60, 64, 100, 104, 108, 112, 116, 120, 124, 128, 132, 136, 140, 144, 149, 153, "
     "157, 161, 165"),
    ({"channels": {"a": 44}},
     ".channels: stations take the channels of their access points; allowed: access_points "
     "without it"),
    ({"infrastructure": {"wired": ["bose"]}},
     ".infrastructure.wired.0: 'bose' names no host (did you mean 'base'?); hosts are a, base"),
    ({"infrastructure": {"wires": {"ports": {"p": ["q"]}}}},
     ".infrastructure.wires.ports.p: no host 'q'; hosts are a, base, ap_0")])
def test_what_does_not_fit_is_said(params, text):
    params = dict(params)
    with pytest.raises(InputError) as caught:
        Bench(wifi(*params.pop("access_points", ()), **params), {"a": (5, 0), "base": NOWHERE})
    assert str(caught.value) == text


def test_a_host_with_the_name_of_an_access_point():
    with pytest.raises(InputError) as caught:
        Bench(wifi(), {"ap_0": (5, 0), "base": NOWHERE})
    assert str(caught.value) == (".access_points: a host is called ap_0, as the access points are; "
                               "allowed: another name for the host")


def test_an_access_point_has_the_channel_of_its_radio():
    def channels(**given):
        points = [{"at": ["0 m", "0 m"]}, {"at": ["9 m", "0 m"], "channel": 44}]
        return [one.channel for one in Radio.Params(access_points=points, **given).access_points]

    assert channels(card="pi_4") == channels(standard="11a") == [36, 44]
    assert channels(standard="11n", channel=40) == [40, 44]
    assert channels() == [1, 44]


@pytest.mark.parametrize(("params", "keys"), [
    ({}, []), ({"infrastructure": {"wired": ["base"]}}, [".infrastructure"]),
    ({"access_points": [{"at": ["0 m", "0 m"]}], "fidelity": "disk"}, [".access_points"]),
    ({"access_points": [{"at": ["0 m", "0 m"]}], "channel": 6}, []),  # that of the access point
    ({"access_points": [{"at": ["0 m", "0 m"], "channel": 1}], "channel": 6}, [".channel"])])
def test_keys_without_effect_are_known(params, keys):
    assert [key for unused in Radio.Params(**params).without_effect(None)
            for key in unused.keys] == keys


def test_a_threshold_without_its_minus():
    with pytest.raises(InputError) as caught:
        from_mapping({"name": "x", "deployment": "field", "network": {"media": {"air": {
            "model": "radio", "access_points": [{"at": ["0 m", "0 m"], "channel": 1}],
            "infrastructure": {"roaming": {"threshold": "50 dBm"}}}}}})
    assert str(caught.value) == (
        "scenario: network.media.air.infrastructure.roaming.threshold: must be at most 0 dBm, got "
        "'50 dBm'")

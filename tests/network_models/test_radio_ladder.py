"""The rungs of ``radio``: how far a disk reaches, and where the rungs agree."""

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from stations import LINKS
from test_netmodels_radio import MS, UDP, fates
from test_radio_pathloss import room

from desim import plugins
from desim.errors import InputError
from desim.testing import Bench, check_network
from netmodels.ethernet import FULL_BYTES
from netmodels.ideal import Ideal
from netmodels.multihop import Multihop
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.dcf.stations import Reception
from netmodels.radio.delivery import delivery, sensitivity_dbm
from netmodels.radio.radio import Radio
from netmodels.radio.standards import A, B, G
from netmodels.radio.uncontended import Uncontended, times_ns

FRAMES = 3000
TOLERANCE = 3.3 * math.sqrt(0.9 * 0.1 / FRAMES)  # one chance in a thousand, 0.018

RADIOS = {
    "11g 54": {}, "11g 36": {"rate": "36 Mb/s"}, "11g once": {"retries": 1},
    "11a 54 free": {"standard": "11a", "rate": "54 Mb/s", "power": "20 dBm",
                    "path_loss": {"model": "free_space", "frequency": "5180 MHz"}},
    "11b 11 noisy": {"standard": "11b", "rate": "11 Mb/s",
                     "reception": {"noise_figure": "15 dB", "preamble": "-101 dBm",
                                   "constants": {"preamble_above": "0 dB"}}},
    "11g 54 quiet": {"broadcast_rate": "54 Mb/s", "reception": {"noise_figure": "4 dB"}},
}


def rung(fidelity, **params):
    return Radio.build(Radio.Params(fidelity=fidelity, **params))


def delivered(distance_m, broadcast, between=(), /, **params):
    """The share of frames that the whole model delivers to one receiver, through these walls."""
    bench = Bench(rung("mac", **params), {"a": (0, 0), "b": (distance_m, 0)})
    bench.medium._place.obstacles = room(*between)
    for k in range(FRAMES):
        bench.send(k * 200 * MS, "a", ["b"] if broadcast else "b", FULL_BYTES, broadcast=broadcast)
    return sum(fate == "arrived" for _, fate in fates(bench.run())) / FRAMES


@pytest.mark.parametrize("fidelity", ["ideal", "disk", "walls", "mac"])
@pytest.mark.parametrize("params", [
    {}, {"rate": "6 Mb/s", "queue": 3, "rts": "500 B", "constants": {"lifetime": "5 ms"}},
    {"path_loss": {"model": "fixed", "total": "60 dB"}, "preset": "ns3_3_44"},
    {"shadowing": {}, "channels": {"host_2": 6}}], ids=["default", "queue", "fixed", "channels"])
def test_every_rung_keeps_the_contract(fidelity, params):
    check_network(Radio, fidelity=fidelity, **params)


def test_radio_is_the_ladder_and_each_rung_a_model_of_its_own():
    assert plugins.load("network", "radio") is Radio
    assert [type(rung(name)) for name in ("ideal", "disk", "walls", "mac", "multihop")] == [
        Ideal, Uncontended, Uncontended, DcfRadio, Multihop]


@pytest.mark.parametrize("params", RADIOS.values(), ids=RADIOS)
def test_a_disk_ends_where_nine_of_ten_unicast_frames_arrive(params):
    range_m = rung("disk", **params).range_m[False]
    assert delivered(range_m, False, **params) == pytest.approx(0.9, abs=TOLERANCE)


@pytest.mark.parametrize("params", RADIOS.values(), ids=RADIOS)
def test_the_twin_five_percent_farther_does_not(params):
    range_m = 1.05 * rung("disk", **params).range_m[False]
    assert abs(delivered(range_m, False, **params) - 0.9) > TOLERANCE


def test_walls_shorten_the_disk_by_what_they_cost():
    """Brick and wood take 13 dB, that is 30 log10(d / d0): 37 % of the distance in the open. So far
    is where ``mac`` delivers nine of ten through them and where the rung ``walls`` ends. The twin's
    walls cost 5 % more dB."""
    through_m = rung("walls").range_m[False] * 10 ** (-13 / 30)
    fates_of = {}
    for by_m in (-0.001, 0.001):
        bench = Bench(rung("walls"), {"a": (0, 0), "b": (through_m + by_m, 0)})
        bench.medium._place.obstacles = room("brick", "wood")
        bench.send(0, "a", "b", 100)
        fates_of[by_m] = fates(bench.run())[0][1]
    assert fates_of == {-0.001: "arrived", 0.001: "out_of_range"}
    share = partial(delivered, through_m, False, ("brick", "wood"))
    assert share() == pytest.approx(0.9, abs=TOLERANCE)
    twin = share(walls={"crossing": {"brick": "9.45 dB", "wood": "4.2 dB"}})
    assert abs(twin - 0.9) > TOLERANCE


def test_broadcasts_have_a_disk_of_their_own():
    """At 54 Mb/s as unicast frames, sent once."""
    params = RADIOS["11g 54 quiet"]
    unicast_m, broadcast_m = rung("disk", **params).range_m
    assert broadcast_m < unicast_m
    assert delivered(broadcast_m, True, **params) == pytest.approx(0.9, abs=TOLERANCE)


def test_where_frames_must_be_found_first_the_disk_ends_sharply():
    """6 Mb/s would get over -88 dBm, but nothing is found below -82 dBm."""
    range_m = rung("disk", **LINKS).range_m[True]
    assert range_m == pytest.approx(51.455, abs=0.001)  # 10^((16.0206 - 46.6777 + 82) / 30) m
    assert rung("mac", **LINKS).reach_m == pytest.approx(range_m, rel=1e-6)
    assert [delivered(range_m + by_m, True, **LINKS) for by_m in (-0.001, 0.001)] == [1.0, 0.0]


@pytest.mark.parametrize("standard, rate, mbps", [(A, 0, 6), (A, 7, 54), (B, 3, 11), (G, 9, 36)])
def test_delivery_in_words(standard, rate, mbps):
    """All of it where noise is far below, nothing where the frame is not found, and in between the
    least power for a share is just that (CCK has no errors from 10 dB on)."""
    reception = Reception(preamble_dbm=-100, preamble_db=0)
    assert standard.rates[rate].mbps == mbps
    assert delivery(-40.0, standard, rate, 1536, reception) == 1.0
    assert delivery(np.array([-94.0, -101.0]), standard, rate, 1536, reception).tolist() == [0, 0]
    for share, tries in (0.1, 1), (0.9, 1), (0.9, 7):
        at_dbm = sensitivity_dbm(share, standard, rate, 1536, reception, tries)
        below, at = delivery(np.array([at_dbm - 1e-6, at_dbm]), standard, rate, 1536, reception)
        assert 1 - (1 - below) ** tries < share <= 1 - (1 - at) ** tries


# ------------------------------------------------------------------------------ where rungs agree

RUNGS = ("disk", "walls", "mac")


@pytest.mark.parametrize("size_bytes, segments, broadcast", [
    (100, 1, False), (1518, 1, False), (1518, 1, True)])
@pytest.mark.parametrize("params", [{}, {"standard": "11b", "rate": "11 Mb/s"}, {"rts": "500 B"}],
                         ids=["11g", "11b", "rts"])
def test_a_packet_in_an_idle_medium_takes_as_long_on_every_rung(size_bytes, segments, broadcast,
                                                                params):
    logs = []
    for name in RUNGS:
        bench = Bench(rung(name, **params), {"a": (0, 0), "b": (5, 0)})
        bench.send(MS, "a", ["b"] if broadcast else "b", size_bytes, segments, broadcast=broadcast)
        logs.append(bench.run())
    assert logs[0] == logs[1] == logs[2] and logs[0][0][-1] == "arrived"


B_1999 = replace(B, basic_mbps=(1, 2))  # replies at 2 Mb/s at most, as published


@pytest.mark.parametrize("standard, mbps, published_us", [
    (A, 6, 2233.5), (A, 12, 1197.5), (A, 24, 681.5), (A, 54, 393.5),
    (B_1999, 1, 13154), (B_1999, 2, 6954), (B_1999, 5.5, 3045), (B_1999, 11, 1928)])
def test_the_cycle_of_a_lone_sender(standard, mbps, published_us):
    """1500 B of payload, an acknowledgement, backoffs of 7.5 slots (802.11a) and 15.5 (802.11b).
    The twin has slots that are 1 us longer."""
    rate = standard.rate(mbps)
    assert times_ns(standard, rate, (1518,), False, None)[1] == 1000 * published_us
    twin = replace(standard, slot_ns=standard.slot_ns + 1000)
    assert times_ns(twin, rate, (1518,), False, None)[1] > 1000 * published_us


def last_of_a_full_queue(name, **params):
    bench = Bench(rung(name, queue=1000, **params), {"a": (0, 0), "b": (5, 0)})
    for _ in range(500):
        bench.send(0, "a", "b", 2 * UDP, 2)
    log = bench.run()
    assert {fate for _, fate in fates(log)} == {"arrived"}
    return log[-1][0]


@pytest.mark.parametrize("params", [{}, {"standard": "11b", "rate": "11 Mb/s"},
                                    {"standard": "11a", "rate": "24 Mb/s"}],
                         ids=["11g", "11b", "11a"])
def test_a_sender_alone_has_the_same_rate_on_every_rung(params):
    """Backoffs are those of mean length: 1000 of them are as long as 1000 drawn ones within 3.3
    standard errors, cw / sqrt(12) slots each."""
    disk_ns, walls_ns, mac_ns = (last_of_a_full_queue(name, **params) for name in RUNGS)
    standard = {"11a": A, "11b": B}.get(params.get("standard"), G)
    tolerance_ns = 3.3 * (standard.cw_min + 1) / math.sqrt(12) * standard.slot_ns * math.sqrt(1000)
    assert disk_ns == walls_ns == pytest.approx(mac_ns, abs=tolerance_ns)
    assert 1.05 * disk_ns != pytest.approx(mac_ns, abs=tolerance_ns)


@pytest.mark.parametrize("name", ["ideal", *RUNGS])
def test_nearby_in_the_open_everything_arrives(name):
    bench = Bench(rung(name), {"a": (0, 0), "b": (5, 0), "c": (3, 4)})
    for k in range(50):
        for source in "abc":
            others = [host for host in "abc" if host != source]
            bench.send((3 * k + "abc".index(source)) * 10 * MS, source, others, 800, broadcast=True)
            bench.send((3 * k + "abc".index(source)) * 10 * MS, source, others[k % 2], 8000, 6)
    log = bench.run()
    assert {fate for _, fate in fates(log)} == {"arrived"} and len(log) == 450


def test_nothing_is_in_the_way_of_an_ideal_network():
    bench = Bench(rung("ideal"), {"a": (0, 0), "b": (1e6, 0), "c": (math.nan, 0)})
    bench.send(MS, "a", ["b", "c"], 10**9, 10**6, broadcast=True)
    assert [(time_ns, fate) for time_ns, *_, fate in bench.run()] == [(MS, "arrived")] * 2


def test_only_the_disk_looks_through_walls():
    """20 m: -69.7 dBm, 2.5 dB more than 54 Mb/s needs, and a brick wall costs 9 dB. What goes at 6
    Mb/s gets through."""
    got = {}
    for name in RUNGS:
        bench = Bench(rung(name, **LINKS), {"a": (0, 0), "b": (20, 0)})
        bench.send(0, "a", "b", 1518, label="unicast")
        bench.send(MS, "a", ["b"], 1518, label="broadcast", broadcast=True)
        bench.medium._place.obstacles = room("brick")
        got[name] = {label: fate for _, label, _, _, fate in bench.run()}
    through = {"broadcast": "arrived"}
    assert got == {"disk": through | {"unicast": "arrived"},
                   "walls": through | {"unicast": "out_of_range"},
                   "mac": through | {"unicast": "retry_limit"}}


def test_walls_separate_for_the_monitor_and_a_disk_s_edge_too():
    places = {"a": (0, 0), "b": (30, 0), "c": (0, 51), "d": (0, -52)}
    linked = {}
    for name in ("disk", "walls"):
        bench = Bench(rung(name, **LINKS), places)
        bench.medium._place.obstacles = room("concrete", "concrete")
        linked[name] = bench.medium.linked(np.arange(4))[0, 1:].tolist()
    assert linked == {"disk": [True, True, False], "walls": [False, True, False]}


def test_only_the_disk_looks_through_shadows():
    """On the edge of the disk and 0.5 m inside, two hundred links of one robot each: shadowing of 6
    dB makes some of them worse than path loss, on the rung of walls."""
    near_m = rung("disk").range_m[False] - 0.5
    angle = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    places = {"a": (0, 0)} | {f"b{k}": (near_m * np.cos(at), near_m * np.sin(at))
                              for k, at in enumerate(angle)}
    arrived = {}
    for name in ("disk", "walls"):
        bench = Bench(rung(name, shadowing={"sigma": "6 dB"}), places)
        for k in range(200):
            bench.send(0, "a", f"b{k}", 100)
        arrived[name] = sum(fate == "arrived" for _, fate in fates(bench.run()))
    assert arrived["disk"] == 200 and 60 < arrived["walls"] < 140


@pytest.mark.parametrize("name", RUNGS)
def test_channels_part_on_every_rung(name):
    bench = Bench(rung(name, channels={"b": 6}), {"a": (0, 0), "b": (5, 0), "c": (0, 5)})
    bench.send(0, "a", ["b", "c"], 100, broadcast=True)
    assert sorted(fates(bench.run())) == [("b", "out_of_reach"), ("c", "arrived")]
    assert bench.medium.linked(np.arange(3))[0, 1:].tolist() == [False, True]


def test_what_waits_too_long_expires():
    """Packets of 150 B go every 0.30 ms."""
    bench = Bench(rung("disk", constants={"lifetime": "1 ms"}), {"a": (0, 0), "b": (5, 0)})
    for label in range(5):
        bench.send(0, "a", "b", 150, label=label)
    assert sorted((label, fate) for _, label, _, _, fate in bench.run()) == [
        (0, "arrived"), (1, "arrived"), (2, "arrived"), (3, "arrived"), (4, "expired")]


def test_a_full_queue_refuses_and_has_room_again():
    bench = Bench(rung("disk", queue=2), {"a": (0, 0), "b": (5, 0)})
    for label in range(4):
        bench.send(0, "a", "b", UDP, label=label)
    bench.send(100 * MS, "a", "b", UDP, label="later")
    assert [(label, fate) for _, label, _, _, fate in bench.run()] == [
        (2, "queue_full"), (3, "queue_full"), (0, "arrived"), (1, "arrived"), ("later", "arrived")]


@pytest.mark.parametrize("name", RUNGS)
def test_a_rate_that_the_standard_lacks_is_refused(name):
    with pytest.raises(InputError) as caught:
        Bench(rung(name, standard="11a", rate="11 Mb/s"), 2)
    assert str(caught.value) == (".rate: 11 Mb/s is no rate of 11a; allowed: 6 Mb/s, 9 Mb/s, "
                                 "12 Mb/s, 18 Mb/s, 24 Mb/s, 36 Mb/s, 48 Mb/s, 54 Mb/s")


@pytest.mark.parametrize(("standard", "mcs"), [("11n", 7), ("11ac", 8), ("11ax", 11)])
def test_only_the_rung_mac_aggregates(standard, mcs):
    """A train of 40 full packets. Without aggregation both rungs take the same, but for a backoff
    before each packet (mean 67.5 us) and 2 B of QoS; with it ``mac`` takes about half."""
    def ms(name, aggregation):
        bench = Bench(rung(name, standard=standard, mcs=mcs, channel=36, aggregation=aggregation,
                           path_loss={"model": "fixed", "total": "50 dB"}), 2)
        bench.send(0, "host_1", "host_2", 40 * FULL_BYTES, 40)
        return bench.run()[0][0] / 1e6

    alone = ms("mac", False)
    assert ms("walls", False) == pytest.approx(alone, rel=0.1)
    assert ms("walls", True) == ms("walls", False)
    assert ms("mac", True) < 0.55 * alone

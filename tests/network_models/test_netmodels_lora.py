"""``lora``: published airtimes, Abramson's law, and the rules of class A as small whole logs."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim.errors import InputError
from desim.scenario.load import load
from desim.testing import Bench, check_network
from desim.units import NS_PER_S
from netmodels import lora
from netmodels.lora import HEADERS_BYTES, Lora
from netmodels.lora_modem import MOST_BYTES, SENSITIVITY_DBM, lora_airtime_ns

MS = 10**6
EMPTY = HEADERS_BYTES  # a packet without payload: 13 B of LoRaWAN
UP_NS, DOWN_NS = 46_336_000, 41_216_000  # of these at SF7: 33 and, without CRC, 28 symbols
RX1_NS = NS_PER_S


def bench_of(places=4, **params):
    if isinstance(places, int):
        places = {f"host_{number}": (0.0, 0.0) for number in range(1, places + 1)}
    return Bench(Lora(Lora.Params(**{"gateway": "host_1", **params})), places)


def fates(bench):
    return [(time_ns, label, fate) for time_ns, label, *_, fate in bench.run()]


@pytest.mark.parametrize("params", [{}, {"duty_cycle": 1.0, "channels": 1},
                                    {"spreading_factor": 12, "lifetime": "20 s"}])
def test_it_keeps_the_contract(params):
    check_network(Lora, gateway="host_2", **params)


# ------------------------------------------------------------------------------------- airtimes


@pytest.mark.parametrize(("size_bytes", "spreading", "khz", "published_ms"), [
    (10, 7, 125, 41.216), (10, 11, 125, 577.536),  # rfwireless-world.com, LoRaWAN calculator
    (13, 9, 125, 164.864),  # the spreadsheet to Semtech's AN1200.13
    (64, 12, 125, 2793.472), (255, 7, 500, 99.904)])  # github.com/tanupoo/lorawan_toa, test.py
def test_airtimes_are_those_of_published_calculators(size_bytes, spreading, khz, published_ms):
    assert lora_airtime_ns(size_bytes, spreading, khz) == round(published_ms * MS)


def test_an_airtime_by_hand():
    """13 B at SF7: (104 - 28 + 28 + 16) / 28 = 4.3, so 5 blocks of 5 symbols behind 8, and 12.25 of
    the preamble: 45.25 of 1.024 ms."""
    assert lora_airtime_ns(13, 7, 125) == UP_NS == round(45.25 * 1.024 * MS)
    assert lora_airtime_ns(13, 7, 125, crc=False) == DOWN_NS
    assert lora_airtime_ns(13, 7, 125, coding=4) == round((12.25 + 8 + 5 * 8) * 1.024 * MS)


@given(st.integers(0, 254), st.integers(7, 12), st.sampled_from([125, 250, 500]),
       st.integers(1, 4))
def test_airtimes_grow_with_size_code_and_spreading(size_bytes, spreading, khz, coding):
    air_ns = lora_airtime_ns(size_bytes, spreading, khz, coding)
    assert air_ns <= lora_airtime_ns(size_bytes + 1, spreading, khz, coding)
    assert air_ns > lora_airtime_ns(size_bytes, spreading, 2 * khz, coding)
    if spreading < 12:
        assert air_ns < lora_airtime_ns(size_bytes, spreading + 1, khz, coding)


# ------------------------------------------------------------------------------ pure ALOHA


def assert_as_abramson_says(load, channels, batches=40, size=500, devices=200):
    """Frames as a Poisson process of ``load`` airtimes an airtime, over so many devices that each
    may send again in time. One is alone with probability exp(-2 G / channels): the mean of batches
    within 3 of their standard errors."""
    draw = np.random.default_rng(3)
    times_ns = np.cumsum(draw.exponential(UP_NS / load, batches * size)).astype(int).tolist()
    bench = bench_of(devices + 1, channels=channels)
    for label, time_ns in enumerate(times_ns):
        bench.send(time_ns, f"host_{2 + label % devices}", "host_1", EMPTY, label=label)
    arrived = np.zeros(len(times_ns))
    for _, label, *_, fate in bench.run(10**16):
        arrived[label] = fate == "arrived"
    shares = arrived.reshape(batches, size).mean(axis=1)
    error = shares.std(ddof=1) / math.sqrt(batches)
    assert abs(shares.mean() - math.exp(-2 * load / channels)) <= 3 * error


@pytest.mark.parametrize(("load", "channels"), [(0.1, 1), (0.5, 1), (1.0, 1), (1.0, 3)])
def test_it_carries_what_abramson_says(load, channels):
    assert_as_abramson_says(load, channels)


def test_the_twin_frames_a_tenth_longer_collide_more(monkeypatch):
    monkeypatch.setattr(lora, "lora_airtime_ns", lambda *given: UP_NS * 11 // 10)
    with pytest.raises(AssertionError):
        assert_as_abramson_says(0.5, 1)


# ------------------------------------------------------------------------------ duty cycles


@pytest.mark.parametrize(("duty", "spacing_ns"), [
    ("1 %", 4_633_600_000), ("0.1 %", 46_336_000_000), ("100 %", UP_NS + 2 * NS_PER_S)])
def test_a_device_keeps_its_duty_cycle(duty, spacing_ns):
    """Airtime / duty cycle from begin to begin; at least until the receive windows are over."""
    bench = bench_of(duty_cycle=duty)
    for label in range(5):
        bench.send(label, "host_2", "host_1", EMPTY, label=label)
    assert fates(bench) == [(k * spacing_ns + UP_NS, k, "arrived") for k in range(5)]


def test_a_twin_without_a_duty_cycle_would_be_seen(monkeypatch):
    monkeypatch.setattr(Lora, "_spacing_ns", lambda self, air_ns: air_ns)
    with pytest.raises(AssertionError):
        test_a_device_keeps_its_duty_cycle("1 %", 4_633_600_000)


def test_the_gateway_keeps_its_own():
    """The second window opens 2 s after the first, 2.1216 s too early; the third is the next of
    that device."""
    bench = bench_of()
    bench.send(0, "host_1", "host_2", EMPTY, label="first")
    bench.send(0, "host_1", "host_3", EMPTY, label="second")
    bench.send(10 * NS_PER_S, "host_2", "host_1", EMPTY)
    for time_s in (12, 20):
        bench.send(time_s * NS_PER_S, "host_3", "host_1", EMPTY)
    assert [one for one in fates(bench) if one[1]] == [
        (time_s * NS_PER_S + UP_NS + RX1_NS + DOWN_NS, label, "arrived")
        for time_s, label in ((10, "first"), (20, "second"))]


# ------------------------------------------------------------------------------ class A


def test_a_downlink_waits_for_the_next_uplink_and_one_goes_for_each():
    bench = bench_of()
    for label in ("one", "two"):
        bench.send(0, "host_1", "host_2", EMPTY, label=label)
    for time_s in (60, 90):
        bench.send(time_s * NS_PER_S, "host_2", "host_1", EMPTY)
    assert [one for one in fates(bench) if one[1]] == [
        (time_s * NS_PER_S + UP_NS + RX1_NS + DOWN_NS, label, "arrived")
        for time_s, label in ((60, "one"), (90, "two"))]


def test_a_twin_that_sends_at_once_would_be_seen(monkeypatch):
    wait = Lora._wait

    def hasty(self, packet):
        wait(self, packet)
        self._downlink(packet.receiver)

    monkeypatch.setattr(Lora, "_wait", hasty)
    with pytest.raises(AssertionError):
        test_a_downlink_waits_for_the_next_uplink_and_one_goes_for_each()


def test_from_device_to_device_it_goes_over_the_gateway():
    bench = bench_of()
    bench.send(0, "host_2", "host_3", EMPTY, label="to a device")
    bench.send(30 * NS_PER_S, "host_3", "host_1", EMPTY, label="asks")
    assert fates(bench) == [
        (30 * NS_PER_S + UP_NS, "asks", "arrived"),
        (30 * NS_PER_S + UP_NS + RX1_NS + DOWN_NS, "to a device", "arrived")]


def test_a_downlink_that_nobody_asks_for_expires():
    bench = bench_of(lifetime="5 s")
    bench.send(0, "host_1", "host_2", EMPTY, label="down")
    bench.send(0, "host_2", "host_3", EMPTY, label="over the gateway")
    bench.send(4 * NS_PER_S, "host_2", "host_1", EMPTY, label="up")
    assert fates(bench) == [
        (UP_NS + RX1_NS + DOWN_NS, "down", "arrived"), (4_633_600_000 + UP_NS, "up", "arrived"),
        (UP_NS + 5 * NS_PER_S, "over the gateway", "expired")]


def test_the_gateway_hears_nothing_while_it_sends():
    bench = bench_of(channels=64)
    bench.send(0, "host_1", "host_2", EMPTY, label="down")
    bench.send(0, "host_2", "host_1", EMPTY, label="asks")
    window_ns = UP_NS + RX1_NS
    bench.send(window_ns - 1, "host_3", "host_1", EMPTY, label="begins before")
    bench.send(window_ns + DOWN_NS, "host_4", "host_1", EMPTY, label="begins behind")
    assert {(label, fate) for _, label, fate in fates(bench)} == {
        ("down", "arrived"), ("asks", "arrived"), ("begins before", "gateway_sends"),
        ("begins behind", "arrived")}


def test_queues_are_finite():
    bench = bench_of(queue=2)
    bench.send(0, "host_2", "host_1", 3 * EMPTY, 3, label="train")
    bench.send(0, "host_1", "host_3", EMPTY, label="1st")
    bench.send(0, "host_1", "host_3", EMPTY, label="2nd")
    bench.send(0, "host_1", "host_3", EMPTY, label="3rd")
    bench.send(NS_PER_S, "host_4", "host_3", EMPTY, label="over the gateway")
    found = {label: fate for _, label, fate in fates(bench)}
    assert (found["3rd"], found["over the gateway"]) == ("queue_full", "gateway_full")
    assert bench.parts[0] == ("train", "host_1", {2: "queue_full"})


def test_a_broadcast_gets_to_the_gateway_alone():
    bench = bench_of()
    bench.send(0, "host_2", ["host_1", "host_3"], EMPTY, label="up", broadcast=True)
    bench.send(0, "host_1", ["host_2", "host_3"], EMPTY, label="down", broadcast=True)
    assert sorted((label, receiver, fate) for _, label, _, receiver, fate in bench.run()) == [
        ("down", "host_2", "no_multicast"), ("down", "host_3", "no_multicast"),
        ("up", "host_1", "arrived"), ("up", "host_3", "no_multicast")]


# ------------------------------------------------------------------------------ air


@pytest.mark.parametrize("spreading", MOST_BYTES)
def test_what_eu868_does_not_allow_is_too_long(spreading):
    bench = bench_of(spreading_factor=spreading)
    for label, more in enumerate((0, 1)):
        bench.send(0, f"host_{2 + label}", "host_1", EMPTY + MOST_BYTES[spreading] + more,
                   label=label)
    assert {(label, fate) for _, label, fate in fates(bench)} == {(0, "arrived"), (1, "too_long")}


@pytest.mark.parametrize(("far_m", "stronger"), [(14.0, "collision"), (20.0, "arrived")])
def test_a_signal_that_is_6_db_stronger_survives(far_m, stronger):
    """log_distance with exponent 3: 10 m against 14 m are 4.4 dB, against 20 m 9.0 dB."""
    bench = bench_of({"host_1": (0, 0), "near": (10, 0), "far": (far_m, 0)}, channels=1)
    bench.send(0, "near", "host_1", EMPTY, label="near")
    bench.send(UP_NS - 1, "far", "host_1", EMPTY, label="far")
    assert [(label, fate) for _, label, fate in fates(bench)] == [
        ("near", stronger), ("far", "collision")]


@pytest.mark.parametrize("khz", SENSITIVITY_DBM)
@pytest.mark.parametrize("spreading", MOST_BYTES)
def test_it_reaches_as_far_as_the_sensitivity(spreading, khz):
    """14 dBm less 31.2 dB of the first metre and 30 dB for each decade of distance."""
    first_db = 20 * math.log10(4 * math.pi * 868.1e6 / 299_792_458)
    budget_db = 14 - SENSITIVITY_DBM[khz][spreading - 7]
    reach_m = 10 ** ((budget_db - first_db) / 30)
    bench = bench_of({"host_1": (0, 0), "in": (0.999 * reach_m, 0), "out": (0, 1.001 * reach_m),
                      "lost": (math.nan, math.nan)},
                     spreading_factor=spreading, bandwidth=f"{khz} kHz")
    for label, host in enumerate(("in", "out", "lost")):
        bench.send(label * 10 * NS_PER_S, host, "host_1", EMPTY, label=host)
    assert {(label, fate) for _, label, fate in fates(bench)} == {
        ("in", "arrived"), ("out", "out_of_range"), ("lost", "out_of_range")}


def test_a_gateway_must_be_there():
    with pytest.raises(InputError) as refused:
        bench_of({"base": (0.0, 0.0), "robot_0": (0.0, 0.0)}, gateway="bas")
    assert str(refused.value) == ".gateway: no host 'bas' (did you mean 'base'?)"


@pytest.mark.parametrize(("params", "says"), [
    ("gateway: robot_0, duty_cycle: 0", "3:79: network.media.air.duty_cycle: must be above 0, got "
                                        "0"),
    ("gateway: robot_0, spreading_factor: 13", "3:85: network.media.air.spreading_factor: must be "
                                               "at most 12, got 13"),
    ("gateway: robot_0, bandwidth: 100 kHz", "3:78: network.media.air.bandwidth: '100 kHz' is not "
     "allowed (did you mean '500 kHz'?); allowed: 125 kHz, 250 kHz, 500 kHz"),
    ("spreading_factor: 7", "3:30: network.media.air: the key 'gateway' is missing: the host that "
                            "is the gateway and the server")])
def test_bad_parameters_are_named_with_their_places(params, says, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "case.yaml").write_text("name: x\ndeployment: field\nnetwork: {media: {lan: null, "
                                        f"air: {{model: lora, {params}}}}}}}\n")
    with pytest.raises(InputError) as refused:
        load("case.yaml")
    assert str(refused.value) == f"case.yaml:{says}"

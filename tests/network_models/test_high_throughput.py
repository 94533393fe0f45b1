"""Rates, preambles and airtimes of 802.11n, ac and ax against the standards' tables and ns-3."""

import pytest

from desim.errors import InputError
from desim.testing import Bench
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.errors import packet_error
from netmodels.radio.high_throughput import high_throughput

N, N_SHORT, N40 = ("11n", 20, 1, 800), ("11n", 20, 1, 400), ("11n", 40, 2, 400)
AC80, AC160, AX, AX80 = ("11ac", 80, 1, 800), ("11ac", 160, 2, 400), ("11ax", 20, 1, 800), (
    "11ax", 80, 2, 800)


def standard_of(name, width_mhz=20, streams=1, guard_ns=None, channel=36):
    return high_throughput(name, width_mhz, streams, guard_ns, channel)


def mbps_of(standard):
    return [rate.mbps for rate in standard.rates if rate.mcs is not None]


@pytest.mark.parametrize(("what", "mbps"), [
    # 802.11-2016, tables 19-27 and 19-34 (MCS 8 to 15 are two streams); 21-37 and 21-54
    (N, [6.5, 13, 19.5, 26, 39, 52, 58.5, 65]),
    (N_SHORT, [7.2, 14.4, 21.7, 28.9, 43.3, 57.8, 65, 72.2]),
    (N40, [30, 60, 90, 120, 180, 240, 270, 300]),
    (AC80, [29.3, 58.5, 87.8, 117, 175.5, 234, 263.3, 292.5, 351, 390]),
    (AC160, [130, 260, 390, 520, 780, 1040, 1170, 1300, 1560, 1733.3]),
    (("11ac", 20, 1, 800), [6.5, 13, 19.5, 26, 39, 52, 58.5, 65, 78]),  # no MCS 9
    # 802.11ax-2021, 27.5: 242 tones and 996 tones, whole bits a symbol
    (AX, [8.6, 17.2, 25.8, 34.4, 51.6, 68.8, 77.4, 86, 103.2, 114.7, 129, 143.4]),
    (AX80, [72.1, 144.1, 216.2, 288.2, 432.4, 576.5, 648.5, 720.6, 864.7, 960.7, 1080.9, 1201]),
    (("11ax", 20, 1, 3200), [7.3, 14.6, 21.9, 29.3, 43.9, 58.5, 65.8, 73.1, 87.8, 97.5, 109.7,
                             121.9]),
])
def test_rates_are_those_of_the_tables(what, mbps):
    assert mbps_of(standard_of(*what)) == pytest.approx(mbps, abs=0.051)


@pytest.mark.parametrize(("what", "us"), [
    # legacy 20 us; HT: SIG 8, STF 4, LTF 4; VHT: SIG-A 8, STF 4, LTF 4, SIG-B 4; HE: RL-SIG 4,
    # SIG-A 8, STF 4, LTF 6.4 (from 3.2 us on 12.8) and the guard interval
    (N, 36), (("11n", 20, 2, 800), 40), (("11n", 20, 3, 800), 48), (("11n", 20, 4, 800), 48),
    (AC80, 40), (("11ac", 80, 2, 800), 44), (AX, 43.2), (("11ax", 20, 1, 1600), 44),
    (("11ax", 20, 1, 3200), 52), (("11ax", 20, 2, 800), 50.4)])
def test_preambles(what, us):
    assert standard_of(*what).rates[-1].payload_ns == us * 1000


@pytest.mark.parametrize(("what", "mcs", "size_bytes", "us"), [
    # traced in ns-3 3.44: packets of 1000 B of UDP, alone and aggregated
    (N, 7, 1066, 168), (N, 4, 1066, 256), (N, 0, 1066, 1352), (N, 7, 43_950, 5448),
    (N, 4, 25_726, 5316), (N, 0, 4286, 5316), (N_SHORT, 7, 1066, 154.8),
    (("11n", 40, 1, 800), 7, 65_390, 3912)])
def test_airtimes_are_those_of_ns3(what, mcs, size_bytes, us):
    standard = standard_of(*what)
    rate = [one.mcs for one in standard.rates].index(mcs)
    assert standard.airtime_ns(size_bytes, rate) == us * 1000


@pytest.mark.parametrize(("mcs", "reply_mbps"), [(0, 6), (1, 12), (2, 12), (3, 24), (7, 24)])
def test_replies_go_at_the_rate_that_the_mcs_stands_for(mcs, reply_mbps):
    """802.11-2016, table 10-7: QPSK 3/4 counts as 18 Mb/s, 16-QAM 1/2 as 24 Mb/s."""
    standard = standard_of("11n")
    rate = [one.mcs for one in standard.rates].index(mcs)
    assert standard.rates[standard.reply_rate(rate)].mbps == reply_mbps


def test_best_effort_waits_for_three_slots():
    """802.11-2016, table 9-137: AIFSN 3 of AC_BE; 10.3.2.3.5: SIFS + 3 slots."""
    assert standard_of("11n").difs_ns == 43_000
    assert standard_of("11n", channel=6).difs_ns == 10_000 + 27_000


def test_bands_are_by_channel():
    assert standard_of("11n", channel=6).carrier_hz(6) == 2.437e9
    assert standard_of("11n", channel=36).carrier_hz(36) == 5.18e9
    assert standard_of("11ac", 80, channel=6).band_hz == 5e9


def test_without_a_channel_it_is_the_first_of_the_band():
    assert {name: DcfRadio.Params(standard=name, mcs=None).channel for name in (
        "11a", "11b", "11g", "11n", "11ac", "11ax")} == {
        "11a": 36, "11b": 1, "11g": 1, "11n": 1, "11ac": 36, "11ax": 1}


@pytest.mark.parametrize(("one", "other", "allowed"), [
    (("11ac", 80, 48), ("11ac", 80, 52), None),  # 5170 to 5250, and from there on
    (("11ac", 80, 36), ("11ac", 80, 48), "the same, or one outside of 36 to 48"),
    (("11ac", 80, 36), ("11ac", 80, 36), None),  # the same
    (("11ac", 20, 40), ("11ac", 80, 36), "the same, or one outside of 36 to 48"),
    (("11ac", 80, 36), ("11ac", 20, 40), "the same, or one outside of 40 to 40"),
    (("11ac", 20, 36), ("11ac", 20, 40), None),
    (("11ac", 160, 64), ("11ac", 160, 100), None),
    (("11n", 20, 1), ("11n", 20, 5), "the same, or 5 and more apart"),
    (("11n", 20, 1), ("11n", 20, 6), None),
    (("11n", 40, 1), ("11n", 40, 8), "the same, or 8 and more apart"),
    (("11n", 40, 1), ("11n", 40, 9), None)])
def test_channels_overlap_where_their_spectra_do(one, other, allowed):
    """IEEE 802.11-2020, table E-4, classes 115 to 130: 80 MHz of channels 36 to 48, 52 to 64."""
    standards = [high_throughput(name, width, 1, None, channel) for name, width, channel in
                 (one, other)]
    assert standards[0].overlap(one[2], standards[1], other[2]) == allowed


@pytest.mark.parametrize(("scheme", "db", "error"), [
    (60, 23, .511344), (60, 24, .0354768), (72, 27.5, .679143), (72, 28.5, .0658242),
    (80, 28.5, .877436), (80, 29.5, .118537), (90, 33.5, .494229), (100, 35, .305235)])
def test_errors_of_faster_codes_are_those_of_ns3(scheme, db, error):
    """ns-3 3.44, NistErrorRateModel, 8000 bits: HT MCS 7, VHT MCS 8 and 9, HE MCS 10 and 11."""
    assert packet_error(scheme, 10 ** (db / 10), 1000) == pytest.approx(error, rel=1e-4)


ALLOWED = ("36, 40, 44, 48, 52, 56, 60, 64, 100, 104, 108, 112, 116, 120, 124, 128, 132, 136, 140, "
           "144, 149, 153, 157, 161")


@pytest.mark.parametrize(("given", "allowed"), [
    ({"standard": "11n", "channel": 15}, f"{ALLOWED}, 165"),
    ({"standard": "11ac", "channel": 1}, f"{ALLOWED}, 165"),
    ({"standard": "11n", "channel": 37}, f"{ALLOWED}, 165"),
    ({"standard": "11n", "channel": 165, "width": "40 MHz"},
     f"{ALLOWED}; channel 165 has at most 20 MHz"),
    ({"standard": "11ac", "channel": 165, "width": "80 MHz"},
     f"{ALLOWED}; channel 165 has at most 20 MHz"),
    ({"standard": "11ax", "channel": 132, "width": "160 MHz"}, ALLOWED[:-len(
        ", 132, 136, 140, 144, 149, 153, 157, 161")] + "; channel 132 has at most 80 MHz")])
def test_a_channel_has_a_place_in_the_table_for_its_width(given, allowed):
    """IEEE 802.11-2020, table E-4: 165 is alone; the twin on channel 100 goes."""
    with pytest.raises(InputError) as said:
        Bench(DcfRadio(DcfRadio.Params(**given)), 2)
    assert str(said.value) == (
        f".channel: there is no channel {given['channel']} of {given.get('width', '20 MHz')} in "
        f"5 GHz; allowed: {allowed}")
    Bench(DcfRadio(DcfRadio.Params(**given | {"channel": 100})), 2)


@pytest.mark.parametrize(("given", "error"), [
    ({"standard": "11g", "mcs": 7}, ".mcs: 11g has none; allowed with 11n, 11ac, 11ax"),
    ({"standard": "11a", "width": "40 MHz"}, ".width: 11a has none; allowed with 11n, 11ac, 11ax"),
    ({"standard": "11n", "mcs": 8},
     ".mcs: 11n has no 8 with this width and these streams; allowed: 0, 1, 2, 3, 4, 5, 6, 7"),
    ({"standard": "11ac", "mcs": 9, "channel": 36}, ".mcs: 11ac has no 9 with this width and these "
     "streams; allowed: 0, 1, 2, 3, 4, 5, 6, 7, 8"),
    ({"standard": "11n", "width": "80 MHz"},
     ".width: 11n has no channels of 80 MHz; allowed: 20 MHz, 40 MHz"),
    ({"standard": "11ax", "width": "80 MHz", "channel": 1}, ".width: channel 1 is in 2.4 GHz, "
     "which has no channels of 80 MHz; allowed: 20 MHz, 40 MHz, or a channel of 5 GHz"),
    ({"standard": "11n", "guard_interval": "1600 ns"},
     ".guard_interval: 11n has none of 1600 ns; allowed: 800 ns, 400 ns"),
    ({"standard": "11n", "rate": "24 Mb/s"}, ".rate: 11n has an mcs instead"),
    ({"standard": "11n", "channel": 36, "broadcast_rate": "65 Mb/s"},
     ".broadcast_rate: 65 Mb/s is no rate of 11n; allowed: 6 Mb/s, 9 Mb/s, 12 Mb/s, 18 Mb/s, "
     "24 Mb/s, 36 Mb/s, 48 Mb/s, 54 Mb/s"),
])
def test_what_a_standard_has_not_is_an_error(given, error):
    with pytest.raises(InputError) as said:
        DcfRadio.Params(**given).rates()
    assert str(said.value) == error


def test_noise_is_that_of_the_width():
    """k T B: four times 20 MHz has 6 dB more."""
    narrow, wide = (DcfRadio.Params(standard="11ax", channel=36, width=width).receiver()
                    for width in ("20 MHz", "80 MHz"))
    assert wide.noise_dbm - narrow.noise_dbm == pytest.approx(6.02, abs=0.01)
    assert wide.preamble_dbm - narrow.preamble_dbm == pytest.approx(6.02, abs=0.01)

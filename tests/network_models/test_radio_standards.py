"""Airtimes and interframe spaces against published ones."""

from dataclasses import replace

import pytest

from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.standards import ACK_BYTES, RTS_BYTES, A, B, G, psdu_bytes


@pytest.mark.parametrize(("standard", "mbps", "size_bytes", "us"), [
    # 802.11b with long preamble: 1500 B of payload, and acknowledgements (Bianchi's inputs in ns-3)
    (B, 1, 1536, 12480), (B, 2, 1536, 6336), (B, 5.5, 1536, 2427), (B, 11, 1536, 1310),
    (B, 1, ACK_BYTES, 304), (B, 2, ACK_BYTES, 248),
    # OFDM: T = 20 + 4 ceil((22 + 8 B) / (4 R))
    (A, 6, 1536, 2072), (A, 12, 1536, 1048), (A, 24, 1536, 536), (A, 54, 1536, 248),
    (A, 6, ACK_BYTES, 44), (A, 12, ACK_BYTES, 32), (A, 24, ACK_BYTES, 28),
    (A, 6, 1064, 1444), (A, 24, 1064, 376), (A, 6, RTS_BYTES, 52), (A, 6, 264, 376),
    (G, 54, 1064, 186), (G, 24, ACK_BYTES, 34), (G, 1, 264, 2304),
])
def test_airtime(standard, mbps, size_bytes, us):
    assert standard.airtime_ns(size_bytes, standard.rate(mbps)) == us * 1000


@pytest.mark.parametrize(("standard", "mbps", "reply_mbps"), [
    (A, 6, 6), (A, 9, 6), (A, 12, 12), (A, 18, 12), (A, 24, 24), (A, 54, 24),
    (B, 1, 1), (B, 2, 2), (B, 5.5, 5.5), (B, 11, 11), (G, 11, 11), (G, 6, 6),
    (G, 54, 24), (replace(B, basic_mbps=(1, 2)), 11, 2), (replace(A, basic_mbps=(24,)), 12, 6)])
def test_replies_go_at_the_highest_basic_rate_not_above_the_frames(standard, mbps, reply_mbps):
    assert standard.rates[standard.reply_rate(standard.rate(mbps))].mbps == reply_mbps


@pytest.mark.parametrize(("standard", "difs_us", "eifs_us"),
                         [(A, 34, 94), (B, 50, 364), (G, 50, 364)])
def test_interframe_spaces(standard, difs_us, eifs_us):
    assert (standard.difs_ns, standard.eifs_ns) == (difs_us * 1000, eifs_us * 1000)


@pytest.mark.parametrize(("standard", "slot_us", "sifs_us", "cw_min", "cw_max", "extension_us"), [
    (A, 9, 16, 15, 1023, 0), (B, 20, 10, 31, 1023, 0), (G, 20, 10, 15, 1023, 6)])
def test_characteristics(standard, slot_us, sifs_us, cw_min, cw_max, extension_us):
    """IEEE 802.11-2016, tables 17-21, 16-4 and 18-5; 10.3.8 for the signal extension. As ns-3's
    802.11a and ad hoc 802.11g."""
    assert standard.slot_ns == slot_us * 1000 and standard.sifs_ns == sifs_us * 1000
    assert (standard.cw_min, standard.cw_max) == (cw_min, cw_max)
    assert standard.extension_ns == extension_us * 1000


def test_the_presets_values_are_those_of_the_reference_settings():
    """ns-3 3.44's documented defaults: 40 mW, log-distance (3, 46.6777 dB), thermal noise of 20 MHz
    and 7 dB, preambles from -82 dBm and 4 dB on, 7 transmissions, a queue of 500 packets; energy of
    Wi-Fi's frames from -82 dBm on (CcaSensitivity; -62 dBm is for other signals). Noise floor:
    -93.97 dBm."""
    params = DcfRadio.Params(preset="ns3_3_44")
    loss, heard = params.path_loss.chosen(), params.reception
    assert (params.power_dbm, loss.exponent, loss.reference_db) == (16.0206, 3, 46.6777)
    assert (heard.noise_figure_db, heard.constants.heard_dbm, heard.energy_dbm, heard.preamble_dbm,
            heard.constants.preamble_above_db) == (7, -101, -82, -82, 4)
    assert (params.retries, params.constants.window_failures, params.queue) == (7, 8, 500)
    assert heard.for_stations().noise_dbm == pytest.approx(-93.97, abs=0.01)


def test_a_datagram_of_1000_bytes_is_1064_on_the_air():
    assert psdu_bytes(1000 + 28 + 18, 1) == 1064


def test_a_rate_that_the_standard_has_not():
    with pytest.raises(ValueError):
        A.rate(11)

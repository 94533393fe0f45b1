"""The radio's card ``esp_now``: the airtime of ESP-NOW's frames, and what it is too long by."""

import pytest

from desim.testing import Bench
from desim.units import NS_PER_S
from netmodels.radio.cards import CARDS
from netmodels.radio.dcf.radio import DcfRadio

PREAMBLE_US = 192  # long preamble and header of 802.11b
# ESP-IDF's guide, ESP-NOW, frame format: MAC header, category, organization, random values, vendor
# element without its body, check sequence.
ACTION_BYTES = 24 + 1 + 3 + 4 + 7 + 4
LONGER_US = 8 * 21  # IP 20 B, UDP 8 B, LLC 8 B, instead of the 15 B of the action frame


def airtime_us(data_bytes):
    """The time of a broadcast on a medium that has been idle for long."""
    bench = Bench(DcfRadio(DcfRadio.Params(card="esp_now")), {"a": (0, 0), "b": (10, 0)})
    bench.send(NS_PER_S, "a", ["b"], data_bytes + 46, broadcast=True)
    (time_ns, *_, fate), = bench.run()
    assert fate == "arrived"
    return (time_ns - NS_PER_S) / 1000


@pytest.mark.parametrize(("data_bytes", "esp_now_us"), [(0, 536), (1, 544), (250, 2536)])
def test_frames_last_as_long_as_esp_nows_and_21_bytes(data_bytes, esp_now_us):
    """At 1 Mb/s a byte lasts 8 us: 43 B and 250 B of data behind 192 us are 2536 us."""
    assert esp_now_us == PREAMBLE_US + 8 * (ACTION_BYTES + data_bytes)
    assert airtime_us(data_bytes) == esp_now_us + LONGER_US


def test_a_twin_at_another_rate_would_be_seen(monkeypatch):
    monkeypatch.setitem(CARDS["esp_now"].values, "broadcast_rate", "2 Mb/s")
    with pytest.raises(AssertionError):
        test_frames_last_as_long_as_esp_nows_and_21_bytes(250, 2536)


def test_it_is_80211b_at_1_mbps_for_all():
    params = DcfRadio.Params(card="esp_now")
    assert (params.standard, params.rate_bps, params.broadcast_rate_bps, params.power_dbm) == (
        "11b", 1_000_000, 1_000_000, 20.0)
    assert DcfRadio.Params(card="esp_now", power="10 dBm").power_dbm == 10.0


def test_packets_above_250_bytes_are_not_refused():
    """A limit of this card, which its description names."""
    assert airtime_us(251) == 2544 + LONGER_US

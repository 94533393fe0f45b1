"""Sets of parameters under one name.

``indoor`` is a radio in rooms, as three of them were measured (Feng, Nguyen and Luo 2024,
doi:10.5281/zenodo.11558792: 342 places, 14 access points; ``netmodels.validation.surveys``
compares). Walls are those that are drawn: the exponent is that in sight, 1.6 to 2.0. Of the
residual sigma, 3.5 to 4.2 dB, places 0.6 m apart share a quarter, places 4 m apart a tenth; the
rest is by place (``shadowing.echoes``).

``outdoor`` is a street in sight (3GPP TR 38.901, UMi street canyon, LOS; tables 7.4.1-1 and
7.5-6): exponent 2.1, shadowing of 4 dB that is correlated over 10 m, a steady wave 9 dB above the
echoes. In dB such echoes deviate by 2.3 dB. Both update places every half wavelength of a robot of
1.2 m/s.

``ns3_3_44`` is what ns-3 3.44 does with the error model of NIST and without QoS. It differs from
the defaults in these rules, which were found by comparing small layouts and reading ns-3's traces
(docs/validation.md has the figures).

- The first metre loses 46.6777 dB in every band (``path_loss.reference``); by default free space on
  the channel.
- Preambles are found from -82 dBm (``reception.preamble``); by default from 4 dB above the noise,
  -90 dBm.
- Energy of Wi-Fi's frames makes the medium busy from -82 dBm (``CcaSensitivity``), whether or not a
  preamble was found; by 802.11-2016 (17.3.10.6) a found preamble does, and anything else from
  -62 dBm. Ten pairs on 120 m carry 29 instead of 41 Mb/s.
- A receiver is not aware of interference that came less than 4 us before the frame, the weaker one
  first (``unaware``): two pairs 20 m apart carry 27.0 instead of 25.3 Mb/s at 54 Mb/s.
- EIFS begins with the end of the frame that could not be decoded (``eifs``), not when the
  medium is idle after it.
- A receiver gives up a frame whose header has errors, and takes the medium for idle until something
  new comes (``reception.gives_up``).
- With 802.11ax in 40 MHz and more who has sent takes the medium for idle below -62 dBm until
  something new comes (``reception.idle_after_sending``): thirteen stations carry 11 % more.
- A frame that comes while the medium is idle goes after DIFS, counted from then on, and needs no
  backoff if something else comes in between (``difs_first``).
- A frame that is given up leaves the contention window as wide as it was (``window_failures``):
  thirty saturated stations carry 1 % more.
- Broadcasts of 802.11g go at its lowest rate, 1 Mb/s; by default at 6 Mb/s, the lowest of OFDM.
- What may go as an aggregate is repeated up to 200 times (``block_endless``), by default seven:
  seventeen stations of 802.11ac, the farthest at the edge, carry 5 % more, a lone one at the edge
  20 % less.
- Access points have the access categories of stations (``edca``), by default those of hostapd.
- A missed block acknowledgement is asked for until it comes (``block_requests``): five saturated
  stations of 802.11n carry 5 % less, two that are hidden from each other twice as much.
- An aggregate of 802.11ax has up to 256 packets (``aggregate_packets``): packets of 200 B go 9 %
  faster at MCS 7.
- The packets of an aggregate arrive each at its own end (``apart``), not all with it.
- Rate control counts as ``ArfWifiManager`` does (``rate_control.model``): five saturated stations
  carry 5.6 instead of 6.0 Mb/s.
"""

from __future__ import annotations

from desim import ports
from netmodels.radio.cards import with_card
from netmodels.radio.standards import FIVE_GHZ

PRESETS: dict[str, dict[str, object]] = {
    "indoor": {
        "path_loss": {"model": "log_distance", "exponent": 1.8},
        "shadowing": {"sigma": "2.4 dB", "correlation": "3 m", "echoes": "3.1 dB"},
        "update": "50 ms",
    },
    "outdoor": {
        "path_loss": {"model": "log_distance", "exponent": 2.1},
        "shadowing": {"sigma": "4 dB", "correlation": "10 m", "echoes": "2.3 dB"},
        "update": "50 ms",
    },
    "ns3_3_44": {
        "power": "16.0206 dBm",
        "path_loss": {"model": "log_distance", "exponent": 3, "reference": "46.6777 dB"},
        "reception": {
            "noise_figure": "7 dB", "energy": "-82 dBm", "preamble": "-82 dBm", "constants": {
                "heard": "-101 dBm", "preamble_above": "4 dB", "unaware": True, "eifs": "frame",
                "gives_up": True, "idle_after_sending": True}},
        "queue": 500, "retries": 7, "constants": {
            "window_failures": 8, "difs_first": True, "edca": "stations",
            "block_endless": True, "block_requests": True, "apart": True},
    },
}


def filled(given: object) -> object:
    """Parameters with the values of their card where ``given`` has none, and then with those of
    their preset; inside of a parameter key by key, unless it names another model. Standards of
    5 GHz alone have a channel there."""
    given = with_card(given)
    if isinstance(given, dict) and given.get("standard") in ("11a", "11ac"):
        given = {"channel": FIVE_GHZ, **given}
    if isinstance(given, dict) and given.get("preset") == "ns3_3_44":
        with_1_mbps = given.get("standard", "11g") in ("11b", "11g")
        given = {"broadcast_rate": "1 Mb/s" if with_1_mbps else "6 Mb/s", **given}
        constants = given.get("constants", {})
        if given.get("standard") == "11ax" and isinstance(constants, dict):
            given["constants"] = {"aggregate_packets": 256, **constants}
        if isinstance(given.get("rate_control"), dict):  # none by itself
            given["rate_control"] = {"model": "arf_ns3", **given["rate_control"]}
    return ports.with_preset(given, "preset", "", PRESETS)

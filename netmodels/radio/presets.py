"""Sets of parameters under one name.

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
  first (``reception.unaware``): two pairs 20 m apart carry 27.0 instead of 25.3 Mb/s at 54 Mb/s.
- EIFS begins with the end of the frame that could not be decoded (``reception.eifs``), not when the
  medium is idle after it.
- A receiver gives up a frame whose header has errors, and takes the medium for idle until something
  new comes (``reception.gives_up``).
- A frame that comes while the medium is idle goes after DIFS, counted from then on, and needs no
  backoff if something else comes in between (``difs_first``).
- A frame that is given up leaves the contention window as wide as it was (``window_failures``):
  thirty saturated stations carry 1 % more.
- Broadcasts of 802.11g go at its lowest rate, 1 Mb/s; by default at 6 Mb/s, the lowest of OFDM.
- Rate control counts as ``ArfWifiManager`` does (``rate_control.model``): five saturated stations
  carry 5.6 instead of 6.0 Mb/s.
"""

from __future__ import annotations

from desim import ports

_RECEPTION: dict[str, object] = {
    "noise_figure": "7 dB", "heard": "-101 dBm", "energy": "-82 dBm", "preamble": "-82 dBm",
    "preamble_above": "4 dB", "unaware": True, "eifs": "frame", "gives_up": True}
PRESETS: dict[str, dict[str, object]] = {
    "ns3_3_44": {
        "power": "16.0206 dBm",
        "path_loss": {"model": "log_distance", "exponent": 3, "reference": "46.6777 dB"},
        "reception": _RECEPTION,
        "queue": 500, "retries": 7, "window_failures": 8, "difs_first": True,
    },
}
_INSIDE: dict[str, dict[str, object]] = {  # completed key by key
    "reception": _RECEPTION, "rate_control": {"model": "arf_ns3"}}


def filled(given: object) -> object:
    """Parameters with the values of their preset, inside ``reception`` and ``rate_control`` key by
    key, where ``given`` has none."""
    if not isinstance(given, dict) or str(given.get("preset")) not in PRESETS:
        return given
    own = {key: _INSIDE[key] | value if key in _INSIDE and isinstance(value, dict) else value
           for key, value in given.items()}
    lowest = {"broadcast_rate": "6 Mb/s" if given.get("standard") == "11a" else "1 Mb/s"}
    return ports.with_preset(own, "preset", "", {name: lowest | preset
                                                 for name, preset in PRESETS.items()})

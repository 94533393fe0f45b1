"""Sets of parameters under one name.

``ns3_3_44`` is what ns-3 3.44 does with the error model of NIST and without QoS. It differs from
the defaults in four rules. Energy of Wi-Fi's frames makes the medium busy from -82 dBm on
(``CcaSensitivity``), whether or not a preamble was found; by 802.11-2016 (17.3.10.6) a found
preamble does from -82 dBm on, and anything else from -62 dBm on: ten pairs on 120 m carry 29
instead of 43 Mb/s. A receiver is not aware of interference that began with the frame
(``reception.unaware``): two pairs 20 m apart carry 27.0 instead of 25.3 Mb/s at 54 Mb/s. A frame
that is given up leaves the contention window as wide as it was (``window_failures``): thirty
saturated stations carry 1.5 % more. And broadcasts of 802.11g go at its lowest rate, 1 Mb/s.
"""

from __future__ import annotations

from typing import Any

PRESETS: dict[str, dict[str, Any]] = {
    "ns3_3_44": {
        "power": "16.0206 dBm",
        "path_loss": {"model": "log_distance", "exponent": 3, "reference": "46.6777 dB"},
        "reception": {"noise_figure": "7 dB", "heard": "-101 dBm", "energy": "-82 dBm",
                      "preamble": "-82 dBm", "preamble_above": "4 dB", "unaware": True},
        "queue": 500, "retries": 7, "window_failures": 8,
    },
}


def filled(given: Any) -> Any:
    """Parameters as they were given, with those of their preset where they leave something open:
    inside ``reception`` key by key."""
    preset = PRESETS.get(given.get("preset")) if isinstance(given, dict) else None
    if preset is None:
        return given
    reception = given.get("reception", {})
    if isinstance(reception, dict):
        given = {**given, "reception": preset["reception"] | reception}
    lowest = "6 Mb/s" if given.get("standard") == "11a" else "1 Mb/s"
    return {"broadcast_rate": lowest, **preset, **given}

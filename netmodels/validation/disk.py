"""The range of the rung ``disk`` of a radio: there the whole radio delivers nine frames of ten."""

from __future__ import annotations

import math
from collections.abc import Iterator

from desim.ports.cases import Check, Flow, Play, Setup
from desim.units import NS_PER_S
from netmodels.ethernet import FULL_BYTES
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.uncontended import SHARE, Uncontended

RADIOS: dict[str, dict[str, object]] = {
    "11g 54 Mb/s": {},
    "11g 36 Mb/s": {"rate": "36 Mb/s"},
    "11g 54 Mb/s, one attempt": {"retries": 1},
    "11a 54 Mb/s, 20 dBm, free space": {
        "standard": "11a", "rate": "54 Mb/s", "power": "20 dBm",
        "path_loss": {"model": "free_space", "frequency": "5180 MHz"}},
}

_FRAMES = 3000
_EVERY_NS = NS_PER_S // 5  # longer than seven attempts take


class DiskOfRadio:
    """The range of ``network.fidelity: disk``, computed from path loss and error model, against
    what ``mac`` delivers there to a single receiver: within 3.3 standard errors."""

    source = "a property, not a publication: 90 % of full packets, within the retries"

    def checks(self, play: Play) -> Iterator[Check]:
        tolerance = 3.3 * math.sqrt(SHARE * (1 - SHARE) / _FRAMES)
        for name, params in RADIOS.items():
            range_m = Uncontended(DcfRadio.Params(**params), open_air=True).range_m[False]
            flow = Flow("a", ("b",), FULL_BYTES, FULL_BYTES, "zero", _EVERY_NS)
            radio = DcfRadio(DcfRadio.Params(**params))
            found = play(Setup(radio, {"a": (0.0, 0.0), "b": (range_m, 0.0)}, [flow],
                               _FRAMES * _EVERY_NS))
            yield Check(f"{name}, {range_m:.1f} m: delivered", 1 - found["loss"], SHARE, tolerance)

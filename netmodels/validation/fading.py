"""Links that fade, against the laws of Rayleigh and Rice."""

from __future__ import annotations

import math
from collections.abc import Iterator

from scipy.stats import ncx2

from desim.ports.cases import NOWHERE, Check, Flow, Play, Setup
from desim.units import NS_PER_S
from netmodels.radio.dcf.radio import DcfRadio

PREAMBLE = "-82 dBm"

_THRESHOLD_DBM = -82.0  # at 6 Mb/s whatever is found there has no errors: 12 dB above the noise
_ERRORS = 3.3  # standard errors: one comparison in a thousand is farther off by chance
_FRAMES = 20_000
_EVERY_NS = NS_PER_S // 100  # each has a block of its own


class FadingOutage:
    """Share of frames at a receiver that finds what is above a threshold, in blocks that fade:
    within 3.3 standard errors of exp(-threshold / mean) without a steady wave, and with one of the
    tail of the non-central chi-squared distribution."""

    source = "Rayleigh; Rice (Marcum's Q of first order); Rappaport 2002, 5.6"

    def checks(self, play: Play) -> Iterator[Check]:
        for k_db in (None, 0.0, 7.0):
            for above_db in (0.0, 3.0, 10.0):
                steady = 0.0 if k_db is None else 10 ** (k_db / 10)
                share = float(ncx2.sf(2 * (steady + 1) * 10 ** (-above_db / 10), 2, 2 * steady))
                name = "Rayleigh" if k_db is None else f"Rician, {k_db:g} dB"
                yield Check(f"{name}, mean {above_db:g} dB above: delivered",
                            _delivered(play, k_db, above_db), share,
                            _ERRORS * math.sqrt(share * (1 - share) / _FRAMES))


def _delivered(play: Play, k_db: float | None, above_db: float) -> float:
    radio = DcfRadio.Params(
        rate="6 Mb/s", retries=1, reception={"preamble": PREAMBLE},
        path_loss={"model": "fixed", "total": f"{16.0206 - _THRESHOLD_DBM - above_db} dB"},
        fading={"coherence": "10 ms", "rician_k": None if k_db is None else f"{k_db} dB"})
    found = play(Setup(DcfRadio(radio), {"a": NOWHERE, "b": NOWHERE},
                       [Flow("a", ("b",), 200, 200, "zero", _EVERY_NS)], _FRAMES * _EVERY_NS))
    return 1 - found["loss"]

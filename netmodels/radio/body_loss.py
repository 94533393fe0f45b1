"""Loss of a radio wave by people who stand between two antennas."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from netmodels.radio import kernels


@dataclass(frozen=True)
class BodyLoss:
    """A body is a screen across the line, as broad as its disc, around both of whose edges a wave
    of length ``wave_m`` bends (3GPP TR 38.901, 7.6.4.2, blockage model B; METIS D1.4):

    L = -20 log10(1 - F1 - F2), F = atan(pi / 2 sqrt(pi / wave (D1 + D2 - r))) / pi,

    D1 and D2 from an edge to the antennas, r between these. Losses of several bodies add up. One
    counts where the line meets it below its top, and nowhere else; next to it a wave would lose up
    to 6 dB (ITU-R P.526, a knife edge).
    """

    wave_m: float

    def loss_db(self, people: np.ndarray, lines: np.ndarray, heights_m: np.ndarray) -> np.ndarray:
        """[k] dB by ``people`` [n, 4] x, y, radius, height in m on straight ``lines`` [k, 4]
        x1 y1 x2 y2 in m between ``heights_m`` [k, 2]; 0 where a place is NaN."""
        out = np.empty(len(lines))
        kernels.bodies(people, lines, heights_m, self.wave_m, out)
        return out

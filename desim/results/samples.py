"""Measurements of the monitor's time series, each at its own instants (``measure.periods``)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np


def measured(samples: Mapping[str, np.ndarray], name: str) -> tuple[np.ndarray, np.ndarray]:
    """The instants [n] s at which the number called ``name`` was measured, and its values [n]."""
    values = samples[name].astype(float)
    known = ~np.isnan(values)
    return samples["time_s"][known], values[known]

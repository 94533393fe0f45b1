"""Costs of an assignment of robots to frontiers, for solvers that take finite numbers alone."""

import numpy as np
from numpy.typing import ArrayLike

NO_WAY_M = 1e6  # more than any way


def finite_costs_m(ways_m: ArrayLike) -> np.ndarray:
    """[robots, frontiers] m: ``NO_WAY_M`` in place of infinity, where there is no path."""
    return np.minimum(ways_m, NO_WAY_M)

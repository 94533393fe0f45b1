"""The number of particles that a filter needs: more where they are spread wider."""

from __future__ import annotations

import math

import numpy as np

from desim.robot.slam.kernels.particles import occupied_bins

# Of AMCL in ROS: kld_err of its example launch files, the normal quantile for kld_z (0.99), and
# the bins of its histogram.
_ERROR, _QUANTILE = 0.05, 2.326
_BIN_M, _BIN_RAD = 0.5, math.radians(10.0)


def wanted_particles(poses: np.ndarray, centre: int, least: int, most: int) -> int:
    """The number of particles, ``least`` to ``most``, by KLD sampling: the sample has the shape of
    its distribution up to a Kullback-Leibler distance of 0.05, with a probability of 99 % (Fox
    2003, "Adapting the sample size in particle filters through KLD-sampling", International Journal
    of Robotics Research 22, equation 7).

    ``poses`` [particles, 3] | ``centre``: the particle in the middle of one of the bins, so that
    those close to it share it.
    """
    bins = occupied_bins(poses, centre, _BIN_M, _BIN_RAD, np.empty(poses.shape))
    return min(max(samples_for(bins), least), most)


def samples_for(bins: int) -> int:
    """Samples that show the shape of a distribution over so many bins."""
    if bins == 1:
        return 1
    part = 2.0 / (9.0 * (bins - 1))
    return math.ceil((bins - 1) / (2.0 * _ERROR)
                     * (1.0 - part + math.sqrt(part) * _QUANTILE) ** 3)

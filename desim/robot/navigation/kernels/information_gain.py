"""The loop of the expected information gain."""

import numpy as np

from desim.ports.kernels import TWO_PI, cos, lean, sin
from desim.robot.navigation.kernels.global_costmap import LETHAL, UNKNOWN


@lean("i8(u1[::1], i8, i8, i8, i4[::1], i8)")
def unknown_in_view(flat, across, cell, reach, met, stamp):
    """The number of unknown cells within ``reach`` cells of ``cell`` that a straight ray meets
    before an obstacle; a ray for each cell of the rim. ``met`` [cells], in and out: the stamp of
    the last call that counted a cell; ``stamp`` is a new one."""
    row, column, count = cell // across, cell % across, 0
    rays = int(np.ceil(TWO_PI * reach))
    for k in range(rays):
        dx, dy = cos(TWO_PI * k / rays), sin(TWO_PI * k / rays)
        for step in range(1, reach + 1):
            at = (row + int(np.rint(dy * step))) * across + column + int(np.rint(dx * step))
            if flat[at] == LETHAL:  # as the rim is
                break
            if flat[at] == UNKNOWN and met[at] != stamp:
                met[at] = stamp
                count += 1
    return count

"""The loop that lays one map's walls over another map."""

from desim.ports.kernels import lean


@lean("void(i1[:,::1], f8[::1], f8[::1], f8[::1], i8[:,::1])")
def overlay(field, x, y, shifts, sums):
    """``sums[i, k]``: the sum of ``field`` at points ``x``, ``y`` moved by ``shifts[k]`` in x and
    ``shifts[i]`` in y; all in cells, nothing beyond the field."""
    height, width = field.shape
    for i in range(len(shifts)):
        for k in range(len(shifts)):
            total = 0
            for n in range(len(x)):
                column, row = x[n] + shifts[k], y[n] + shifts[i]
                if 0.0 <= column < width and 0.0 <= row < height:
                    total += field[int(row), int(column)]
            sums[i, k] = total

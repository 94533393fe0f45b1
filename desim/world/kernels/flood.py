"""The free cells that hang together with some of them."""

from desim.ports.kernels import lean


@lean("void(b1[:,::1], i8[::1], b1[::1], i4[::1])")
def flood(free, starts, reached, queue):
    """Mark what can be reached from the free ones of ``starts``, from cell to cell along their
    sides.

    free [rows, cols] | starts [k] cells, counted row by row | reached [rows * cols], all False |
    queue [rows * cols] to work in
    """
    rows, cols = free.shape
    count, done = 0, 0
    for start in starts:
        if free[start // cols, start % cols] and not reached[start]:
            reached[start], queue[count] = True, start
            count += 1
    while done < count:
        row, col = queue[done] // cols, queue[done] % cols
        done += 1
        for side in range(4):
            r, c = row + (side == 0) - (side == 1), col + (side == 2) - (side == 3)
            if 0 <= r < rows and 0 <= c < cols and free[r, c] and not reached[r * cols + c]:
                reached[r * cols + c], queue[count] = True, r * cols + c
                count += 1

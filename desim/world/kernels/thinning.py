"""Thinning of the solid cells of a map to lines one cell wide."""

from desim.ports.kernels import lean, types


@lean(types.void(types.Array(types.uint8, 1, "C"), types.int64, types.Array(types.int64, 1, "C"),
                 types.Array(types.int64, 1, "C")))
def thin(solid, cols, cells, gone):
    """Thin solid cells to lines one cell wide along their middle (Guo and Hall 1989).

    solid [rows * cols] 1 or 0, with a free border, changed | cells [n] the solid ones, and
    gone [n]: to work in
    """
    left, quiet, half = len(cells), 0, 0
    while quiet < 2:
        count = 0
        for i in range(left):
            at = cells[i]
            n, s = solid[at - cols], solid[at + cols]
            e, w = solid[at + 1], solid[at - 1]
            ne, nw = solid[at - cols + 1], solid[at - cols - 1]
            se, sw = solid[at + cols + 1], solid[at + cols - 1]
            runs = (((1 - n) & (ne | e)) + ((1 - e) & (se | s)) + ((1 - s) & (sw | w))
                    + ((1 - w) & (nw | n)))
            pairs = min((nw | n) + (ne | e) + (se | s) + (sw | w),
                        (n | ne) + (e | se) + (s | sw) + (w | nw))
            stays = (s | sw | (1 - nw)) & w if half == 0 else (n | ne | (1 - se)) & e
            if runs == 1 and 2 <= pairs <= 3 and stays == 0:
                gone[count] = at
                count += 1
        for i in range(count):
            solid[gone[i]] = 0
        kept = 0
        for i in range(left):
            if solid[cells[i]]:
                cells[kept] = cells[i]
                kept += 1
        left = kept
        quiet = 0 if count else quiet + 1
        half = 1 - half

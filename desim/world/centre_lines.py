"""The centre lines of walls that a map shows as solid cells, as a person would draw them.

The solid cells are thinned to a skeleton. Its spurs are pruned and its branches become straight
lines, which are extended to the walls' ends and joined where walls meet. Lengths are in cells.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.ndimage import distance_transform_edt, label
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from desim.world.kernels import thinning

# Most cells by which a skeleton leaves the line of a straight wall.
BEND = 1.0

# A branch is a wall if it sticks out of the junction's disc by so many cells more than the corner
# of a square does. Tuned on corners and ends of walls of 0.2 and 0.3 m in cells of 0.05 and 0.1 m,
# turned by 0 to 84 degrees in steps of 6: of lines that pass them one cell or more aside, 0.6 % at
# most are counted otherwise than in the drawing, on the average of the angles (4.5 % at one of
# them). With 1.1 it is 1.1 %; with 1.7 and 2 it is 0.3 %, but shorter walls beside doors are lost.
SPUR = 1.4

MARGIN = 2  # free cells around the image
PULL = 0.02  # of a vertex to where thinning has left it, against 1 to each of its lines

_AROUND = ((-1, 0), (-1, 1), (0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1))


# A part of the skeleton between two nodes: its points [n, 2] x y, the distances [n] of the nearest
# free cells, the cells of both ends, and which of these are a wall's end.
Branch = tuple[np.ndarray, np.ndarray, tuple[int, int], tuple[bool, bool]]
# A straight part of a wall: its two vertices, a point and the direction of its line, its thickness.
Edge = tuple[int, int, np.ndarray, np.ndarray, float]


def centre_lines(wall: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The centre lines of the solid cells ``wall`` [rows, cols]: [n, 4] x1 y1 x2 y2, their
    thickness [n], and [rows, cols] bool, the posts: the cells of parts that are no longer than they
    are thick. These have no line."""
    wall = np.pad(wall, MARGIN)
    away = distance_transform_edt(wall)
    skeleton = _thinned(wall)
    while (spurs := _spurs(skeleton, away)).size:
        skeleton.reshape(-1)[spurs] = False
    posts = _posts(wall, skeleton, away)
    skeleton &= ~posts
    points: list[np.ndarray] = []
    edges: list[Edge] = []
    numbers: dict[int, int] = {}
    for branch in _branches(skeleton, away):
        _add(_led_on(branch, wall), wall, points, edges, numbers)
    lines, thickness = _joined(np.array(points).reshape(-1, 2), edges)
    return lines - MARGIN, thickness, posts[MARGIN:-MARGIN, MARGIN:-MARGIN]


def _thinned(wall: np.ndarray) -> np.ndarray:
    """[rows, cols] bool: lines one cell wide in the middle of ``wall``."""
    left = wall.astype(np.uint8)
    cells = np.flatnonzero(left)
    thinning.thin(left.reshape(-1), wall.shape[1], cells, np.empty_like(cells))
    return left.astype(bool)


def _branches(skeleton: np.ndarray, away: np.ndarray) -> Iterator[Branch]:
    """All parts of ``skeleton`` between ends and junctions, and rings in two halves."""
    cells, beside = _neighbours(skeleton)
    degree = [len(row) for row in beside]
    fresh = [count == 2 for count in degree]
    taken = set()

    def branch(way: list[int]) -> Branch:
        at = cells[way]
        points = np.stack([at % skeleton.shape[1], at // skeleton.shape[1]], axis=1) + 0.5
        ends = way[0], way[-1]
        return (points, away.reshape(-1)[at], (int(at[0]), int(at[-1])),
                (degree[ends[0]] == 1, degree[ends[1]] == 1))

    def walk(way: list[int]) -> list[int]:
        while fresh[way[-1]]:
            fresh[way[-1]] = False
            one, other = beside[way[-1]]
            way.append(other if one == way[-2] else one)
        return way

    for node in (n for n, count in enumerate(degree) if count != 2):
        for first in beside[node]:
            if (node, first) not in taken:
                way = walk([node, first])
                taken.add((way[-1], way[-2]))
                yield branch(way)
    for node in range(len(fresh)):
        if fresh[node]:
            fresh[node] = False
            way = walk([node, beside[node][0]])
            yield branch(way[:len(way) // 2 + 1])
            yield branch(way[len(way) // 2:])


def _neighbours(skeleton: np.ndarray) -> tuple[np.ndarray, list[list[int]]]:
    """The cells of ``skeleton``, as flat places, and the neighbours of each: across a corner only
    where there is no way along sides."""
    rows, cols = np.nonzero(skeleton)
    cells = rows * skeleton.shape[1] + cols
    beside = np.full((len(cells), len(_AROUND)), -1)
    for k, (up, right) in enumerate(_AROUND):
        there = skeleton[rows + up, cols + right]
        if up and right:
            there &= ~(skeleton[rows + up, cols] | skeleton[rows, cols + right])
        beside[there, k] = np.searchsorted(cells, cells[there] + up * skeleton.shape[1] + right)
    return cells, [[n for n in row if n >= 0] for row in beside.tolist()]


def _spurs(skeleton: np.ndarray, away: np.ndarray) -> np.ndarray:
    """[n] flat places of branches that end where the disc around the junction does: corners and
    ragged edges. The corner of a square lies 0.41 of the disc's radius behind the disc."""
    gone = [np.zeros(0, np.int64)]
    for points, deep, _, (begins, ends) in _branches(skeleton, away):
        if begins == ends:
            continue
        if begins:
            points, deep = points[::-1], deep[::-1]
        out = np.hypot(*(points[-1] - points[0])) + deep[-1] - deep[0]
        if out <= (np.sqrt(2) - 1) * (deep[0] - 0.5) + SPUR:
            col, row = points[1:].astype(int).T
            gone.append(row * skeleton.shape[1] + col)
    return np.concatenate(gone)


def _posts(wall: np.ndarray, skeleton: np.ndarray, away: np.ndarray) -> np.ndarray:
    """[rows, cols] bool: the parts of ``wall`` with a skeleton no longer than they are thick."""
    parts, count = label(wall, np.ones((3, 3)))
    rows, cols = np.nonzero(skeleton)
    part = parts[rows, cols]
    low, high = np.full((2, count + 1), wall.size), np.zeros((2, count + 1))
    for axis, at in enumerate((rows, cols)):
        np.minimum.at(low[axis], part, at)
        np.maximum.at(high[axis], part, at)
    thick = np.zeros(count + 1)
    np.maximum.at(thick, part, 2 * away[rows, cols] - 1)
    compact = np.hypot(*(high - low).clip(0)) <= thick
    compact[0] = False
    return compact[parts]


def _led_on(branch: Branch, wall: np.ndarray) -> Branch:
    """A branch extended to the ends of the wall; thinning leaves its tips short of them."""
    points, deep, nodes, tips = branch
    for tip in tips:
        if tip:
            points, deep = _to_the_end(points, deep, wall)
        points, deep = points[::-1], deep[::-1]
    return points, deep, nodes, tips


def _to_the_end(points: np.ndarray, deep: np.ndarray, wall: np.ndarray,
                ) -> tuple[np.ndarray, np.ndarray]:
    """Move the first of ``points`` to the wall's end, and leave out those as near to it as the wall
    is thick, which may lead into a corner. At the end, a rectangle of the wall's width has as many
    solid cells as there are."""
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    thick = 2 * np.median(deep[way <= 3 * deep.max()]) - 0.5
    cut = int(np.searchsorted(way, min(thick, way[-1] / 2)))
    straight = points[cut:int(np.searchsorted(way, way[cut] + max(3 * thick, 4.0))) + 1]
    if len(straight) < 2:
        straight, cut = points, 0
    middle, along = _line(straight)
    along = along if along @ (points[0] - points[-1]) > 0 else -along
    begin = middle + ((points[cut] - middle) @ along) * along
    back = min(2 * thick, (way[-1] - way[cut]) / 2) + 0.5
    steps = np.arange(-back, way[cut] + 2 * thick + 2, 0.1) + 0.05
    aside = np.linspace(-0.5, 0.5, 9) * max(thick, 1.0)
    x = begin[0] + steps[:, None] * along[0] - aside * along[1]
    y = begin[1] + steps[:, None] * along[1] + aside * along[0]
    rows, cols = wall.shape
    solid = wall[y.astype(int).clip(0, rows - 1), x.astype(int).clip(0, cols - 1)].mean(axis=1)
    full, solid = solid[steps < 0].mean(), solid[steps > 0]
    free = np.flatnonzero(solid < full / 4)
    stop = free[0] if len(free) else len(solid)
    end = begin + 0.1 * min(solid[:stop].sum() / full, stop) * along
    return np.concatenate([[end], points[cut:]]), np.concatenate([deep[cut:cut + 1], deep[cut:]])


def _line(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The middle and the direction of ``points`` [n >= 2, 2]."""
    middle = points.mean(axis=0)
    return middle, np.linalg.svd(points - middle, full_matrices=False)[2][0]


def _add(branch: Branch, wall: np.ndarray, points: list[np.ndarray], edges: list[Edge],
         numbers: dict[int, int]) -> None:
    """Add a branch's vertices and straight parts; a node of several branches is one vertex."""
    path, deep, nodes, _ = branch
    bends = _bends(path)
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    vertices = []
    for at in bends:
        number = len(points)
        if at in (0, len(path) - 1):
            number = numbers.setdefault(nodes[at > 0], number)
        if number == len(points):
            points.append(path[at])
        vertices.append(number)
    for one, other, begin, end in zip(bends[:-1], bends[1:], vertices[:-1], vertices[1:],
                                      strict=True):
        thick = 2 * float(np.median(deep[one:other + 1])) - 0.5
        apart = np.minimum(way[one:other + 1] - way[one], way[other] - way[one:other + 1])
        undisturbed = path[one:other + 1][apart >= min(thick, apart.max() / 2)]
        if len(undisturbed) < 2:
            undisturbed = path[[one, other]]
        edges.append((begin, end, *_centred(*_line(undisturbed), undisturbed, wall, thick), thick))


def _centred(middle: np.ndarray, along: np.ndarray, points: np.ndarray, wall: np.ndarray,
             thick: float) -> tuple[np.ndarray, np.ndarray]:
    """A line moved aside to the middle of the solid cells around it: the skeleton of a wall two
    cells thick lies in one of them."""
    aside = np.linspace(-1.0, 1.0, 41) * (thick / 2 + 1)
    feet = middle + ((points - middle) @ along)[:, None] * along
    x = feet[:, :1] - aside * along[1]
    y = feet[:, 1:] + aside * along[0]
    solid = wall[y.astype(int).clip(0, wall.shape[0] - 1), x.astype(int).clip(0, wall.shape[1] - 1)]
    off = (solid * aside).sum() / max(solid.sum(), 1)
    return middle + off * np.array([-along[1], along[0]]), along


def _bends(points: np.ndarray) -> list[int]:
    """The numbers of those ``points`` [n, 2] through which a line stays within ``BEND`` of all
    (Douglas and Peucker 1973)."""
    needed, parts = [0], [(0, len(points) - 1)]
    while parts:
        begin, end = parts.pop()
        way, to = points[end] - points[begin], points[begin:end + 1] - points[begin]
        off = np.abs(to[:, 0] * way[1] - to[:, 1] * way[0]) / max(np.hypot(*way), 1e-9)
        at = begin + int(np.argmax(off))
        if off[at - begin] > BEND:
            parts += [(at, end), (begin, at)]
        else:
            needed.append(end)
    return needed


def _joined(points: np.ndarray, edges: list[Edge]) -> tuple[np.ndarray, np.ndarray]:
    """Lines [n, 4] and their thickness, with vertices moved to where the lines of their edges meet.
    An edge between two others that is shorter than the wall is thick becomes one vertex."""
    if not edges:
        return np.zeros((0, 4)), np.zeros(0)
    begin, end, middle, along, thick = (np.array(column) for column in zip(*edges, strict=True))
    degree = np.bincount(np.concatenate([begin, end]), minlength=len(points))
    short = (np.hypot(*(points[end] - points[begin]).T) <= thick) & (degree[begin] > 1) & (
        degree[end] > 1)
    count, part = _parts(begin[short], end[short], len(points))
    out = np.bincount(np.concatenate([part[begin], part[end]])[np.tile(~short, 2)], minlength=count)
    short &= out[part[begin]] > 0  # what is made of nothing else stays
    count, part = _parts(begin[short], end[short], len(points))
    begin, end, middle, along, thick = (of[~short] for of in (part[begin], part[end], middle, along,
                                                              thick))
    where = np.stack([np.bincount(part, column) for column in points.T], axis=1) \
        / np.bincount(part)[:, None]
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    pull = np.tile(PULL * np.eye(2), (count, 1, 1))
    to = PULL * where
    for vertex in begin, end:
        np.add.at(pull, vertex, across[:, :, None] * across[:, None, :])
        np.add.at(to, vertex, across * (across * middle).sum(axis=1)[:, None])
    moved = np.linalg.solve(pull, to[:, :, None])[:, :, 0]
    reach = np.zeros(count)
    for vertex in begin, end:
        np.maximum.at(reach, vertex, thick + 1)
    moved = np.where((np.hypot(*(moved - where).T) <= reach)[:, None], moved, where)
    return np.concatenate([moved[begin], moved[end]], axis=1), thick


def _parts(begin: np.ndarray, end: np.ndarray, count: int) -> tuple[int, np.ndarray]:
    """The number of connected parts of ``count`` vertices with these edges, and each one's part."""
    return connected_components(coo_array((np.ones(len(begin)), (begin, end)), (count, count)),
                                directed=False)

"""Maps in shared tiles are what full copies would be, and only what differs is kept twice."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from desim.robot.slam.shared_maps import SharedMaps

PARTICLES = 4
RESOLUTION_M = 0.1


def scan(seed):
    """Points with normals around a robot."""
    draw = np.random.default_rng(seed)
    points = draw.uniform(-6.0, 6.0, (20, 4))
    points[:, 2:] /= np.hypot(points[:, 2], points[:, 3])[:, None]
    return points


def add(maps, particle, pose, seed):
    points = scan(seed)
    reach = 9.0
    maps.cover(pose[0] - reach, pose[1] - reach, pose[0] + reach, pose[1] + reach)
    maps.add(particle, np.array(pose), (0.1, -0.1), points, len(points))


def cells(maps, particle):
    """Counts of known cells by their place in cells."""
    visits, hits, (left_m, low_m) = maps.counts(particle)
    rows, columns = np.nonzero(visits)
    left, low = round(left_m / RESOLUTION_M), round(low_m / RESOLUTION_M)
    return {(int(c) + left, int(r) + low): (int(visits[r, c]), int(hits[r, c]))
            for r, c in zip(rows, columns, strict=True)}


poses = st.tuples(st.floats(-15, 15), st.floats(-15, 15), st.floats(-4, 4))
additions = st.tuples(st.just("add"), st.integers(0, PARTICLES - 1), poses, st.integers(0, 9))
resamplings = st.tuples(st.just("follow"), st.lists(st.integers(0, PARTICLES - 1),
                                                    min_size=PARTICLES, max_size=PARTICLES))


@settings(max_examples=30)
@given(st.lists(st.one_of(additions, resamplings), max_size=14))
def test_shared_tiles_are_equal_to_full_copies(actions):
    shared = SharedMaps(PARTICLES, RESOLUTION_M)
    # A map of one's own for each particle, made of all that it and its ancestors have added.
    stories: list[list] = [[] for _ in range(PARTICLES)]
    for action in actions:
        if action[0] == "add":
            _, particle, pose, seed = action
            add(shared, particle, pose, seed)
            stories[particle].append((pose, seed))
        else:
            shared.follow(np.array(action[1]))
            stories = [list(stories[k]) for k in action[1]]
    for particle, story in enumerate(stories):
        alone = SharedMaps(1, RESOLUTION_M)
        for pose, seed in story:
            add(alone, 0, pose, seed)
        assert cells(shared, particle) == cells(alone, 0)
    assert references(shared)


def references(maps):
    """Whether each tile has as many references as tables point to it, and is free without any."""
    arrays = maps.arrays
    for table, stock in ((arrays.seen, arrays.seen_stock), (arrays.met, arrays.met_stock)):
        counted = np.bincount(table.ravel(), minlength=len(stock.refs))[1:]
        free = np.sort(stock.free[:stock.free_count[0]])
        if not (counted == stock.refs[1:]).all() or not np.array_equal(
                free, np.flatnonzero(counted == 0) + 1):
            return False
    return True


def test_particles_share_what_they_have_in_common():
    maps = SharedMaps(PARTICLES, RESOLUTION_M)
    add(maps, 2, (0.0, 0.0, 0.0), 1)
    tiles = (maps.arrays.seen_stock.refs > 0).sum()
    maps.follow(np.full(PARTICLES, 2))
    assert (maps.arrays.seen_stock.refs > 0).sum() == tiles
    assert maps.arrays.seen_stock.refs.max() == PARTICLES
    add(maps, 0, (20.0, 0.0, 0.0), 2)  # away from the first scan
    assert all(cells(maps, k) == cells(maps, 1) for k in (2, 3))
    assert cells(maps, 0).items() >= cells(maps, 1).items()
    assert references(maps)


def test_a_count_that_is_not_kept_is_seen():
    maps = SharedMaps(PARTICLES, RESOLUTION_M)
    add(maps, 2, (0.0, 0.0, 0.0), 1)
    maps.arrays.seen_stock.refs[1:] += 1
    assert not references(maps)

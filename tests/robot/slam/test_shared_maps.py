"""Maps in shared tiles are what full copies would be, and only what differs is kept twice."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from desim.robot.slam.kernels.tiles import SIDE
from desim.robot.slam.shared_maps import SharedMaps

PARTICLES = 4
RESOLUTION_M = 0.1


def scan(seed):
    """Points with normals around a robot."""
    draw = np.random.default_rng(seed)
    points = draw.uniform(-6.0, 6.0, (20, 4))
    points[:, 2:] /= np.hypot(points[:, 2], points[:, 3])[:, None]
    return points


def add(maps, poses, seed):
    """A scan that each particle sees from a pose of its own."""
    points = scan(seed)
    maps.add(np.array(poses), (0.1, -0.1), points, points[::2].copy())


def cells(maps, particle):
    """Counts of known cells by their place in cells."""
    visits, hits, (left_m, low_m) = maps.counts(particle)
    rows, columns = np.nonzero(visits)
    left, low = round(left_m / RESOLUTION_M), round(low_m / RESOLUTION_M)
    return {(int(c) + left, int(r) + low): (int(visits[r, c]), int(hits[r, c]))
            for r, c in zip(rows, columns, strict=True)}


# The laser is never on the border of cells, where rounding decides.
metres = st.integers(-1500, 1500).map(lambda hundredths: 0.01 * hundredths + 0.0037)
poses = st.tuples(metres, metres, st.floats(-4, 4))
additions = st.tuples(st.just("add"), st.lists(poses, min_size=PARTICLES, max_size=PARTICLES),
                      st.integers(0, 9))
# The number of particles changes, too; of the poses above, as many count as there are particles.
resamplings = st.tuples(st.just("follow"), st.lists(st.integers(0, PARTICLES - 1),
                                                    min_size=1, max_size=PARTICLES))


@settings(max_examples=30)
@given(st.lists(st.one_of(additions, resamplings), max_size=14))
def test_shared_tiles_are_equal_to_full_copies(actions):
    shared = SharedMaps(PARTICLES, RESOLUTION_M)
    # A map of one's own for each particle, made of all that it and its ancestors have added.
    stories: list[list] = [[] for _ in range(PARTICLES)]
    for action in actions:
        if action[0] == "add":
            _, places, seed = action
            places = places[:len(stories)]
            add(shared, places, seed)
            for story, pose in zip(stories, places, strict=True):
                story.append((pose, seed))
        else:
            chosen = [k % len(stories) for k in action[1]]
            shared.follow(np.array(chosen))
            stories = [list(stories[k]) for k in chosen]
    for particle, story in enumerate(stories):
        alone = SharedMaps(1, RESOLUTION_M)
        for pose, seed in story:
            add(alone, [pose], seed)
        assert cells(shared, particle) == cells(alone, 0)
    assert references(shared)
    assert shared.patches() == len(patches(shared))


def references(maps):
    """Whether each tile has as many references as tables point to it, and is free without any."""
    arrays = maps.arrays
    for table, stock in ((arrays.visit_tiles, arrays.visit_stock),
                         (arrays.hit_tiles, arrays.hit_stock)):
        counted = np.bincount(table.ravel(), minlength=len(stock.refs))[1:]
        free = np.sort(stock.free[:stock.free_count[0]])
        if not (counted == stock.refs[1:]).all() or not np.array_equal(
                free, np.flatnonzero(counted == 0) + 1):
            return False
    return True


def far_apart():
    """A scan of each particle, none near another's."""
    maps = SharedMaps(PARTICLES, RESOLUTION_M)
    add(maps, [(40.0 * k, 0.0, 0.0) for k in range(PARTICLES)], 1)
    return maps


def test_particles_share_what_they_have_in_common():
    maps = far_apart()
    maps.follow(np.full(PARTICLES, 2))
    shared = (maps.arrays.visit_stock.refs > 0).sum()
    assert maps.arrays.visit_stock.refs.max() == PARTICLES  # and the tiles of the others are free
    assert all(cells(maps, k) == cells(maps, 2) for k in range(PARTICLES))
    before = cells(maps, 2)
    add(maps, [(0.0, -40.0 * k, 0.0) for k in range(1, PARTICLES + 1)], 2)  # none on shared tiles
    assert all(cells(maps, k).items() >= before.items() for k in range(PARTICLES))
    assert (maps.arrays.visit_stock.refs == PARTICLES).sum() == shared
    assert references(maps)


def test_a_count_that_is_not_kept_is_seen():
    maps = far_apart()
    maps.arrays.visit_stock.refs[1:] += 1
    assert not references(maps)


def patches(maps):
    """The patches of all particles, each once: its place, and its tiles by theirs."""
    arrays, found = maps.arrays, set()
    for table in arrays.visit_tiles:
        own = {}
        for place in np.flatnonzero(table).tolist():
            row, column = divmod(place, arrays.columns)
            key = (row + arrays.low) * SIDE // 32, (column + arrays.left) * SIDE // 32
            own.setdefault(key, []).append((place, int(table[place])))
        found |= {(key, tuple(tiles)) for key, tiles in own.items()}
    return found


def test_a_patch_is_a_particle_s_own_from_its_first_write_to_it_on():
    maps = far_apart()
    apart = maps.patches()
    assert apart >= PARTICLES * 9  # of 3.2 m, under a scan that reaches 6 m to each side
    maps.follow(np.full(PARTICLES, 2))
    shared = maps.patches()
    assert PARTICLES * shared <= 1.5 * apart  # 9 to 16, as they lie
    add(maps, [(80.0, 0.0, 0.0)] * PARTICLES, 1)  # each writes to all that they share
    assert maps.patches() == PARTICLES * shared

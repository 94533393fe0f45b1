"""Maps that choose one source in each cell: as made from scratch, with only their changes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from desim.middleware.contents import LaserScan
from desim.monitor.coverage import states
from desim.ports import GridSpec
from desim.robot.mapping.fusion import RULES, robot_map_of
from desim.robot.mapping.robot_map import RobotMap
from desim.robot.mapping.tiles import FREE, OCCUPIED, TilePool

SPEC = GridSpec(0.2, 70, 50, 0.0, 0.0)

# A source (0: the robot itself), a place, a heading, and what all beams read.
sightings = st.lists(st.tuples(st.integers(0, 3), st.floats(1.0, 13.0), st.floats(1.0, 9.0),
                               st.floats(-3.0, 3.0), st.sampled_from([1.0, 2.0, 4.0])),
                     min_size=1, max_size=12)


def chosen(rule, cells):
    """The choice among the log-odds of a cell, own first, in plain words."""
    if rule == "max":
        return max(cells, key=abs)
    known = [one for one in cells if one <= FREE or one >= OCCUPIED]
    return known[0] if known else cells[0]


def played(rule, seen, check):
    pool = TilePool()
    own = robot_map_of(SPEC, pool, rule)
    others = [RobotMap(SPEC, pool) for _ in range(3)]
    for version, (source, *pose, range_m) in enumerate(seen):
        scan = LaserScan(0, np.full(12, range_m, np.float32), -1.5, 0.25, 26.0)
        if source == 0:
            own.integrate_scan(*pose, scan, 25.0)
        else:
            other = others[source - 1]
            other.integrate_scan(*pose, scan, 25.0)
            own.receive([(f"robot_{source}", version, other.own.snapshot())])
        check(own)
    return own


@settings(max_examples=25)
@pytest.mark.parametrize("rule", RULES)
@given(seen=sightings)
def test_each_cell_is_as_the_rule_says(rule, seen):
    def check(own):
        assert np.array_equal(own.fused, own.fusion_of(own.layers()))

    own = played(rule, seen, check)
    layers = np.stack([layer.cells() for layer in own.layers()]).reshape(len(own.layers()), -1)
    differing = np.flatnonzero(np.ptp(layers, axis=0))[::17]
    assert [chosen(rule, layers[:, cell].tolist()) for cell in differing] == own.fused.reshape(
        -1)[differing].tolist()


@settings(max_examples=25)
@pytest.mark.parametrize("rule", RULES)
@given(seen=sightings)
def test_only_changes_of_knowledge_are_announced_with_their_tiles_and_rows(rule, seen):
    before = np.full((6, 1024), -1)
    version = 0

    def check(own):
        nonlocal before, version
        now = states(own.fused)
        rows = (now != before).reshape(6, 32, 32).any(axis=2)
        assert own.version == version + bool(rows.any())
        if own.version > version:
            assert ((own.tile_version == own.version) == rows.any(axis=1)).all()
            assert ((own.row_version == own.version) == rows).all()
        before, version = now, own.version

    played(rule, seen, check)


def test_the_rules_differ_where_sources_disagree():
    """One hit against three misses: the sum says free, the strongest free, the first occupied."""
    def choice(rule, *evidence):
        """The choice among the log-odds of a cell, own first."""
        data = np.zeros((1 + len(evidence), 1024), np.int8)
        data[1:, 5] = evidence
        return RULES[rule](data, np.arange(1, len(data), dtype=np.int32)[:, None])[0, 5]

    assert (choice("max", 17, -24), choice("greedy", 17, -24)) == (-24, 17)
    assert choice("greedy", 0, -8) == -8
    assert choice("max", 8, -8) == 8  # among equals its own

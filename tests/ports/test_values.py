"""The small values that plug-ins and the simulator hand each other."""

import numpy as np
import pytest
from pydantic import ValidationError

from desim.errors import InputError
from desim.ports import Antennas, GridSpec, Obstacles
from desim.ports.antenna import Antenna, table
from desim.ports.cases import Check, Flow, Setup
from desim.ports.localization import LaserGeometry
from desim.ports.materials import NAMES, index
from desim.ports.strategies import TeamLink
from desim.ports.tasks import Ground
from desim.ports.terrain import Wall, Walled


def test_a_raster_of_cells_of_half_a_metre():
    grid = GridSpec(0.5, 30, 11, -4.0, 2.0)
    assert grid.bounds() == (-4.0, 2.0, 11.0, 7.5) and grid.cells == 330
    assert grid.cell(-4.0, 2.0) == (0, 0) and grid.cell(-3.5, 3.4) == (1, 2)
    assert grid.cell(-4.1, 1.0) == (-1, -2)
    assert Ground(grid, np.zeros((11, 30), np.uint8), np.ones((11, 30), bool)).cell_m2 == 0.25


def test_a_check_holds_up_to_its_tolerance():
    assert Check("goodput", 9.5, 9.0, 0.5).holds and Check("goodput", 8.5, 9.0, 0.5).holds
    assert not Check("goodput", 9.625, 9.0, 0.5).holds
    assert not Check("goodput", float("nan"), 9.0, 0.5).holds


def test_a_flow_is_plain_and_all_of_it_counts_unless_more_is_said():
    flow = Flow("a", ("b",), 100, 50)
    assert (flow.every_ns, flow.backlog, flow.begin_ns) == (0, 0, 0)
    assert not flow.broadcast and not flow.echo
    assert Setup(None, {}, [], 10).warm_up_ns == 0


def test_antennas_are_columns_that_nobody_writes_to():
    found = table([Antenna(height="2 m", gain="3 dB"), Antenna(power="10 dBm")])
    np.testing.assert_array_equal(found, [[2.0, 0.5], [3.0, 0.0], [np.nan, 10.0]])
    with pytest.raises(ValueError, match="read-only"):
        found.gain_db[0] = 1.0
    np.testing.assert_array_equal(table([]), np.zeros((3, 0)))
    np.testing.assert_array_equal(Antennas.plain(2), [[0.0, 0.0], [0.0, 0.0], [np.nan, np.nan]])


def test_a_material_is_a_row_and_a_wrong_one_has_a_neighbour():
    assert [index(name, "x") for name in NAMES] == list(range(len(NAMES)))
    with pytest.raises(InputError, match=r"^walls.0: unknown material 'glas' \(did you mean "
                                         r"'glass'\?\); allowed: brick, concrete, glass, "):
        index("glas", "walls.0")


def walls(count):
    return [{"from": ("0 m", "0 m"), "to": ("1 m", "0 m")}] * count


def test_ten_thousand_walls_are_not_too_many():
    Walled(walls=tuple(walls(10_000)))
    with pytest.raises(ValidationError, match="at most 10000 items"):
        Walled(walls=tuple(walls(10_001)))


@pytest.mark.parametrize("height, is_one", [("0.001 m", True), ("0 m", False)])
def test_a_wall_has_a_height(height, is_one):
    if is_one:
        assert Wall(**walls(1)[0], height=height).height_m == 0.001
    else:
        with pytest.raises(ValidationError, match="greater than 0"):
            Wall(**walls(1)[0], height=height)


def meeting(segments, pairs):
    """Each line meets the wall of its own number."""
    assert segments.shape == (3, 4)
    return np.repeat(np.arange(len(pairs)), 2).reshape(-1, 2)


def obstacles(toll=None):
    return Obstacles(np.zeros((3, 4)), np.zeros(3, int), np.zeros(3), np.zeros(3), ("wood",), 0,
                     meeting, toll=toll)


def test_the_toll_of_a_line_is_the_sum_over_its_walls():
    lines, cost, most = np.zeros((2, 4)), np.array([5.0, 7.0, 9.0]), np.full(2, np.inf)
    assert obstacles().tolls(lines, cost, most).tolist() == [5.0, 7.0]
    assert obstacles().crossings(lines).tolist() == [[0, 0], [1, 1]]


def test_a_world_may_add_the_tolls_up_itself():
    own = obstacles(lambda segments, pairs, cost, most: (segments.shape, pairs, cost, most))
    assert own.tolls("pairs", "cost", "most") == ((3, 4), "pairs", "cost", "most")


def test_a_teammate_may_have_no_signal():
    assert TeamLink(1).signal_dbm is None
    assert TeamLink(1, lambda: -60.0).signal_dbm == -60.0


def test_a_laser_is_at_the_middle_of_its_robot_unless_more_is_said():
    assert LaserGeometry(0.0, 0.1, 8.0).mount == (0.0, 0.0, 0.0)

"""Generated terrains: the smallest and the largest that is allowed, and words for all beyond."""

import pytest

from desim.scenario.generated_terrain import complaints, narrow
from desim.scenario.schema.generated import (
    GeneratedMaze,
    GeneratedOffice,
    GeneratedWarehouse,
    Maze,
    Office,
    Warehouse,
)


def metres(*lengths):
    return tuple(f"{length} m" for length in lengths)


def maze(width, depth, cell=8):
    return GeneratedMaze(maze=Maze(size=metres(width, depth), cell=f"{cell} m"))


def office(width, depth, room=(4, 10), door=1.2):
    return GeneratedOffice(office=Office(size=metres(width, depth), room=metres(*room),
                                         door=f"{door} m"))


def warehouse(width, depth, rack=(2.4, 20)):
    return GeneratedWarehouse(warehouse=Warehouse(size=metres(width, depth), rack=metres(*rack)))


def found(terrain):
    return list(complaints(("t",), terrain))


@pytest.mark.parametrize("terrain", [
    maze(8, 8), maze(316, 316, 1), maze(100_000, 1, 1),
    office(10.4, 10.5), office(10.5, 10.4), office(30, 20, (4, 8)), office(30, 20, door=4),
    warehouse(8.4, 34), warehouse(8.4, 40)])
def test_what_just_fits_is_allowed(terrain):
    assert found(terrain) == []


NO_CORRIDOR = ("has no space for a corridor between two rooms, got {}; allowed: both sides at "
               "least 10.4 m, the longer one above {}")


@pytest.mark.parametrize("terrain, kind, key, says", [
    (maze(7.9, 9), "maze", "size",
     "has no space for one cell, got 7.9 m x 9 m; allowed: at least 8 m x 8 m"),
    (maze(100_001, 1, 1), "maze", "size", "has space for 100001 cells; allowed: at most 100000"),
    (office(20, 20, (0, 10)), "office", "room", "the largest side must be at least twice the "
     "least, which is above zero, got 0 m to 10 m"),
    (office(20, 20, (4, 7.9)), "office", "room", "the largest side must be at least twice the "
     "least, which is above zero, got 4 m to 7.9 m"),
    (office(20, 20, door=4.1), "office", "door",
     "must be at most the least side of a room, 4 m, got 4.1 m"),
    (office(10.3, 20), "office", "size", NO_CORRIDOR.format("10.3 m x 20 m", "10 m")),
    (office(10.4, 12, (4, 12)), "office", "size", NO_CORRIDOR.format("10.4 m x 12 m", "12 m")),
    (office(2000, 2000), "office", "size", "has space for 250000 rooms; allowed: at most 100000"),
    (warehouse(20, 50, (0, 20)), "warehouse", "rack", "must be above zero, got 0 m x 20 m"),
    (warehouse(20, 50, (2, 0)), "warehouse", "rack", "must be above zero, got 2 m x 0 m"),
    (warehouse(8.3, 34), "warehouse", "size",
     "has no space for one rack with its aisles, got 8.3 m x 34 m; allowed: at least 8.4 m x 34 m"),
    (warehouse(8.4, 33.9), "warehouse", "size",
     "has no space for one rack with its aisles, got 8.4 m x 33.9 m; allowed: at least "
     "8.4 m x 34 m"),
    (warehouse(5403, 2500), "warehouse", "size",
     "has space for 103000 racks; allowed: at most 100000")])
def test_what_does_not_fit_is_said_with_what_would(terrain, kind, key, says):
    assert found(terrain) == [(("t", kind, key), says)]


@pytest.mark.parametrize("terrain, passages", [
    (maze(80, 80, 3), {("maze", "cell"): 3.0}),
    (office(30, 20), {("office", "corridor"): 2.4, ("office", "door"): 1.2}),
    (warehouse(30, 60), {("warehouse", "aisle"): 3.0, ("warehouse", "cross_aisle"): 4.0,
                         ("warehouse", "docks"): 10.0})])
def test_a_body_as_wide_as_a_passage_goes_through(terrain, passages):
    for width_m in passages.values():
        narrower = {key for key, passage_m in passages.items() if passage_m < width_m}
        assert {path[1:] for path, _ in narrow(("t",), terrain, width_m, "long")} == narrower
    says = [text for _, text in narrow(("t",), terrain, 11.0, "long")]
    assert says == [f"{passage_m:g} m is too narrow for long; allowed: at least its width of 11 m"
                    for passage_m in passages.values()]

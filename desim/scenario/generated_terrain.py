"""The checks of a terrain that is generated: its parts fit into its size, and robots through it."""

from __future__ import annotations

from desim.scenario.checks import Found
from desim.scenario.schema.generated import (
    Generated,
    GeneratedMaze,
    GeneratedOffice,
    Maze,
    Office,
    Warehouse,
)
from desim.scenario.source_places import Path
from desim.units import LENGTH

MOST_PARTS = 100_000  # cells, rooms or racks: walls are drawn one by one, 10 us each


def complaints(path: Path, terrain: Generated) -> Found:
    """All that does not fit together in ``terrain``, which stands at ``path``."""
    if isinstance(terrain, GeneratedMaze):
        yield from _maze((*path, "maze"), terrain.maze)
    elif isinstance(terrain, GeneratedOffice):
        yield from _office((*path, "office"), terrain.office)
    else:
        yield from _warehouse((*path, "warehouse"), terrain.warehouse)


def narrow(path: Path, terrain: Generated, width_m: float, name: str) -> Found:
    """The passages that are too narrow for a body of the type ``name``, ``width_m`` wide."""
    for place, passage_m in _passages(terrain):
        if passage_m < width_m:
            yield (*path, *place), (f"{LENGTH.format(passage_m)} is too narrow for {name}; "
                                    f"allowed: at least its width of {LENGTH.format(width_m)}")


def _passages(terrain: Generated) -> list[tuple[Path, float]]:
    """The least width of each kind of passage, and the key that it follows from."""
    if isinstance(terrain, GeneratedMaze):
        return [(("maze", "cell"), terrain.maze.cell_m)]
    if isinstance(terrain, GeneratedOffice):
        office = terrain.office
        return [(("office", "corridor"), office.corridor_m), (("office", "door"), office.door_m)]
    house = terrain.warehouse
    return [(("warehouse", "aisle"), house.aisle_m),
            (("warehouse", "cross_aisle"), house.cross_aisle_m),
            (("warehouse", "docks"), house.docks_m)]


def _maze(path: Path, maze: Maze) -> Found:
    cols, rows = maze.cells
    if not cols * rows:
        yield _small(path, maze.size_m, (maze.cell_m, maze.cell_m), "one cell")
    yield from _many(path, cols * rows, "cells")


def _office(path: Path, office: Office) -> Found:
    least, largest = office.room_m
    if least <= 0 or largest < 2 * least:
        yield (*path, "room"), ("the largest side must be at least twice the least, which is above "
                                f"zero, got {LENGTH.format(least)} to {LENGTH.format(largest)}")
        return
    if office.door_m > least:
        yield (*path, "door"), (f"must be at most the least side of a room, {LENGTH.format(least)},"
                                f" got {LENGTH.format(office.door_m)}")
    shorter, longer = sorted(office.size_m)
    floor_m = 2 * least + office.corridor_m
    if shorter < floor_m or longer <= largest:
        yield (*path, "size"), (
            f"has no space for a corridor between two rooms, got {_by(office.size_m)}; allowed: "
            f"both sides at least {LENGTH.format(floor_m)}, the longer one above "
            f"{LENGTH.format(largest)}")
    yield from _many(path, int(shorter / least) * int(longer / least), "rooms")


def _warehouse(path: Path, house: Warehouse) -> Found:
    rack_m, length_m = house.rack_m
    if min(house.rack_m) <= 0:
        yield (*path, "rack"), f"must be above zero, got {_by(house.rack_m)}"
        return
    columns, blocks = house.racks
    if not columns * blocks:
        needed = (rack_m + 2 * house.aisle_m, house.docks_m + length_m + house.cross_aisle_m)
        yield _small(path, house.size_m, needed, "one rack with its aisles")
    yield from _many(path, columns * blocks, "racks")


def _small(path: Path, size_m: tuple[float, float], needed_m: tuple[float, float],
           what: str) -> tuple[Path, str]:
    return (*path, "size"), (f"has no space for {what}, got {_by(size_m)}; allowed: at least "
                             f"{_by(needed_m)}")


def _many(path: Path, count: int, what: str) -> Found:
    if count > MOST_PARTS:
        yield (*path, "size"), f"has space for {count} {what}; allowed: at most {MOST_PARTS}"


def _by(size_m: tuple[float, float]) -> str:
    return f"{LENGTH.format(size_m[0])} x {LENGTH.format(size_m[1])}"

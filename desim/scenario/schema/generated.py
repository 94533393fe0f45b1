"""Terrains that are generated from a few numbers and a seed: mazes, offices, warehouses."""

from __future__ import annotations

from pydantic import Field

from desim.ports import Params
from desim.units import Length, Ratio


def fitting(space_m: float, part_m: float) -> int:
    """The number of parts that fit into a space; a micrometre decides nothing."""
    return max(int((space_m + 1e-6) / part_m), 0)


class FloorPlan(Params):
    """The keys of all generated terrains."""

    size_m: tuple[Length, Length] = Field(description="width and depth, centred on the origin")
    seed: int = Field(0, ge=0, le=2**63 - 1, description=(
        "another seed, another terrain; that of the scenario does not matter"))
    material: str = Field("concrete", description="what it is made of, for the radio")


class Maze(FloorPlan):
    """A maze of square cells between thin walls: a spanning tree by recursive backtracking, a
    depth-first search in random order (Buck 2015, Mazes for Programmers), some of whose dead ends
    are opened."""

    cell_m: Length = Field("8 m", gt=0, description=(
        "side of a cell, at least; cells are stretched to fill the size (the paper: roads 8 m "
        "wide)"))
    loops: Ratio = Field("10 %", description=(
        "share of the dead ends that are opened, so that there is a second way (a braid, Buck "
        "2015; 0 %: one way only between any two cells; ours)"))
    thickness_m: Length = Field("0.2 m", description=(
        "of the walls, for the radio; bodies and beams meet lines (one cell of the published "
        "maps)"))

    @property
    def cells(self) -> tuple[int, int]:
        """Columns and rows."""
        width, depth = self.size_m
        return fitting(width, self.cell_m), fitting(depth, self.cell_m)


class Office(FloorPlan):
    """An office of corridors and rooms with a door along them: binary space partitioning (Shaker,
    Togelius and Nelson 2016, Procedural Content Generation in Games, chapter 3)."""

    corridor_m: Length = Field("2.4 m", gt=0, description="width (ours: two robots can pass)")
    room_m: tuple[Length, Length] = Field(("4 m", "10 m"), description=(
        "least and largest side of a room; the largest is at least twice the least (ours)"))
    door_m: Length = Field("1.2 m", gt=0, description=(
        "width of the openings, which stand open (ours; DIN 18040-1: at least 0.9 m)"))
    material: str = Field("plasterboard", description="what the walls inside are made of")
    thickness_m: Length = Field("0.1 m", description=(
        "of the walls inside, for the radio; bodies and beams meet lines (a stud wall: DIN 18183)"))


class Warehouse(FloorPlan):
    """A warehouse with parallel aisles and several cross aisles (Roodbergen and De Koster 2001,
    International Journal of Production Research 39): racks, which are solid blocks, and a free
    strip at the docks on the lower side."""

    rack_m: tuple[Length, Length] = Field(("2.4 m", "20 m"), description=(
        "depth of a double rack, and its length, at least; racks are stretched along the aisles to "
        "fill the size (ours; two EUR pallets of 1.2 m back to back)"))
    aisle_m: Length = Field("3 m", gt=0, description=(
        "width of the aisles between racks, at least (ours; reach trucks need 2.8 m)"))
    cross_aisle_m: Length = Field("4 m", gt=0, description="width of those across (ours)")
    docks_m: Length = Field("10 m", gt=0, description="depth of the free strip (ours)")
    missing: Ratio = Field("10 %", description="share of racks that are not there (ours)")
    material: str = Field("wood", description=(
        "what racks and goods are made of: it attenuates a signal where that enters and leaves one "
        "(wood: 8 dB together; Rappaport 2002, Wireless Communications, Table 4.3: 6 dB for a rack "
        "of tightly packed paper, 20 dB for one of metal parts)"))

    @property
    def racks(self) -> tuple[int, int]:
        """Columns of racks side by side, and blocks of them one behind the other."""
        (width, depth), (rack_m, length_m) = self.size_m, self.rack_m
        return (fitting(width - self.aisle_m, rack_m + self.aisle_m),
                fitting(depth - self.docks_m, length_m + self.cross_aisle_m))


class GeneratedMaze(Params):
    """A maze by seed and size."""

    maze: Maze


class GeneratedOffice(Params):
    """An office by seed and size."""

    office: Office


class GeneratedWarehouse(Params):
    """A warehouse by seed and size."""

    warehouse: Warehouse


Generated = GeneratedMaze | GeneratedOffice | GeneratedWarehouse
# By the key that chooses one.
GENERATED: dict[str, type[FloorPlan]] = {"maze": Maze, "office": Office, "warehouse": Warehouse}

"""The environment family: terrain, doors, moving obstacles, people."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from desim.ports import Params
from desim.ports.terrain import Wall
from desim.scenario.schema.generated import GeneratedMaze, GeneratedOffice, GeneratedWarehouse
from desim.scenario.schema.shapes import BY_SHAPE
from desim.units import Duration, Length, Position, Speed

BUILT_IN_TERRAINS = ("loop", "cross", "zigzag", "maze")  # the paper's four


class MapFile(Params):
    """A ROS map_server YAML with its image (PGM or PNG). Unknown cells are solid. A key of the YAML
    that ROS does not know, ``materials``, can say which grey value is made of what, for the radio:
    ``materials: {0: concrete, 40: glass}``."""

    map: str = Field(description="path of the YAML file, relative to the scenario that names it")
    image: str | None = Field(None, description="image file to use instead of the one that the "
                                                "YAML names, relative to the YAML file")
    offset_m: tuple[Position, Position] = Field(
        ("0 m", "0 m"), description="added to the map's own coordinates")
    height_m: Length = Field("2 m", gt=0, description="of what is solid (the paper)")
    material: str = Field("concrete", description=(
        "of what is solid, for the radio: of all of it, or if the YAML has materials of cells that "
        "are unknown"))


class Rectangle(Params):
    """A solid block."""

    x_m: tuple[Position, Position] = Field(description="from, to")
    y_m: tuple[Position, Position] = Field(description="from, to")
    material: str = Field("concrete", description="what it is made of, for the radio")
    height_m: Length = Field("2 m", gt=0, description="(the paper: obstacles 2 m high)")


class Polygon(Params):
    """A solid block of any outline, whose sides do not cross each other."""

    points_m: tuple[tuple[Position, Position], ...] = Field(
        min_length=3, max_length=1000, description="its corners, in order around it")
    material: str = Field("concrete", description="what it is made of, for the radio")
    height_m: Length = Field("2 m", gt=0, description="(the paper: obstacles 2 m high)")


class Drawing(Params):
    """Terrain drawn with characters, rows from the top. ``walls``: posts '+', walls '--' and '|'
    between cells of ``cell`` size (as the paper's maze); or blocks: '#' solid, '.' and space free.
    """

    lines: tuple[str, ...] = Field(min_length=1)
    cell_m: Length = Field("8 m", gt=0, description="(the paper: roads 8 m wide)")
    style: Literal["walls", "blocks"] = "walls"
    material: str = Field("concrete", description="what it is made of, for the radio")
    height_m: Length = Field("2 m", gt=0, description="(the paper)")


class Shape(Params):
    """A terrain written out in the scenario. Its bounds are walls."""

    size_m: tuple[Length, Length] = Field(description="width and depth")
    centre_m: tuple[Position, Position] = Field(("0 m", "0 m"), description="of the bounds")
    rectangles: tuple[Rectangle, ...] = ()
    polygons: tuple[Polygon, ...] = ()
    walls: tuple[Wall, ...] = ()
    drawing: Drawing | None = None


class Door(Params):
    """A wall that is there only while the door is closed."""

    start_m: tuple[Position, Position] = Field(alias="from")
    end_m: tuple[Position, Position] = Field(alias="to")
    open_ns: tuple[tuple[Duration, Duration], ...] = Field((), description=(
        "intervals [from, to) of simulated time in which the door stands open, in order"))
    material: str = Field("wood", description="what it is made of, for the radio")
    thickness_m: Length = "0.05 m"
    height_m: Length = Field("2 m", gt=0)


class MovingObstacle(Params):
    """A disc that drives along way points, there and back."""

    path_m: tuple[tuple[Position, Position], ...] = Field(min_length=2)
    speed_mps: Speed = Field("0.5 m/s", gt=0, description="(a slow walk)")
    radius_m: Length = Field("0.3 m", gt=0)


class People(Params):
    """A group of people who walk along way points, there and back, or round and round where the
    last is the first (the social force model: Helbing and Molnar 1995)."""

    count: int = Field(ge=1, le=2000)
    path_m: tuple[tuple[Position, Position], ...] = Field(min_length=2)
    width_m: Length = Field("2 m", description="of the way: each keeps to a line within it")
    groups: float = Field(0.0, ge=0, le=10, description=(
        "lambda of the sizes of those who walk together, a zero-truncated Poisson distribution (0: "
        "everybody is alone; Moussaid et al. 2010: 0.83 in a square, 1.11 in a shopping street)"))
    gives_way: bool = Field(True, description=(
        "to robots, as to people; false: they stop when they would touch one"))


class Environment(Params):
    """The surroundings of the fleet."""

    terrain: Annotated[str | MapFile | Shape | GeneratedMaze | GeneratedOffice
                       | GeneratedWarehouse, BY_SHAPE] = Field("maze", description=(
        "loop, cross, zigzag, maze (the paper's four), a map_server YAML, a shape written out, or "
        "a maze, office or warehouse by seed and size"))
    doors: tuple[Door, ...] = ()
    moving_obstacles: tuple[MovingObstacle, ...] = ()
    people: tuple[People, ...] = ()

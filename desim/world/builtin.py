"""The paper's four terrains (Yan, Fabresse, Laval and Bouraqadi 2017, Figure 4).

They are 80 m x 80 m with roads 8 m wide and obstacles 2 m high, centred on the origin.
"""

from __future__ import annotations

from desim.scenario.schema.environment import Shape

SIZE = {"size": ("80 m", "80 m")}

MAZE = """\
+--+--+--+--+--+--+--+--+--+--+
|                    |     |  |
+  +--+--+--+  +  +--+  +--+  +
|  |           |        |     |
+  +  +--+--+--+  +--+  +  +  +
|  |        |        |  |  |  |
+  +--+  +--+  +--+  +--+--+  +
|     |        |  |  |        |
+  +--+  +  +--+  +  +  +--+  +
|        |        |        |  |
+  +--+  +  +--+  +--+  +--+--+
|  |  |  |     |        |     |
+  +  +--+  +  +  +--+  +  +--+
|     |     |  |     |        |
+  +--+--+  +  +--+  +--+  +--+
|        |  |           |     |
+  +--+--+  +  +--+  +--+  +--+
|     |        |  |        |  |
+  +--+  +--+--+  +  +  +  +  +
|                    |  |     |
+--+--+--+--+--+--+--+--+--+--+
"""


def _block(x0: int, y0: int, x1: int, y1: int) -> dict:
    return {"x": (f"{x0} m", f"{x1} m"), "y": (f"{y0} m", f"{y1} m")}


def _loop() -> Shape:
    """One block; the road is the ring around it."""
    return Shape(**SIZE, rectangles=[_block(-32, -32, 32, 32)])


def _cross() -> Shape:
    """Four blocks; the roads are the ring and the cross between them."""
    spans = ((-32, -4), (4, 32))
    return Shape(**SIZE, rectangles=[_block(x0, y0, x1, y1)
                                     for x0, x1 in spans for y0, y1 in spans])


def _zigzag() -> Shape:
    """Nine walls and ten roads. The first wall from the left leaves its gap at the top."""
    walls = []
    for i, x in enumerate(range(-32, 33, 8)):
        low, high = (-40, 32) if i % 2 == 0 else (-32, 40)
        walls.append({"from": (f"{x} m", f"{low} m"), "to": (f"{x} m", f"{high} m")})
    return Shape(**SIZE, walls=walls)


def _maze() -> Shape:
    """Thin walls on a grid of 10 x 10 cells."""
    return Shape(**SIZE, drawing={"lines": MAZE.splitlines()})


BUILTIN = {"cross": _cross, "loop": _loop, "maze": _maze, "zigzag": _zigzag}

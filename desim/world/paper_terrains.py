"""The paper's four terrains (Yan, Fabresse, Laval and Bouraqadi 2017, Figure 4).

They are 80 m x 80 m with roads 8 m wide and obstacles 2 m high, centred on the origin.
"""

from itertools import cycle

from desim.scenario.schema.environment import Shape

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


ABOUT = {
    "loop": "One block; the road is the ring around it.",
    "cross": "Four blocks; the roads are the ring and the cross between them.",
    "zigzag": "Nine walls and ten roads. The first wall from the left leaves its gap at the top.",
    "maze": "Thin walls on a grid of 10 x 10 cells.",
}
BUILTIN: dict[str, dict] = {
    "cross": {"rectangles": [_block(x, y, x + 28, y + 28) for x in (-32, 4) for y in (-32, 4)]},
    "loop": {"rectangles": [_block(-32, -32, 32, 32)]},
    "maze": {"drawing": {"lines": MAZE.splitlines()}},
    "zigzag": {"walls": [{"from": (f"{x} m", f"{low} m"), "to": (f"{x} m", f"{low + 72} m")}
                         for x, low in zip(range(-32, 33, 8), cycle((-40, -32)), strict=False)]},
}


def shape(name: str) -> Shape:
    """The terrain of this name."""
    return Shape(size=("80 m", "80 m"), **BUILTIN[name])

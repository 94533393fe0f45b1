"""The colours of all pictures: robots, lines of figures, terrain, links."""

from __future__ import annotations

Colour = tuple[float, float, float]

# Okabe and Ito's (2008) and Paul Tol's, which colour-blind readers can tell apart, on light paper;
# without their orange-red, which is that of a busy link. The replay page has the same
# (``assets/page/theme.css``).
ROBOTS = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#4a3aa7", "#56b4e9", "#8f8b1e", "#882255",
          "#2a9d97")
# Okabe and Ito's, without the yellow that white paper swallows.
LINES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f6bb2", "#8c8c8c")


def parsed(text: str) -> Colour:
    """Red, green and blue, 0 to 1, of ``#0072b2``."""
    red, green, blue = (int(text[i:i + 2], 16) / 255 for i in (1, 3, 5))
    return red, green, blue


def of_robot(number: int) -> Colour:
    """The colour of robot ``number``. Fleets are larger than any palette: it repeats."""
    return parsed(ROBOTS[number % len(ROBOTS)])


WALL = parsed("#4a5361")
_MATERIALS = {"wood": "#a9743b", "glass": "#6fb7c9", "metal": "#7d8590", "brick": "#9b5a4a"}
QUIET, BUSY = parsed("#8fa3b8"), parsed("#d55e00")


def of_material(name: str) -> Colour:
    """The colour of what stands in the terrain."""
    return parsed(_MATERIALS[name]) if name in _MATERIALS else WALL


def between(one: Colour, other: Colour, share: float) -> Colour:
    """The colour at ``share`` of the way from one to the other."""
    red, green, blue = (a + share * (b - a) for a, b in zip(one, other, strict=True))
    return red, green, blue

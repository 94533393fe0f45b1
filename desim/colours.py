"""The colours of an export: robots, terrain, links."""

from __future__ import annotations

import colorsys

Colour = tuple[float, float, float]

# Okabe and Ito's, which colour-blind readers can tell apart; yellow and black are left out.
_DISTINCT = ("#0072b2", "#e69f00", "#009e73", "#d55e00", "#cc79a7", "#56b4e9")
_GOLDEN = 0.6180339887  # turns of the colour wheel: neighbours differ


def parsed(text: str) -> Colour:
    """Red, green and blue, 0 to 1, of ``#0072b2``."""
    red, green, blue = (int(text[i:i + 2], 16) / 255 for i in (1, 3, 5))
    return red, green, blue


def of_robot(number: int, count: int) -> Colour:
    """The colour of robot ``number`` of ``count``."""
    if count <= len(_DISTINCT):
        return parsed(_DISTINCT[number])
    return colorsys.hls_to_rgb(number * _GOLDEN % 1.0, (0.42, 0.55)[number % 2], 0.62)


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

"""Warehouses: racks in parallel aisles with several cross aisles."""

from __future__ import annotations

import numpy as np

from desim.scenario.schema.environment import Rectangle, Shape
from desim.scenario.schema.generated import Warehouse
from desim.world.generated.walls import length


def shape(plan: Warehouse, rng: np.random.Generator) -> Shape:
    """The warehouse: the free strip at the docks, then blocks of racks with a cross aisle behind
    each, in columns with an aisle on either side."""
    width, depth = plan.size_m
    columns, blocks = plan.racks
    aisle_m = (width - columns * plan.rack_m[0]) / (columns + 1)
    block_m = (depth - plan.docks_m) / blocks
    racks = []
    for block in range(blocks):
        y = plan.docks_m - depth / 2 + block * block_m
        for column in range(columns):
            x = column * plan.rack_m[0] + (column + 1) * aisle_m - width / 2
            if rng.random() >= plan.missing:
                racks.append(Rectangle(
                    x=(length(x), length(x + plan.rack_m[0])),
                    y=(length(y), length(y + block_m - plan.cross_aisle_m)),
                    material=plan.material))
    return Shape(size=(length(width), length(depth)), rectangles=tuple(racks))

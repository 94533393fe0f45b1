"""Drawn walls, of terrains and of network cases."""

from __future__ import annotations

from pydantic import Field

from desim.ports.parameters import Params
from desim.units import Length, Position


class Wall(Params):
    """A straight thin wall. Its thickness matters to the radio alone; bodies and beams meet the
    line itself."""

    start_m: tuple[Position, Position] = Field(alias="from", description="one end, [x, y]")
    end_m: tuple[Position, Position] = Field(alias="to", description="the other end")
    material: str = Field("concrete", description="what it is made of, for the radio")
    thickness_m: Length = Field("0.2 m", description="(one cell of the published maps)")
    height_m: Length = Field("2 m", gt=0, description="(the paper)")


class Walled(Params):
    """The surroundings of a network case: walls, and open ground."""

    walls: tuple[Wall, ...] = Field((), max_length=10_000, description="as in a scenario's terrain "
                                                                       "(none)")

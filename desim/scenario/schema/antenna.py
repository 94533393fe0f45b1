"""The antennas of robots and of stationary hosts."""

from __future__ import annotations

from pydantic import Field

from desim.ports import Params
from desim.units import Decibels, Length, Level


class Antenna(Params):
    """An antenna, and what is sent with it. Only network models with antennas read this (radio)."""

    height_m: Length = Field("0.5 m", description=(
        "above the ground, or above what an aerial robot flies at: walls count whose top is higher "
        "than the straight line between two antennas (our estimate: on the deck of a robot)"))
    gain_db: Decibels = Field("0 dB", description=(
        "by which it sends and receives better than the medium's antennas (0: it is one of them)"))
    power_dbm: Level | None = Field(None, description=(
        "sent, without that gain (null: the medium's power)"))

"""The antennas of robots and of stationary hosts."""

from __future__ import annotations

from collections.abc import Iterable
from math import nan

import numpy as np
from pydantic import Field

from desim.ports.networks import Antennas
from desim.ports.parameters import Params
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


def table(antennas: Iterable[Antenna]) -> Antennas:
    """The antennas of hosts, in their order, as network models see them."""
    columns = np.array([(one.height_m, one.gain_db, nan if one.power_dbm is None else one.power_dbm)
                        for one in antennas]).reshape(-1, 3).T.copy()
    columns.flags.writeable = False
    return Antennas(*columns)

"""The power that a robot's parts draw.

The defaults are a Pioneer 3-DX with a SICK LMS500; docs/energy.md has their sources.
"""

from __future__ import annotations

from pydantic import Field

from desim.ports import Params
from desim.units import BitRate, Energy, EnergyPerWay, Power


class BasePower(Params):
    """The power of a body with its motors: linear in its speed."""

    idle_w: Power = Field("7.4 W", description=(
        "standing (Mei et al. 2005, not verified: 4.6 microcontroller and 2.8 motors)"))
    motion_jpm: EnergyPerWay = Field("6.5 J/m", description=(
        "in addition, W for each m/s (motors of 10.6 W at 1.2 m/s: Mei et al. 2005, not "
        "verified)"))


class ComputerPower(Params):
    """A robot's computer."""

    idle_w: Power = Field("8 W", description="(Mei et al. 2005, not verified)")
    processor_w: Power = Field("3.5 W", description=(
        "in addition, for each processor that is busy (15 W with both busy: Mei et al. 2005, not "
        "verified)"))


class RadioPower(Params):
    """A robot's network interfaces, all media together."""

    idle_w: Power = Field("0.82 W", description="(ns-3's WifiRadioEnergyModel: 273 mA at 3 V)")
    receive_w: Power = Field("0.94 W", description=(
        "receiving, instead of idle and not below it (ns-3: 313 mA)"))
    send_w: Power = Field("1.14 W", description=(
        "sending, likewise (ns-3: 380 mA)"))
    rate_bps: BitRate = Field("54 Mb/s", description=(
        "at which bytes are sent and received where the network model does not count airtime "
        "(802.11g nominal)"))


class PowerParams(Params):
    """The power that a robot's parts draw while its software runs."""

    base: BasePower = Field(default_factory=BasePower)
    sensors_w: Power = Field("22 W", description=(
        "all together, always on (a SICK LMS500 without heating, not verified)"))
    computer: ComputerPower = Field(default_factory=ComputerPower)
    radio: RadioPower = Field(default_factory=RadioPower)
    battery_j: Energy = Field("260 Wh", description=(
        "of battery_life_s; empty, it stops a robot in the task delivery alone (three of 12 V and "
        "7.2 Ah, not verified)"))

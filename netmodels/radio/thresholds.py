"""The thresholds of receivers, as parameters."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from desim import ports
from desim.units import Decibels, Level
from netmodels.radio.dcf.stations import Reception

# For who has sent (ns-3, HePhy::SwitchMaybeToCcaBusy: CCA by each 20 MHz, 802.11ax, 27.3.20.6.5).
IDLE_DBM = -62.0
_THERMAL_DBM = -100.965  # k T B of 20 MHz at 290 K (Johnson and Nyquist 1928; ns-3)


class ReceiverConstants(ports.Constants):
    """Rules of all receivers of a radio, which preset ns3_3_44 changes."""

    heard_dbm: Level = Field("-101 dBm", description="what is weaker is not even interference "
                                                     "(ns-3: RxSensitivity; 7 dB below the noise)")
    preamble_above_db: Decibels = Field("4 dB", description=(
        "how far a frame must be above noise and interference to be found (ns-3)"))
    unaware: bool = Field(False, description=(
        "interference that came less than 4 us before a stronger frame does it no harm (no "
        "receiver is like that, but ns-3's)"))
    gives_up: bool = Field(False, description=(
        "a frame whose header has errors is given up, and the medium taken for idle until "
        "something new comes (no receiver is like that, but ns-3's)"))
    idle_after_sending: bool = Field(False, description=(
        "who has sent takes the medium for idle below -62 dBm until something new comes (no "
        "receiver is like that, but ns-3's of 11ax in 40 MHz and more)"))
    eifs: Literal["idle", "frame"] = Field("idle", description=(
        "who could not make out a frame waits for EIFS when the medium is idle, or from the end of "
        "that frame (802.11-2016, 10.3.2.3.7; ns-3: frame)"))


class Thresholds(ports.Params):
    """Thresholds and rules of all receivers of a radio."""

    noise_figure_db: Decibels = Field("7 dB", description="noise of the receiver itself (ns-3; "
                                                          "802.11-2016, 17.3.10.2, allows 15 dB)")
    energy_dbm: Level = Field("-62 dBm", description=(
        "whatever it is, it makes the medium busy (802.11-2016, 17.3.10.6; preset ns3_3_44: -82 "
        "dBm)"))
    preamble_dbm: Level | None = Field(None, description=(
        "the least that a frame is found at, and makes the medium busy (null: none but "
        "preamble_above, with which that is -90 dBm; 802.11-2016, 17.3.10.6, asks for -82 dBm or "
        "better, and receivers are better; preset ns3_3_44: -82 dBm)"))
    constants: ReceiverConstants = Field(ReceiverConstants(), description=(
        "single ones that differ (802.11-2016, ns-3)"))

    @property
    def found_dbm(self) -> float:
        """The least that a frame is found at where nobody else is on the air."""
        above_noise_dbm = _THERMAL_DBM + self.noise_figure_db + self.constants.preamble_above_db
        if self.preamble_dbm is None:
            return above_noise_dbm
        return max(above_noise_dbm, self.preamble_dbm)

    def for_stations(self) -> Reception:
        rules = self.constants
        return Reception(_THERMAL_DBM + self.noise_figure_db, self.energy_dbm, self.found_dbm,
                         rules.preamble_above_db, unaware=rules.unaware, gives_up=rules.gives_up,
                         eifs_at_end=rules.eifs == "frame")

"""The model ``radio``: one radio on a ladder of models, from ideal to faithful."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Literal

from pydantic import Field, model_validator

from desim import ports
from netmodels.ideal import Ideal
from netmodels.infrastructure import Infrastructure
from netmodels.infrastructure.access_points import (
    STOPPED,
    AccessPoint,
    names_of,
    with_channels,
)
from netmodels.infrastructure.floods import ENDED
from netmodels.infrastructure.settings import Settings
from netmodels.multihop.hop_choice import as_fast
from netmodels.multihop.multihop import Multihop
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.presets import filled
from netmodels.radio.uncontended import Uncontended

_RUNGS: dict[str, Callable[[DcfRadio.Params], ports.NetworkModel]] = {
    "ideal": lambda params: Ideal(Ideal.Params()),
    "disk": lambda params: Uncontended(params, open_air=True),
    "walls": lambda params: Uncontended(params, open_air=False),
    "mac": DcfRadio,
    "multihop": lambda params: Multihop(Multihop.Params(), DcfRadio(as_fast(params))),
}


class Radio:
    """Wi-Fi (802.11a to ax), ad hoc or over ``access_points``, from the same parameters on each
    rung of a ladder:

    ``multihop``: ``mac``, and hosts relay frames for others, along routes that a protocol finds on
    the same air (``netmodels.multihop``, with its defaults). ``mac``: the whole radio, ``DcfRadio``
    (``desim describe netmodels.radio.dcf.radio:DcfRadio`` says what it does and leaves out):
    contention, collisions, retries, and walls that weaken signals; with ``access_points`` all goes
    over them (``desim describe netmodels.infrastructure:Infrastructure``), which the other rungs
    leave out. ``walls``: each radio has the
    air to itself, and a frame arrives where 90 % of full packets would at its received power,
    through walls. ``disk``: the same without walls and shadowing; its range is where ``mac``
    delivers 90 % in the open, computed from path loss and errors. Like ``walls`` it learns no
    rates: all go at ``rate``. ``ideal``: everything arrives at once and everywhere.

    Times of a sender alone are the same on all of them but ``ideal``, if nothing is aggregated: on
    ``walls`` and ``disk`` each packet of 802.11n, ac and ax goes alone, without the header of QoS,
    so that trains are slower than on ``mac``. Where there are no attempts,
    a unicast frame is lost beyond the range (``out_of_range``).

    Capabilities: those of its rung. Itemizes, LimitsReach, Retransmits, Refuses, CountsAttempts,
    CountsBusyTime, CountsAirtime, KnowsLinks, PredictsSignal, HearsAntennas (``mac``); with
    ``channels``, ``access_points`` or on other rungs, Separates, FollowsHosts, CountsControl,
    NamesChannels, KnowsHandovers, KnowsDepartures.
    """

    class Params(DcfRadio.Params):
        fidelity: Literal["ideal", "disk", "walls", "mac", "multihop"] = Field("mac", description=(
            "the rung; network.fidelity sets it for all media (the whole model)"))
        access_points: tuple[AccessPoint, ...] = Field((), max_length=1000, description=(
            "over which all frames go, on the rung mac; their names are ap_0, ap_1, ... (none: "
            "hosts talk to each other directly)"))
        infrastructure: Settings = Field(Settings(), description=(
            "wires behind the access points, and how stations hang on them (its own defaults)"))

        @model_validator(mode="before")
        @classmethod
        def _filled(cls, given: object) -> object:
            return with_channels(filled(given))

        @property
        def reads_marks(self) -> bool:
            """``ports.ReadsMarks``: where there are access categories and contention."""
            return self.fidelity in ("mac", "multihop") and (self.has_mcs or self.qos)

        def check_hosts(self, hosts: tuple[str, ...]) -> None:
            """``ports.ChecksHosts``: the rung ideal reads nothing."""
            if self.access_points and self.fidelity == "mac":
                Infrastructure(self.infrastructure, self, self.access_points).check(hosts)
            elif self.fidelity != "ideal":
                self.check_radio(hosts)

        def access_point_names(self) -> tuple[str, ...]:
            """``ports.NamesAccessPoints``."""
            return names_of(self.access_points, ()) if self.fidelity == "mac" else ()

        def without_effect(self, scenario: object) -> Iterator[ports.UnusedKeys]:
            """Keys of access points where there are none; where there are some, the channels of
            stations, and keys beside those of others."""
            if not self.access_points:
                yield ports.UnusedKeys(ports.changed_keys(self, "infrastructure"),
                                       "there are no access_points")
            elif self.fidelity != "mac":
                yield ports.UnusedKeys([".access_points"], f"on the rung {self.fidelity} hosts "
                                                           "talk to each other directly")
            else:
                usual = {Radio.Params(card=self.card, standard=self.standard).channel,
                         *(one.channel for one in self.access_points)}
                yield ports.UnusedKeys([] if self.channel in usual else [".channel"],
                                       "stations take the channels of their access points")
                for keys, why in self.infrastructure.unused():
                    yield ports.UnusedKeys([f".infrastructure{key}" for key in keys], why)

    reasons = (*DcfRadio.reasons, "out_of_range", "hop_limit", "no_path",
               "relay_down", "relay_no_path", "relay_queue_full", "not_associated",
               "receiver_not_associated", "roamed", "codel", "downlink_codel",
               "downlink_queue_full", "wires_queue_full", STOPPED, ENDED)

    @staticmethod
    def build(params: Params) -> ports.NetworkModel:
        """The model of the rung that ``params`` name."""
        if params.access_points and params.fidelity == "mac":
            return Infrastructure(params.infrastructure, params, params.access_points)
        return _RUNGS[params.fidelity](params)

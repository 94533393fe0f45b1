"""Rate control: the rate for each receiver, learnt from acknowledgements."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal, Self

import numpy as np
from pydantic import Field, model_validator

from desim import ports
from desim.errors import InputError
from netmodels.radio.best_rate import BestRate, RatioOf
from netmodels.radio.fallback import Arf, ArfOfNs3, FallbackRules
from netmodels.radio.learner import Learner
from netmodels.radio.minstrel.control import MinstrelHt
from netmodels.radio.minstrel.of_ns3 import MinstrelHtOfNs3
from netmodels.radio.standards import Standard


class RateConstants(ports.Constants):
    """The numbers after which a rate changes."""

    up_after: int = Field(10, ge=1, le=1000, description=(
        "acknowledgements in a row before the next faster rate (Kamerman and Monteban)"))
    down_after: int = Field(2, ge=1, le=1000, description=(
        "failures in a row before the next slower rate (Kamerman and Monteban)"))
    timer: int = Field(15, ge=1, le=100_000, description=(
        "attempts since the rate last rose or fell before the next faster one is tried in any case "
        "(ns-3: ArfWifiManager)"))
    most_up_after: int | None = Field(None, ge=1, le=100_000, examples=[50], description=(
        "what failed probes double up_after to at most, of aarf and aarf_ns3 (50: Lacage et al. "
        "2004; aarf_ns3: 60)"))
    bit_errors: float = Field(1e-6, gt=0.0, lt=0.5, description=(
        "the largest share of wrong bits that ideal accepts (ns-3: IdealWifiManager)"))


MINSTRELS: dict[str, type[MinstrelHt | MinstrelHtOfNs3]] = {
    "minstrel_ht": MinstrelHt, "minstrel_ht_ns3": MinstrelHtOfNs3}
_FALLBACKS = "arf", "arf_ns3", "aarf", "aarf_ns3"
_MOST_UP_AFTER = {"aarf": 50, "aarf_ns3": 60}

# The models that each constant is of.
_OF = {"up_after": _FALLBACKS, "down_after": _FALLBACKS, "timer": _FALLBACKS,
       "most_up_after": tuple(_MOST_UP_AFTER), "bit_errors": ("ideal",)}


class RateControl(ports.Params):
    """Rates that are learnt. Automatic rate fallback (``fallback.Arf``): faster after
    acknowledgements in a row, or when the timer says that it is time to try; slower after failures
    in a row. The first attempt at a faster rate is a probe: if it fails, back at once, and with
    AARF the next one comes later. A request to send (RTS) without an answer says nothing about
    rates. An aggregate counts as acknowledged where half of its packets are. Or
    ``best_rate.BestRate``, or ``minstrel.control.MinstrelHt``, as Linux."""

    model: Literal["arf", "arf_ns3", "aarf", "aarf_ns3", "ideal", "minstrel_ht", "minstrel_ht_ns3"
                   ] = Field("arf", description=(
        "arf_ns3, aarf_ns3: count as ns-3's, the preset has the former; aarf: failed probes come "
        "ever later (Lacage et al. 2004); ideal: by the signal that the receiver had last; "
        "minstrel_ht: as Linux 6.1; minstrel_ht_ns3: as ns-3's MinstrelHtWifiManager, of 11n, "
        "11ac, 11ax (Kamerman and Monteban)"))
    constants: RateConstants = Field(RateConstants(), description=(
        "single ones that differ, but of Minstrel (Kamerman and Monteban; ns-3)"))

    @model_validator(mode="after")
    def _refuse(self) -> Self:
        given, usual = self.constants, RateConstants()
        for key, models in _OF.items():
            if self.model not in models and getattr(given, key) != getattr(usual, key):
                raise InputError(f".constants.{key}: {self.model} has none; allowed with "
                                 + ", ".join(models))
        return self

    @property
    def all_streams(self) -> bool:
        """Whether it also chooses between numbers of streams and guard intervals."""
        return self.model not in _FALLBACKS

    def check(self, has_mcs: bool) -> None:
        """Raises ``InputError`` for stations that it cannot be of."""
        if self.model == "minstrel_ht_ns3" and not has_mcs:
            raise InputError(".rate_control.model: minstrel_ht_ns3 is of 11n, 11ac, 11ax; allowed "
                             f"for others: {', '.join(_FALLBACKS)}, ideal, minstrel_ht")

    def of(self, standard: Standard, first: int, tries: int,
           stream: Callable[[str], np.random.Generator], ratio: RatioOf) -> Learner:
        """For frames of ``standard`` that are sent at most ``tries`` times. ``first``: the index of
        the rate to begin with, of those of its modulation; Minstrel has all of the standard's, and
        like ``ideal`` begins with the slowest one. ``ratio``: of signal to noise."""
        self.check(standard.rates[-1].mcs is not None)
        if self.model in MINSTRELS:
            return MINSTRELS[self.model](standard, tries, stream("minstrel_ht"))
        rates = standard.alike(first)
        if self.model == "ideal":
            return BestRate(standard, rates, tries, self.constants.bit_errors, ratio)
        return self.fallback(rates, first)

    def fallback(self, rates: Sequence[int], first: int) -> Arf:
        """``rates`` [k] are indices of the standard's, the slowest first; ``first`` is the one to
        begin with."""
        given = self.constants
        most = given.most_up_after or _MOST_UP_AFTER.get(self.model, given.up_after)
        rules = FallbackRules(given.up_after, given.down_after, given.timer,
                              2 if self.model in _MOST_UP_AFTER else 1, most)
        return (ArfOfNs3 if self.model.endswith("_ns3") else Arf)(rules, rates, first)

"""Rate control: the rate for each receiver, learnt from acknowledgements."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal, Self

import numpy as np
from pydantic import Field, model_validator

from desim import ports
from desim.errors import InputError
from netmodels.radio.learner import Choice, Learner
from netmodels.radio.minstrel.control import MinstrelHt
from netmodels.radio.minstrel.of_ns3 import MinstrelHtOfNs3
from netmodels.radio.standards import Standard


class ArfConstants(ports.Constants):
    """The numbers after which automatic rate fallback changes the rate."""

    up_after: int = Field(10, ge=1, le=1000, description=(
        "acknowledgements in a row before the next faster rate (Kamerman and Monteban)"))
    down_after: int = Field(2, ge=1, le=1000, description=(
        "failures in a row before the next slower rate (Kamerman and Monteban)"))
    timer: int = Field(15, ge=1, le=100_000, description=(
        "attempts since the rate last rose or fell before the next faster one is tried in any case "
        "(ns-3: ArfWifiManager)"))


MINSTRELS: dict[str, type[MinstrelHt | MinstrelHtOfNs3]] = {
    "minstrel_ht": MinstrelHt, "minstrel_ht_ns3": MinstrelHtOfNs3}


class RateControl(ports.Params):
    """Rates that are learnt. Automatic rate fallback (Kamerman and Monteban 1997, "WaveLAN-II: a
    high-performance wireless LAN for the unlicensed band"): faster after acknowledgements in a row,
    or when the timer says that it is time to try; slower after failures in a row. The first attempt
    at a faster rate is a probe: if it fails, back at once. A request to send (RTS) without an
    answer says nothing about rates. An aggregate counts as acknowledged where half of its packets
    are. Or ``minstrel.control.MinstrelHt``, as Linux."""

    model: Literal["arf", "arf_ns3", "minstrel_ht", "minstrel_ht_ns3"] = Field("arf", description=(
        "arf_ns3: counts as ns-3's ArfWifiManager, which the preset has; minstrel_ht: as Linux "
        "6.1; minstrel_ht_ns3: as ns-3's MinstrelHtWifiManager, of 11n, 11ac, 11ax (Kamerman and "
        "Monteban)"))
    constants: ArfConstants = Field(ArfConstants(), description=(
        "single ones of arf and arf_ns3 that differ (Kamerman and Monteban; ns-3)"))

    @model_validator(mode="after")
    def _refuse(self) -> Self:
        if self.all_streams and self.constants != ArfConstants():
            raise InputError(f".constants: {self.model} has none; allowed with arf, arf_ns3")
        return self

    @property
    def all_streams(self) -> bool:
        """Whether it also chooses between numbers of streams and guard intervals."""
        return self.model in MINSTRELS

    def check(self, has_mcs: bool) -> None:
        """Raises ``InputError`` for stations that it cannot be of."""
        if self.model == "minstrel_ht_ns3" and not has_mcs:
            raise InputError(".rate_control.model: minstrel_ht_ns3 is of 11n, 11ac, 11ax; allowed "
                             "for others: arf, arf_ns3, minstrel_ht")

    def of(self, standard: Standard, first: int, tries: int,
           stream: Callable[[str], np.random.Generator]) -> Learner:
        """For frames of ``standard`` that are sent at most ``tries`` times. ``first``: the index of
        the rate to begin with, of those of its modulation; Minstrel has all of the standard's."""
        self.check(standard.rates[-1].mcs is not None)
        if self.all_streams:
            return MINSTRELS[self.model](standard, tries, stream("minstrel_ht"))
        return self.fallback(standard.alike(first), first)

    def fallback(self, rates: Sequence[int], first: int) -> Arf:
        """``rates`` [k] are indices of the standard's, the slowest first; ``first`` is the one to
        begin with."""
        arf = ArfOfNs3 if self.model == "arf_ns3" else Arf
        return arf(self.constants, rates, first)


class Pair:
    """The state of one sender for one receiver. ``step``: the index of the present rate among those
    allowed, the slowest first."""

    def __init__(self, step: int) -> None:
        self.step = step
        self.acknowledged = self.failed = self.attempts = 0
        self.probing = False


class Arf:
    """Automatic rate fallback (Kamerman and Monteban 1997), for each pair of hosts by itself."""

    def __init__(self, constants: ArfConstants, rates: Sequence[int], first: int) -> None:
        self._constants, self._rates, self.first = constants, rates, first
        self._pairs: dict[tuple[int, int], Pair] = {}

    def sent(self, sender: int, receiver: int, packets: int, acknowledged: int, now_ns: int
             ) -> Choice:
        """``Learner.sent``."""
        del now_ns
        enough = acknowledged and 2 * acknowledged >= packets
        return Choice((self.acknowledged if enough else self.failed)(sender, receiver))

    def acknowledged(self, sender: int, receiver: int) -> int:
        """An attempt was acknowledged; returns the rate of the next one."""
        pair = self._pair(sender, receiver)
        pair.attempts += 1
        pair.acknowledged += 1
        pair.failed, pair.probing = 0, False
        if pair.step < len(self._rates) - 1 and self._rises(pair):
            self._change(pair, 1)
            pair.probing = True
        return self._rates[pair.step]

    def failed(self, sender: int, receiver: int) -> int:
        """An attempt was not acknowledged; returns the rate of the next one."""
        pair = self._pair(sender, receiver)
        pair.attempts += 1
        pair.failed += 1
        pair.acknowledged = 0
        if pair.probing or pair.failed >= self._constants.down_after:
            self._change(pair, -1)
        return self._rates[pair.step]

    def _rises(self, pair: Pair) -> bool:
        """Whether it is time to try the next faster rate, after an acknowledgement."""
        return (pair.acknowledged >= self._constants.up_after
                or pair.attempts >= self._constants.timer)

    def _pair(self, sender: int, receiver: int) -> Pair:
        pair = self._pairs.get((sender, receiver))
        if pair is None:
            pair = self._pairs[sender, receiver] = Pair(self._rates.index(self.first))
        return pair

    @staticmethod
    def _change(pair: Pair, by: int) -> None:
        """Go to a neighbouring rate, if there is one; counting begins anew."""
        pair.step = max(pair.step + by, 0)
        pair.acknowledged = pair.failed = pair.attempts = 0
        pair.probing = False


class ArfOfNs3(Arf):
    """ARF as ns-3's ``ArfWifiManager`` counts, where the paper leaves it open. A failed probe
    lowers the rate; further failures do not until something gets through. A timer that ends with a
    failed attempt has no effect, and each failure but the first in a row starts it anew."""

    def _rises(self, pair: Pair) -> bool:
        return (pair.acknowledged == self._constants.up_after
                or pair.attempts == self._constants.timer)

    def failed(self, sender: int, receiver: int) -> int:
        pair, down_after = self._pair(sender, receiver), self._constants.down_after
        pair.attempts += 1
        pair.failed += 1
        pair.acknowledged = 0
        if pair.probing and pair.failed == 1 or not (pair.probing or pair.failed % down_after):
            pair.step = max(pair.step - 1, 0)
        if pair.probing or pair.failed >= down_after:
            pair.attempts = 0
        return self._rates[pair.step]

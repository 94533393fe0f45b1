"""Automatic rate fallback: a faster rate after acknowledgements in a row, a slower after failures.

Kamerman and Monteban 1997, "WaveLAN-II: a high-performance wireless LAN for the unlicensed band"
(ARF); Lacage, Manshaei and Turletti 2004, "IEEE 802.11 rate adaptation: a practical approach"
(AARF).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from netmodels.radio.learner import Choice


class FallbackRules(NamedTuple):
    """After how many acknowledgements in a row the next faster rate is tried, after how many
    failures in a row the next slower one, and after how many attempts the next faster one in any
    case. A probe that fails multiplies the first up to ``most_up_after``, and the last, by
    ``factor``: 1 with ARF, 2 with AARF."""

    up_after: int
    down_after: int
    timer: int
    factor: int
    most_up_after: int


class Pair:
    """The state of one sender for one receiver. ``step``: the index of the present rate among those
    allowed, the slowest first; ``up_after`` and ``timer`` as they are now."""

    def __init__(self, step: int, rules: FallbackRules) -> None:
        self.step = step
        self.up_after, self.timer = rules.up_after, rules.timer
        self.acknowledged = self.failed = self.attempts = 0
        self.probing = False


class Arf:
    """Automatic rate fallback for each pair of hosts by itself. ``rates`` [k] are indices of the
    standard's, the slowest first; ``first`` is the one to begin with."""

    def __init__(self, rules: FallbackRules, rates: Sequence[int], first: int) -> None:
        self._rules, self._rates, self.first = rules, rates, first
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
        if pair.probing or pair.failed >= self._rules.down_after:
            self._wait(pair)
            self._change(pair, -1)
        return self._rates[pair.step]

    def _rises(self, pair: Pair) -> bool:
        """Whether it is time to try the next faster rate, after an acknowledgement."""
        return pair.acknowledged >= pair.up_after or pair.attempts >= pair.timer

    def _pair(self, sender: int, receiver: int) -> Pair:
        pair = self._pairs.get((sender, receiver))
        if pair is None:
            pair = self._pairs[sender, receiver] = Pair(self._rates.index(self.first), self._rules)
        return pair

    def _wait(self, pair: Pair) -> None:
        """The rate falls: after a probe the next one comes later, else as soon as at first (Lacage
        et al., 3.2; of the timer ns-3's ``AarfWifiManager``)."""
        rules = self._rules
        if pair.probing:
            pair.up_after = min(rules.factor * pair.up_after, rules.most_up_after)
            pair.timer *= rules.factor
        else:
            pair.up_after, pair.timer = rules.up_after, rules.timer

    @staticmethod
    def _change(pair: Pair, by: int) -> None:
        """Go to a neighbouring rate, if there is one; counting begins anew."""
        pair.step = max(pair.step + by, 0)
        pair.acknowledged = pair.failed = pair.attempts = 0
        pair.probing = False


class ArfOfNs3(Arf):
    """The same as ns-3's ``ArfWifiManager`` and ``AarfWifiManager`` count, where the papers leave
    it open. A failed probe lowers the rate; further failures do not until something gets through. A
    timer that ends with a failed attempt has no effect, and each failure but the first in a row
    starts it anew."""

    def _rises(self, pair: Pair) -> bool:
        return pair.acknowledged == pair.up_after or pair.attempts == pair.timer

    def failed(self, sender: int, receiver: int) -> int:
        pair, down_after = self._pair(sender, receiver), self._rules.down_after
        pair.attempts += 1
        pair.failed += 1
        pair.acknowledged = 0
        if pair.probing and pair.failed == 1 or not (pair.probing or pair.failed % down_after):
            self._wait(pair)
            pair.step = max(pair.step - 1, 0)
        if pair.probing or pair.failed >= down_after:
            pair.attempts = 0
        return self._rates[pair.step]

"""The rate that is best for the signal that the receiver had."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from netmodels.radio.errors import bit_error
from netmodels.radio.learner import Choice
from netmodels.radio.standards import Standard

_WEAKEST_DB, _STRONGEST_DB = -20.0, 60.0

# The ratio of signal to noise of a sender at a receiver, now; 0 where nothing is heard.
RatioOf = Callable[[int, int], float]


class BestRate:
    """The fastest of ``rates``, indices of the standard's, at which fewer than ``bit_errors`` bits
    are wrong, by the ratio of signal to noise that the receiver had when it acknowledged last
    (ns-3's ``IdealWifiManager``). It tells the sender for nothing and without delay. Interference
    does not count. A pair begins with the slowest rate, and again after ``tries`` attempts in a row
    without an acknowledgement."""

    def __init__(self, standard: Standard, rates: Sequence[int], tries: int, bit_errors: float,
                 ratio: RatioOf) -> None:
        how = [standard.rates[rate] for rate in rates]
        fastest = sorted(range(len(rates)), key=lambda k: -how[k].mbps)
        least = {scheme: least_ratio(scheme, bit_errors)
                 for scheme in dict.fromkeys(one.scheme for one in how)}
        self._rates = [(rates[k], least[how[k].scheme]) for k in fastest]
        self.first = rates[fastest[-1]]
        self._tries, self._ratio = tries, ratio
        self._failed: dict[tuple[int, int], int] = {}
        self._chosen: dict[tuple[int, int], int] = {}

    def sent(self, sender: int, receiver: int, packets: int, acknowledged: int, now_ns: int
             ) -> Choice:
        """``Learner.sent``."""
        del packets, now_ns
        pair = sender, receiver
        if acknowledged:
            self._failed[pair] = 0
            self._chosen[pair] = self.best(self._ratio(sender, receiver))
        else:
            self._failed[pair] = self._failed.get(pair, 0) + 1
            if self._failed[pair] % self._tries == 0:
                self._chosen[pair] = self.first
        return Choice(self._chosen.get(pair, self.first))

    def best(self, ratio: float) -> int:
        """The index of the fastest rate at this ratio (not in dB), of the slowest if it is less
        than any needs."""
        return next((rate for rate, least in self._rates if least < ratio), self.first)


def least_ratio(scheme: float, bit_errors: float) -> float:
    """The ratio of signal to noise (not in dB) at which so large a share of the bits of a
    ``Rate.scheme`` is wrong (ns-3's ``ErrorRateModel::CalculateSnr``)."""
    weak_db, strong_db = _WEAKEST_DB, _STRONGEST_DB
    while strong_db - weak_db > 1e-7:
        middle_db = (weak_db + strong_db) / 2
        if bit_error(scheme, 10 ** (middle_db / 10)) > bit_errors:
            weak_db = middle_db
        else:
            strong_db = middle_db
    return float(10 ** (strong_db / 10))

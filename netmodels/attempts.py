"""Packets that are repeated over a link of known signal, at rates that their sender learns."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from desim.units import airtime_ns
from netmodels.radio.best_rate import RatioOf
from netmodels.radio.rate_control import RateControl
from netmodels.radio.standards import Standard

TRIES = 7  # 802.11-2016: dot11ShortRetryLimit


class Attempts:
    """The attempts of senders who have the air to themselves and whose acknowledgements arrive. A
    rate belongs to a sender and a receiver, as in the radio (``RateControl``), and begins with the
    standard's ``first``."""

    def __init__(self, control: RateControl, standard: Standard, first: int,
                 stream: Callable[[str], np.random.Generator], ratio: RatioOf) -> None:
        self._standard = standard
        self._rates: dict[tuple[int, int], int] = {}
        self._control = control.of(standard, first, TRIES, stream, ratio)
        self._first = self._control.first

    def packet(self, sender: int, receiver: int, size_bytes: int, now_ns: int,
               chance: Callable[[int], float], draws: Sequence[float]) -> tuple[bool, int, int]:
        """Whether a packet arrives within as many attempts as there are numbers from 0 to 1 in
        ``draws``, one of each being below the ``chance`` of its rate; the time of the last attempt,
        and of those before."""
        pair = sender, receiver
        last_ns = before_ns = 0
        for number in draws:
            rate = self._rates.get(pair, self._first)
            before_ns += last_ns
            last_ns = airtime_ns(size_bytes, round(1e6 * self._standard.rates[rate].mbps))
            arrives = number < chance(rate)
            self._rates[pair] = self._control.sent(sender, receiver, 1, arrives, now_ns).rate
            if arrives:
                return True, last_ns, before_ns
        return False, last_ns, before_ns

"""The rates that a radio sends at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from desim.errors import InputError
from netmodels.radio.standards import STANDARDS, Standard


def chosen_rates(standard: str, rate_bps: int, broadcast_rate_bps: int | None) -> tuple[int, int]:
    """The rates of unicast and of broadcast frames, as indices of ``STANDARDS[standard].rates``;
    the latter by default the lowest of the same modulation. Raises ``InputError`` for rates that
    the standard does not have."""
    unicast = _index(standard, "rate", rate_bps)
    if broadcast_rate_bps is not None:
        return unicast, _index(standard, "broadcast_rate", broadcast_rate_bps)
    return unicast, STANDARDS[standard].lowest(unicast)


def chosen_standard(standard: str, basic_rates_bps: Sequence[int] | None) -> Standard:
    """With these basic rates instead of its own. Raises ``InputError`` for rates that it does not
    have."""
    chosen = STANDARDS[standard]
    if basic_rates_bps is None:
        return chosen
    return replace(chosen, basic_mbps=tuple(
        chosen.rates[_index(standard, f"basic_rates.{k}", bps)].mbps
        for k, bps in enumerate(basic_rates_bps)))


def _index(standard: str, key: str, bps: int) -> int:
    rates = STANDARDS[standard].rates
    for k, rate in enumerate(rates):
        if round(rate.mbps * 1e6) == bps:
            return k
    raise InputError(f".{key}: {bps / 1e6:g} Mb/s is no rate of {standard}; allowed: "
                     f"{', '.join(f'{rate.mbps:g} Mb/s' for rate in rates)}")

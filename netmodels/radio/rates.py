"""Which rates a radio sends at."""

from __future__ import annotations

from desim.errors import InputError
from netmodels.radio.standards import STANDARDS


def chosen_rates(standard: str, rate_bps: int, broadcast_rate_bps: int | None) -> tuple[int, int]:
    """Of unicast and of broadcast frames, as indices of ``STANDARDS[standard].rates``; the latter
    by default the lowest of the same modulation. Raises ``InputError`` for rates that the standard
    does not have."""
    rates = STANDARDS[standard].rates

    def index(key: str, bps: int) -> int:
        for k, rate in enumerate(rates):
            if round(rate.mbps * 1e6) == bps:
                return k
        raise InputError(f".{key}: {bps / 1e6:g} Mb/s is no rate of {standard}; allowed: "
                         f"{', '.join(f'{rate.mbps:g} Mb/s' for rate in rates)}")

    unicast = index("rate", rate_bps)
    if broadcast_rate_bps is not None:
        return unicast, index("broadcast_rate", broadcast_rate_bps)
    return unicast, STANDARDS[standard].lowest(unicast)

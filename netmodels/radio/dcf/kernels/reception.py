"""The reception of signals at a station: noise, interference, errors."""

from __future__ import annotations

import numpy as np
from numba import boolean, float64, from_dtype, int64, void

from desim.ports.kernels import exp, lean, log, uniform_half_open
from netmodels.radio.dcf.kernels.records import LINK, a_dcf, a_setup, a_station, a_table, all_rates

_i8, _f8, _b1, _a_link = int64, float64, boolean, from_dtype(LINK)


@lean(_f8(a_setup, a_table, _i8, _f8))
def log_success(setup, table, rate, ratio):
    """Log of the chance that a bit at ``rate`` has no error, at this signal to noise ratio."""
    at = (10.0 / 2.302585092994046 * log(ratio) - setup.table_db) / setup.step_db
    if at >= table.shape[1] - 1:
        return 0.0
    j = np.int64(max(at, 0.0))
    part = max(at, 0.0) - j
    return -exp(table[rate, j] + part * (table[rate, j + 1] - table[rate, j]))


@lean(void(a_setup, all_rates, a_table, a_station, a_station, _i8))
def account(setup, rates, table, r, source, now):
    """Add the chance of errors in the frame that station r receives, for the time since its
    interference changed last."""
    begin, r.until = r.until, now
    noise = setup.noise_mw + max(r.heard - r.power - r.unaware, 0.0)
    r.unaware = 0.0
    if r.power >= setup.clear * noise:
        return
    ratio = r.power / noise
    rate = rates[source.rate]
    payload = source.begun + rate.payload_ns
    header = source.begun + rate.header_ns
    if begin < payload and now > header:
        bits = (min(now, payload) - max(begin, header)) * 1e-9 * rates[rate.header_rate].bps
        r.chance += bits * log_success(setup, table, rate.header_rate, ratio)
    if now > payload:
        bits = (now - max(begin, payload)) * 1e-9 * rate.bps
        r.chance += bits * log_success(setup, table, source.rate, ratio)


@lean(void(a_dcf, a_station, a_station, _i8, _a_link))
def arrive(d, r, s, now, link):
    """Station s's signal comes to station r, which receives nothing yet; what ns-3 makes of it.

    ns-3 takes for the interference at a frame's beginning what was heard when the search for
    preambles began, and is right again from the next change on. Hence r is not aware of what came
    during the search before its frame: of two frames sent in the same slot one may be read in spite
    of the other, if the other comes first. Who comes first is decided by the ways: a sender's slots
    began when the end of the last frame had come to it.
    """
    if now >= r.search:
        r.search, r.strongest, r.power = now + d.setup[0].detection_ns, -1, 0.0
        r.before = r.heard
    came, first = s.lag + link.delay, False
    if r.strongest >= 0 and d.stations[r.strongest].begun == now:
        first = came < r.came or (came == r.came and s.lag < d.stations[r.strongest].lag)
    if link.mw > r.power:
        r.unaware = 0.0 if first else r.heard - r.before
        r.strongest, r.power, r.came = s.index, link.mw, came
    else:
        r.unaware = r.unaware + link.mw if first else 0.0


@lean(_b1(a_station, a_station))
def survives(r, source):
    """Whether the part that station r has received so far has no error; true of the whole frame
    only if it was true of each earlier part."""
    if r.chance == 0.0:
        return True
    key = r.key ^ (source.key << np.uint64(1))
    return uniform_half_open(key, np.uint64(source.number)) < exp(r.chance)

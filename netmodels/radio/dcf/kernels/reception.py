"""The reception of signals at a station: noise, interference, errors."""

from __future__ import annotations

import numpy as np

from desim.ports.kernels import exp, from_dtype, inner, log, types, uniform_half_open
from netmodels.radio.dcf.kernels.records import (
    DATA,
    LINK,
    WORDS,
    a_dcf,
    a_setup,
    a_station,
    a_table,
    all_rates,
)

boolean, float64, int64, void = types.boolean, types.float64, types.int64, types.void

_i8, _f8, _b1, _a_link = int64, float64, boolean, from_dtype(LINK)


@inner(_f8(a_setup, a_table, _i8, _f8))
def log_success(setup, table, rate, ratio):
    """The log of the chance that a bit at ``rate`` has no error at this signal to noise ratio."""
    at = (10.0 / 2.302585092994046 * log(ratio) - setup.table_first_db) / setup.table_step_db
    if at >= table.shape[1] - 1:
        return 0.0
    j = np.int64(max(at, 0.0))
    part = max(at, 0.0) - j
    return -exp(table[rate, j] + part * (table[rate, j + 1] - table[rate, j]))


@inner(_f8(a_station))
def forget_losses(r):
    """Nothing is lost of the frame that station r receives. Returns the log chance of that."""
    for k in range(WORDS):
        r.lost[k] = 0
    return 0.0


@inner(_b1(a_station, _i8))
def is_lost(r, number):
    """Whether this packet of the aggregate that station r receives has an error."""
    return (r.lost[number >> 6] >> np.uint64(number & 63)) & np.uint64(1) == 1


@inner(_b1(a_station, _i8))
def all_lost(r, count):
    """Whether the first ``count`` packets of the aggregate that station r receives have errors."""
    for k in range((count + 63) >> 6):
        if ~r.lost[k] << np.uint64(max(64 * (k + 1) - count, 0)) != 0:
            return False
    return True


@inner(void(a_station, a_station, _f8, _i8, _i8, _i8))
def lose_packets(r, source, chance, begin_ns, end_ns, first_ns):
    """Lose packets of station source's aggregate, which begins at ``first_ns``, in a part of it
    that is right with the log chance ``chance``. They count as equally long. Who only overhears it
    needs one of them, and has the chance of that."""
    if source.dest != r.index:
        r.log_chance += chance / source.carried
        return
    if chance > -1e-12:
        return
    each_ns = (source.ends_ns - first_ns) / source.carried
    key = r.key ^ (source.key << np.uint64(1)) ^ (
        np.uint64(begin_ns) * np.uint64(0x9E3779B97F4A7C15))
    for j in range(np.int64((begin_ns - first_ns) / each_ns), source.carried):
        from_ns = max(first_ns + j * each_ns, np.float64(begin_ns))
        time_ns = min(first_ns + (j + 1) * each_ns, np.float64(end_ns)) - from_ns
        if time_ns <= 0.0:
            break
        draw = uniform_half_open(key, np.uint64(source.transmission * 64 + j))
        if draw >= exp(chance * time_ns / (end_ns - begin_ns)):
            r.lost[j >> 6] |= np.uint64(1) << np.uint64(j & 63)


@inner(void(a_setup, all_rates, a_table, a_station, a_station, _i8))
def add_errors(setup, rates, table, r, source, now_ns):
    """Account for errors in the frame that station r receives since its interference changed last.
    """
    begin_ns, r.accounted_ns = r.accounted_ns, now_ns
    noise_mw = setup.noise_mw + max(r.heard_mw - r.power_mw - r.unaware_mw, 0.0)
    r.unaware_mw = 0.0
    if r.power_mw >= setup.clear_ratio * noise_mw:
        return
    ratio = r.power_mw / noise_mw
    rate = rates[source.rate]
    payload_begins_ns = source.begun_ns + rate.payload_ns
    header_begins_ns = source.begun_ns + rate.header_ns
    if begin_ns < payload_begins_ns and now_ns > header_begins_ns:
        time_ns = min(now_ns, payload_begins_ns) - max(begin_ns, header_begins_ns)
        bits = time_ns * 1e-9 * rates[rate.header_rate].bps
        r.log_chance += bits * log_success(setup, table, rate.header_rate, ratio)
    if now_ns > payload_begins_ns:
        begin_ns = max(begin_ns, payload_begins_ns)
        bits = (now_ns - begin_ns) * 1e-9 * rate.bps
        chance = bits * log_success(setup, table, source.rate, ratio)
        if source.carried > 0 and source.kind == DATA:
            lose_packets(r, source, chance, begin_ns, now_ns, payload_begins_ns)
        else:
            r.log_chance += chance


@inner(void(a_dcf, a_station, a_station, _i8, _a_link))
def arrive(d, r, s, now_ns, link):
    """Station s's signal comes to station r, which receives nothing yet, as ns-3 counts it.

    For ns-3 the interference at a frame's beginning is what was heard when the search for preambles
    began; from the next change on it is right again. Hence r is not aware of what came during the
    search before its frame: of two frames in the same slot one may be decoded in spite of the
    other, if the other comes first. The distances decide which comes first: a sender's slots begin
    when the end of the last frame has come to it.
    """
    if now_ns >= r.search_ends_ns:
        r.search_ends_ns, r.strongest, r.power_mw = now_ns + d.setup[0].detection_ns, -1, 0.0
        r.heard_before_mw = r.heard_mw
    came_ns, first = s.lag_ns + link.delay_ns, False
    if r.strongest >= 0 and d.stations[r.strongest].begun_ns == now_ns:
        first = came_ns < r.came_ns or (
            came_ns == r.came_ns and s.lag_ns < d.stations[r.strongest].lag_ns)
    if link.power_mw > r.power_mw:
        r.unaware_mw = 0.0 if first else r.heard_mw - r.heard_before_mw
        r.strongest, r.power_mw, r.came_ns = s.index, link.power_mw, came_ns
    else:
        r.unaware_mw = r.unaware_mw + link.power_mw if first else 0.0


@inner(_b1(a_station, a_station))
def is_intact(r, source):
    """Whether the part of the frame that station r has received so far has no error. The whole
    frame is intact only if each earlier part was; of an aggregate one packet is enough."""
    if source.carried > 0 and all_lost(r, source.carried):
        return False
    if r.log_chance == 0.0:
        return True
    key = r.key ^ (source.key << np.uint64(1))
    return uniform_half_open(key, np.uint64(source.transmission)) < exp(r.log_chance)

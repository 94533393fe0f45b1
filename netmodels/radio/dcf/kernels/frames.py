"""Airtimes of a frame and its acknowledgement at a rate."""

from __future__ import annotations

import numpy as np
from numba import from_dtype, int64, void

from desim.ports.kernels import lean
from netmodels.radio.dcf.kernels.records import FRAME, RATE, all_rates

_i8 = int64
_frame = from_dtype(FRAME)


@lean(_i8(from_dtype(RATE), _i8))
def airtime_ns(how, size_bytes):
    """The same as ``Standard.airtime_ns``. OFDM: whole symbols; DSSS: whole us."""
    if how.symbol_ns > 0:
        symbols = -(-(16 + 8 * size_bytes + 6) // how.bits_per_symbol)
        return how.payload_ns + symbols * how.symbol_ns + how.extension_ns
    return how.payload_ns - 1000 * (-8 * size_bytes * 1_000_000 // np.int64(how.bps))


@lean(void(all_rates, _frame, _i8, _i8))
def set_rate(rates, frame, rate, rts):
    """Set a frame's rate and airtimes; with ``rts`` 1 an RTS goes first. Control frames that begin
    an exchange go at the lowest rate of the modulation."""
    how = rates[rate]
    frame.rate, frame.rts_rate = rate, how.header_rate
    frame.air_ns = airtime_ns(how, frame.size_bytes)
    frame.last_ns = airtime_ns(how, frame.last_bytes)
    frame.ack_ns, frame.ack_rate = (how.ack_ns, how.reply_rate) if frame.dest >= 0 else (0, 0)
    frame.rts_ns, frame.cts_ns = (how.rts_ns, how.cts_ns) if rts == 1 else (0, 0)

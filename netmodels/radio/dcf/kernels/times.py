"""The parts of a frame's time at the head of a station's queue, where there is a ledger.

``times`` has two blocks of ``KEPT`` columns for each station. The first is of the frame at the head
of its queue: since when it is there, its last stamp, and ns in contention, on the air, and in
transmissions that it had to repeat. The second keeps the same of the frame before: the last that
has arrived or was given up.
"""

from __future__ import annotations

from desim.ports.kernels import inner
from netmodels.radio.dcf.kernels.records import a_dcf, a_station, int64, void

FIRST, STAMPED, CONTENDED, SENT, REPEATED, KEPT = range(6)
COLUMNS = 2 * KEPT


@inner(void(a_dcf, a_station, int64))
def begin_frame(d, s, now_ns):
    """Start afresh for the frame that is now at the head of station s's queue, if there is one."""
    if d.times.shape[0] > 0 and s.queue_length > 0:
        d.times[s.index, FIRST] = d.times[s.index, STAMPED] = now_ns
        for column in range(CONTENDED, KEPT):
            d.times[s.index, column] = 0


@inner(void(a_dcf, a_station, int64, int64))
def stamp(d, s, now_ns, column):
    """Add the time since the last stamp of station s's frame to the part in ``column``."""
    if d.times.shape[0] > 0:
        d.times[s.index, column] += now_ns - d.times[s.index, STAMPED]
        d.times[s.index, STAMPED] = now_ns


@inner(void(a_dcf, a_station))
def keep_times(d, s):
    """Keep the times of station s's frame: it has arrived, or was given up."""
    if d.times.shape[0] > 0:
        for column in range(KEPT):
            d.times[s.index, KEPT + column] = d.times[s.index, column]


@inner(void(a_dcf, a_dcf, int64))
def copy_times(d, future, i):
    """Copy both blocks of station i."""
    if d.times.shape[0] > 0:
        for column in range(COLUMNS):
            future.times[i, column] = d.times[i, column]

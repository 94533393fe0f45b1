"""The parts of the time of frames in stations' queues, where there is a ledger.

Of a station that is [10]: of the first frame of its queue, since when it is the first, its last
stamp, and its sums; and the same of the frame that has arrived or was given up last.
"""

from __future__ import annotations

from desim.ports.kernels import inner
from netmodels.radio.dcf.kernels.records import a_dcf, a_station, int64, void

FIRST, STAMPED, CONTENDED, SENT, REPEATED, KEPT = range(6)
COLUMNS = 2 * KEPT


@inner(void(a_dcf, a_station, int64))
def begin_frame(d, s, now_ns):
    """A frame, if there is one, has become the first of station s's queue."""
    if d.times.shape[0] > 0 and s.queue_length > 0:
        d.times[s.index, FIRST] = d.times[s.index, STAMPED] = now_ns
        for column in range(CONTENDED, KEPT):
            d.times[s.index, column] = 0


@inner(void(a_dcf, a_station, int64, int64))
def stamp(d, s, now_ns, column):
    """The first frame of station s's queue has been in this part since its last stamp."""
    if d.times.shape[0] > 0:
        d.times[s.index, column] += now_ns - d.times[s.index, STAMPED]
        d.times[s.index, STAMPED] = now_ns


@inner(void(a_dcf, a_station))
def keep_times(d, s):
    """The first frame of station s's queue has arrived, or was given up."""
    if d.times.shape[0] > 0:
        for column in range(KEPT):
            d.times[s.index, KEPT + column] = d.times[s.index, column]


@inner(void(a_dcf, a_dcf, int64))
def copy_times(d, future, i):
    """Copy what is kept of station i."""
    if d.times.shape[0] > 0:
        for column in range(COLUMNS):
            future.times[i, column] = d.times[i, column]

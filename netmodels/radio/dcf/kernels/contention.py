"""How a station waits for the medium: backoff and carrier sense."""

from __future__ import annotations

import numpy as np
from numba import int64, void

from desim.ports.kernels import lean, uniform_half_open
from netmodels.radio.dcf.kernels.records import (
    IDLE,
    KINDS,
    NEVER,
    START,
    a_setup,
    a_station,
    all_due,
    schedule,
)

_i8 = int64


@lean(void(a_station))
def draw(s):
    """A new backoff, uniform in 0..window."""
    s.direct = 0
    s.count = np.int64(uniform_half_open(s.key, np.uint64(s.draws)) * (s.window + 1))
    s.draws += 1


@lean(void(a_setup, all_due, a_station))
def plan(setup, due, s):
    """When station s will transmit if the medium stays idle."""
    if s.role != IDLE:
        return
    at = NEVER
    if s.length > 0 and s.busy == 0:
        at = max(s.since + s.count * setup.slot_ns, s.ready) * KINDS + START
    if at != s.contention:
        s.contention = at
        schedule(due, s)


@lean(void(a_setup, a_station, _i8))
def rest(setup, s, now):
    """The medium is idle: when slots begin to count. DIFS after the reservation, or EIFS after what
    could not be made out, without regard to the reservation (802.11-2016, 10.3.2.3.7; in ns-3 EIFS
    has begun with the end of that frame, whether or not the medium was idle then)."""
    if s.eifs == NEVER:
        s.eifs = now + setup.eifs_ns
    s.since = max(max(now, s.nav) + setup.difs_ns, s.eifs)


@lean(void(a_setup, all_due, a_station, _i8))
def sense(setup, due, s, now):
    """Station s looks at the medium. If it has become busy, the counter stops; only whole idle
    slots count, and a station that was to begin at this very instant has not noticed. Who was to
    begin without a backoff needs one now (802.11-2016, 10.3.4.2)."""
    busy = s.on == 1 or s.lock >= 0 or (s.heard >= setup.energy_mw and s.deaf == 0)
    if busy and s.busy == 0:
        s.busy = 1
        s.occupied -= now
        if s.contention % KINDS == START and s.contention // KINDS == now and s.role == IDLE:
            return
        if s.direct == 1:
            draw(s)
        elif now > s.since:
            s.count = max(s.count - (now - s.since) // setup.slot_ns, 0)
        plan(setup, due, s)
    elif s.busy == 1 and not busy:
        s.busy = 0
        s.occupied += now
        rest(setup, s, now)
        plan(setup, due, s)

"""Backoff and carrier sense of a station that waits for the medium."""

from __future__ import annotations

import numpy as np

from desim.ports.kernels import inner, types, uniform_half_open
from netmodels.radio.dcf.kernels.records import (
    AWAITING,
    IDLE,
    KINDS,
    NEVER,
    OTHER,
    START,
    a_setup,
    a_station,
    aifs_ns,
    all_due,
    all_stations,
    all_touched,
    mark_changed,
    schedule,
)

int64, void = types.int64, types.void

_i8 = int64


@inner(void(a_station))
def draw_backoff(s):
    """Draw a new backoff, uniform in 0..window slots."""
    s.no_backoff = 0
    s.slots_left = np.int64(uniform_half_open(s.key, np.uint64(s.draws)) * (s.window + 1))
    s.draws += 1


@inner(void(a_setup, all_due, a_station))
def plan_start(setup, due, s):
    """Plan the start of station s's transmission if the medium stays idle."""
    if s.role != IDLE:
        return
    at = NEVER
    if s.queue_length > 0 and s.busy == 0:
        at = max(s.slots_from_ns + s.slots_left * setup.slot_ns, s.ready_ns) * KINDS + START
    if at != s.contention_due:
        s.contention_due = at
        schedule(due, s)


@inner(void(a_setup, all_stations, a_station, a_station, _i8))
def start_slots(setup, stations, radio, s, now_ns):
    """Set when slots begin to count for contender s of a ``radio`` on the idle medium: DIFS after
    the reservation, or EIFS after a frame with errors, without regard to the reservation
    (802.11-2016, 10.3.2.3.7; in ns-3 EIFS begins with the end of that frame, whether or not the
    medium is idle then). While one contender awaits a reply, those of other categories wait until
    it has none."""
    if radio.eifs_ends_ns == NEVER:
        radio.eifs_ends_ns = now_ns + setup.eifs_ns
    from_ns = max(max(now_ns, radio.nav_ns), radio.eifs_ends_ns)
    if radio.holder != s.index:
        holder = stations[radio.holder]
        if holder.role == AWAITING:
            from_ns = max(from_ns, holder.contention_due // KINDS)
    s.slots_from_ns = from_ns + aifs_ns(setup, s)


@inner(void(a_setup, all_due, all_stations, all_touched, a_station, _i8))
def restart(setup, due, stations, touched, radio, now_ns):
    """All contenders of a ``radio`` count slots on the medium, which is idle now."""
    start_slots(setup, stations, radio, radio, now_ns)
    plan_start(setup, due, radio)
    k = radio.next
    while k >= 0:
        s = stations[k]
        mark_changed(touched, s)
        s.busy, s.nav_ns = 0, radio.nav_ns
        start_slots(setup, stations, radio, s, now_ns)
        plan_start(setup, due, s)
        k = s.next


@inner(void(a_setup, all_due, a_station, _i8, _i8))
def stop_slots(setup, due, s, now_ns, inside):
    """The medium has become busy for contender s: the backoff stops. Only whole idle slots count,
    by EDCA also the one that has begun (802.11-2016, 10.22.2.4: the counter goes down at the
    beginning of each), and a station that begins at this very instant does not notice. A station
    that was to begin without a backoff needs one now (10.3.4.2). ``inside`` 1: another contender
    with its radio begins, which it knows at once."""
    s.busy = 1
    due_ns, kind = s.contention_due // KINDS, s.contention_due % KINDS
    if kind == START and due_ns == now_ns and s.role == IDLE:
        return
    if s.no_backoff == 1:
        draw_backoff(s)
    elif now_ns + inside > s.slots_from_ns:
        slots = (now_ns - s.slots_from_ns) // setup.slot_ns + setup.first_counts
        s.slots_left = max(s.slots_left - slots, 0)
    plan_start(setup, due, s)


@inner(void(a_setup, all_due, all_stations, all_touched, a_station, _i8))
def sense_carrier(setup, due, stations, touched, s, now_ns):
    """Station s senses the medium, for all of its contenders."""
    busy = s.on_air > 0 or s.receives_from >= 0 or (
        s.heard_mw >= setup.energy_mw and s.ignores_energy == 0)
    if busy and s.busy == 0:
        s.occupied_ns -= now_ns
        stop_slots(setup, due, s, now_ns, 1 if s.on_air == OTHER else 0)
        k = s.next
        while k >= 0:
            other = stations[k]
            mark_changed(touched, other)
            stop_slots(setup, due, other, now_ns, 1 if s.on_air > 0 else 0)
            k = other.next
    elif s.busy == 1 and not busy:
        s.busy = 0
        s.occupied_ns += now_ns
        restart(setup, due, stations, touched, s, now_ns)

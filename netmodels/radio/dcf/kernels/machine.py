"""The 802.11 distributed coordination function as a state machine.

The next event of all stations is found among the minima of blocks of them, and an event changes
only the stations that hear it: the work for a frame hardly grows with the stations out of reach.
"""

from __future__ import annotations

from desim.ports.kernels import inner, lean, types
from netmodels.radio.dcf.kernels.aggregates import clear_packets, copy_packets, judge_packet
from netmodels.radio.dcf.kernels.contention import (
    draw_backoff,
    plan_start,
    restart,
    sense_carrier,
)
from netmodels.radio.dcf.kernels.exchange import acknowledge, carry_out
from netmodels.radio.dcf.kernels.reception import add_errors
from netmodels.radio.dcf.kernels.records import (
    ACK,
    AWAITING,
    BLOCK,
    DONE,
    IDLE,
    KINDS,
    MISSED,
    NEVER,
    RECEIVED,
    TIMEOUT,
    VOICE,
    a_dcf,
    a_setup,
    a_station,
    aifs_ns,
    arrays_at,
    first_block,
    mark_changed,
    schedule,
    set_rate,
    station_due,
)
from netmodels.radio.dcf.kernels.times import begin_frame, copy_times
from netmodels.radio.dcf.kernels.turns import answer

boolean, int64, void = types.boolean, types.int64, types.void

_i8 = int64
_rows = int64[:, :, ::1]  # ``Addresses.rows``


@inner(void(a_dcf, a_station, _i8))
def spoil(d, r, now_ns):
    """Lose a frame that station r had decoded."""
    r.eifs_ends_ns = NEVER
    if r.busy == 0:
        restart(d.setup[0], d.due, d.stations, d.touched, r, now_ns)


@inner(void(a_dcf, _i8))
def run(d, until_ns):
    """Carry out all events up to ``until_ns``, or up to the first instant with an outcome."""
    d.setup[0].outcomes = 0
    while True:
        b = first_block(d.due)
        what = d.due[b]
        if what // KINDS > until_ns:
            break
        carry_out(d, d.stations[station_due(d.due, b)], what // KINDS, what % KINDS)
        if d.setup[0].outcomes > 0:
            until_ns = what // KINDS


@lean(void(_rows, _i8, _i8))
def advance(rows, present, until_ns):
    """Carry out all events up to ``until_ns``, or up to the first instant with an outcome."""
    run(arrays_at(rows[present]), until_ns)


@lean(void(_rows, _i8, _i8))
def settle(rows, present, now_ns):
    """Before the links change: carry out all events up to now, and account for all receptions."""
    d = arrays_at(rows[present])
    run(d, now_ns)
    for i in range(d.stations.size):
        r = d.stations[i]
        if r.receives_from >= 0:
            add_errors(d.setup[0], d.rates, d.table, r, d.stations[r.receives_from], now_ns)


@lean(void(_rows, _i8, _i8))
def relink(rows, present, now_ns):
    """The links have changed: sum up anew what each station hears of those on the air. A station
    that no longer hears the frame that it was receiving has lost it."""
    d = arrays_at(rows[present])
    stations = d.stations
    for i in range(stations.size):
        mark_changed(d.touched, stations[i])
        stations[i].heard_mw, stations[i].signals, stations[i].power_mw = 0.0, 0, 0.0
        stations[i].unaware_mw = 0.0
    for i in range(stations.size):
        if stations[i].on_air == 1:
            for k in range(stations[i].first_link, stations[i].last_link):
                r = stations[d.links[k].station]
                r.heard_mw += d.links[k].power_mw
                r.signals += 1
                if r.receives_from == i:
                    r.power_mw = d.links[k].power_mw
    for i in range(stations.size):
        r = stations[i]
        if r.radio != i:
            continue
        if r.receives_from >= 0 and r.power_mw == 0.0:
            r.receives_from, r.eifs_ends_ns = -1, NEVER
            s = stations[r.holder]
            if s.role == AWAITING and s.contention_due == NEVER:
                s.contention_due = now_ns * KINDS + TIMEOUT
                schedule(d.due, s)
        sense_carrier(d.setup[0], d.due, stations, d.touched, r, now_ns)


@lean(_i8(_rows, _i8))
def foresee(rows, present):
    """Run the future up to the first outcome, as if nothing more were sent. Returns its time,
    ``NEVER`` if there is none."""
    d, future = arrays_at(rows[present]), arrays_at(rows[1 - present])
    touched, blocks = d.touched, d.due.size // (1 + BLOCK)
    for k in range(1, touched[0, 0] + 1):
        i = touched[k, 0]
        if touched[1 + i, 1] == 2 and d.stations[i].queue_length > 0:
            copy_packets(d, future, d.stations[i])
        touched[1 + i, 1] = 0
        future.stations[i] = d.stations[i]
        future.due[blocks + i], future.due[i // BLOCK] = d.due[blocks + i], d.due[i // BLOCK]
        copy_times(d, future, i)
    touched[0, 0] = 0
    run(future, NEVER // KINDS - 1)
    return future.outcomes[0].time_ns if future.setup[0].outcomes > 0 else NEVER


@lean(_i8(_rows, _i8, int64[::1]))
def ended_broadcast(rows, present, ended):
    """The outcomes of this instant in short, if they are those of one broadcast of one packet: its
    station, its position in the queue, how many have received it, these, and those where it had
    errors, both ascending. Returns how many entries of ``ended`` that takes; 0: it is not so."""
    d = arrays_at(rows[present])
    outcomes, received = d.outcomes, 0
    last = d.setup[0].outcomes - 1
    station, position = outcomes[last].station, outcomes[last].position
    if outcomes[last].what != DONE or d.frames[station, position].packets != 1:
        return 0
    for k in range(last):
        what = outcomes[k].what
        if outcomes[k].station != station or (what != RECEIVED and what != MISSED):
            return 0
        if what == RECEIVED:
            ended[3 + received] = outcomes[k].receiver
            received += 1
    at = 3 + received
    for k in range(last):
        if outcomes[k].what == MISSED:
            ended[at] = outcomes[k].receiver
            at += 1
    ended[0], ended[1], ended[2] = station, position, received
    return at


@inner(_i8(a_dcf, a_station))
def waiting_packets(d, s):
    """The packets of all frames in station s's queue, with those of the first one that are over."""
    limit, packets = d.frames.shape[1], 0
    for k in range(s.queue_length):
        packets += d.frames[s.index, (s.queue_head + k) % limit].packets
    return packets


@inner(_i8(a_setup, a_station, _i8))
def pause_ns(setup, s, now_ns):
    """The time that a packet waits which comes while the medium is idle, as ns-3 counts it: AIFS,
    of data with QoS until the next slot begins."""
    if setup.pauses == 0:
        return 0
    if setup.first_counts == 0 or s.rank > VOICE:
        return aifs_ns(setup, s)
    idle_ns = now_ns - s.slots_from_ns
    return setup.slot_ns - idle_ns % setup.slot_ns if idle_ns > 0 else 0


@lean(types.UniTuple(_i8, 2)(_rows, _i8, _i8, _i8, _i8, _i8, _i8, _i8, _i8, _i8, _i8))
def enqueue(rows, present, now_ns, expires_ns, i, dest, packets, size_bytes, last_bytes, rate, rts):
    """Give station i a frame to send, after all events before now. Returns its position in the
    queue, and the number of its packets for which that has a place (0: it is full)."""
    d = arrays_at(rows[present])
    run(d, now_ns - 1)
    s, limit, setup = d.stations[i], d.frames.shape[1], d.setup[0]
    mark_changed(d.touched, s)
    fit = min(packets, limit + s.packet - waiting_packets(d, s))
    if fit <= 0:
        return 0, 0
    position = (s.queue_head + s.queue_length) % limit
    frame = d.frames[i, position]
    if d.packets.shape[0] > 0:
        frame.slot = clear_packets(d, s, fit)
    frame.expires_ns, frame.dest, frame.packets = expires_ns, dest, fit
    frame.size_bytes, frame.last_bytes = size_bytes, last_bytes if fit == packets else size_bytes
    set_rate(d.rates, frame, rate, rts)
    s.queue_length += 1
    if s.queue_length == 1:
        begin_frame(d, s, now_ns)
    if s.queue_length == 1 and s.role == IDLE:
        s.ready_ns = now_ns
        if (s.busy == 1 or now_ns < s.nav_ns) and s.slots_left == 0:
            draw_backoff(s)
        elif s.busy == 0 and (
                s.slots_left == 0 or now_ns >= s.slots_from_ns + s.slots_left * setup.slot_ns):
            s.ready_ns, s.slots_left = now_ns + pause_ns(setup, s, now_ns), 0
            s.no_backoff = setup.pauses == 0
        plan_start(setup, d.due, s)
    return position, fit


@lean(boolean(_rows, _i8, _i8, _i8, _i8, _i8, _i8))
def judge(rows, present, now_ns, i, position, packet, lost):
    """Say whether a packet that station i has just transmitted is ``lost`` (0, 1) at its receiver,
    which had decoded it. Returns whether it has arrived, alone and for the first time."""
    d = arrays_at(rows[present])
    s = d.stations[i]
    r, first = d.stations[s.dest], s.delivered == 0
    mark_changed(d.touched, s)
    mark_changed(d.touched, r)
    if s.carried > 0:
        judge_packet(d, s, now_ns, position, packet, lost)
        if s.delivered == 0 and s.taken > 0:
            answer(d.setup[0], d.due, r, s, now_ns, ACK)
        elif s.delivered == 0:
            spoil(d, r, now_ns)
        return False
    if lost == 0:
        acknowledge(d, r, s, now_ns)
        return first
    spoil(d, r, now_ns)
    return False


@lean(void(_rows, _i8, _i8, _i8))
def miss(rows, present, now_ns, i):
    """Lose a broadcast that station i has just decoded."""
    d = arrays_at(rows[present])
    mark_changed(d.touched, d.stations[i])
    spoil(d, d.stations[i], now_ns)

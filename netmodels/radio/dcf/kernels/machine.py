"""The 802.11 distributed coordination function as a state machine.

The next event of all stations is found among minima of blocks of them, and what happens changes
nobody but those who hear it: the work for a frame hardly grows with the stations out of reach.
"""

from __future__ import annotations

from numba import boolean, int64, void

from desim.ports.kernels import lean
from netmodels.radio.dcf.kernels.contention import draw, plan, rest, sense
from netmodels.radio.dcf.kernels.exchange import admit, happen
from netmodels.radio.dcf.kernels.frames import tune
from netmodels.radio.dcf.kernels.reception import account
from netmodels.radio.dcf.kernels.records import (
    AWAITING,
    BLOCK,
    IDLE,
    KINDS,
    NEVER,
    TIMEOUT,
    a_dcf,
    a_station,
    pick,
    schedule,
    soonest,
    touch,
    view,
)

_i8 = int64
_places = int64[:, :, ::1]  # of the arrays: ``view`` of the present, ``view`` of the future


@lean(void(a_dcf, a_station, _i8))
def spoil(d, r, now):
    """A frame that station r had decoded is lost after all."""
    r.eifs = NEVER
    if r.busy == 0:
        rest(d.setup[0], r, now)
        plan(d.setup[0], d.due, r)


@lean(void(a_dcf, _i8))
def run(d, until):
    """Let happen what is due up to ``until``, or up to the first instant with an outcome."""
    d.setup[0].outcomes = 0
    while True:
        b = soonest(d.due)
        what = d.due[b]
        if what // KINDS > until:
            break
        happen(d, d.stations[pick(d.due, b)], what // KINDS, what % KINDS)
        if d.setup[0].outcomes > 0:
            until = what // KINDS


@lean(void(_places, _i8, _i8))
def advance(where, present, until):
    """Let happen what is due up to ``until``, or up to the first instant with an outcome."""
    run(view(where[present]), until)


@lean(void(_places, _i8, _i8))
def settle(where, present, now):
    """Before the links change: let happen what is due up to now, and account for all receptions."""
    d = view(where[present])
    run(d, now)
    for i in range(d.stations.size):
        r = d.stations[i]
        if r.lock >= 0:
            account(d.setup[0], d.rates, d.table, r, d.stations[r.lock], now)


@lean(void(_places, _i8, _i8))
def relink(where, present, now):
    """The links have changed: what everybody hears, from who is on the air. Whoever can no longer
    hear what it was receiving has lost it."""
    d = view(where[present])
    stations, setup = d.stations, d.setup[0]
    for i in range(stations.size):
        touch(d, stations[i])
        stations[i].heard, stations[i].signals, stations[i].power = 0.0, 0, 0.0
        stations[i].unaware = 0.0
    for i in range(stations.size):
        if stations[i].on == 1:
            for k in range(stations[i].first, stations[i].last):
                r = stations[d.links[k].station]
                r.heard += d.links[k].mw
                r.signals += 1
                if r.lock == i:
                    r.power = d.links[k].mw
    for i in range(stations.size):
        r = stations[i]
        if r.lock >= 0 and r.power == 0.0:
            r.lock, r.eifs = -1, NEVER
            if r.role == AWAITING and r.contention == NEVER:
                r.contention = now * KINDS + TIMEOUT
                schedule(d.due, r)
        sense(setup, d.due, r, now)


@lean(_i8(_places, _i8))
def foresee(where, present):
    """Try out the future, up to the first outcome if nobody sends anything more. Returns when that
    is, ``NEVER`` if there is none."""
    d, future = view(where[present]), view(where[1 - present])
    touched, blocks = d.touched, d.due.size // (1 + BLOCK)
    for k in range(1, touched[0, 0] + 1):
        i = touched[k, 0]
        touched[1 + i, 1] = 0
        future.stations[i] = d.stations[i]
        future.due[blocks + i], future.due[i // BLOCK] = d.due[blocks + i], d.due[i // BLOCK]
    touched[0, 0] = 0
    run(future, NEVER // KINDS - 1)
    return future.outcomes[0].time_ns if future.setup[0].outcomes > 0 else NEVER


@lean(_i8(_places, _i8, _i8, _i8, _i8, _i8, _i8, _i8, _i8, _i8, _i8))
def enqueue(where, present, now, expires, i, dest, packets, size_bytes, last_bytes, rate, rts):
    """Station i gets a frame to send, after what is due before now. Returns its position in the
    queue, -1 if that is full."""
    d = view(where[present])
    run(d, now - 1)
    s, limit, setup = d.stations[i], d.frames.shape[1], d.setup[0]
    touch(d, s)
    if s.length == limit:
        return -1
    position = (s.head + s.length) % limit
    frame = d.frames[i, position]
    frame.expires, frame.dest, frame.packets = expires, dest, packets
    frame.size_bytes, frame.last_bytes = size_bytes, last_bytes
    tune(d.rates, frame, rate, rts)
    s.length += 1
    if s.length == 1 and s.role == IDLE:
        s.ready = now
        if (s.busy == 1 or now < s.nav) and s.count == 0:
            draw(s)
        elif s.busy == 0 and (s.count == 0 or now >= s.since + s.count * setup.slot_ns):
            s.ready, s.count, s.direct = now + setup.pause_ns, 0, setup.pause_ns == 0
        plan(setup, d.due, s)
    return position


@lean(boolean(_places, _i8, _i8, _i8, _i8))
def judge(where, present, now, i, lost):
    """The packet that station i has just transmitted was ``lost`` at its receiver (0, 1), which
    had made it out. Returns whether it is the first time that it was not."""
    d = view(where[present])
    s = d.stations[i]
    r, first = d.stations[s.to], s.got == 0
    touch(d, s)
    touch(d, r)
    if lost == 0:
        admit(d, r, s, now)
        return first
    spoil(d, r, now)
    return False


@lean(void(_places, _i8, _i8, _i8))
def miss(where, present, now, i):
    """A broadcast that station i has just made out was lost there."""
    d = view(where[present])
    touch(d, d.stations[i])
    spoil(d, d.stations[i], now)

"""The 802.11 distributed coordination function as a state machine over arrays of records.

The next event of all stations is found in a tree of minima, and what happens changes nobody but
those who hear it: the work for a frame does not grow with the stations out of reach.

Nothing takes time to propagate: over 50 m it would be 0.17 us, a 50th of a slot.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import boolean, carray, float64, from_dtype, int64, njit, types, void
from numba.extending import intrinsic

from netmodels.kernels import exp, log, uniform

NEVER = np.int64(1) << 62

# What may be due, in the order of what happens first in one instant. A time and what is due then
# are one number, ``time_ns * KINDS + kind``, so that the smallest comes next.
END, TIMEOUT, ANSWER, START, DETECT, KINDS = 0, 1, 2, 3, 4, 8

BLOCK = 32  # stations whose next events have a common minimum

IDLE, SENDING, AWAITING = range(3)  # what a station does about its present packet
RTS, CTS, DATA, ACK = range(4)
RECEIVED, MISSED, DONE, DROPPED = range(4)  # outcomes

_INTS = "i8"
_FLOATS = "f8"

STATION = np.dtype([
    # What is due next: of its transmission (DETECT, END), its contention (START, TIMEOUT), and the
    # answer that it owes.
    ("air", _INTS), ("contention", _INTS), ("answer", _INTS),
    ("index", _INTS), ("key", "u8"),  # its number; of its random numbers
    ("first", _INTS), ("last", _INTS),  # links[first:last] are those that hear it
    # Contention. ``count`` slots are left from ``since`` on; before that the medium has to be idle
    # for DIFS or EIFS. ``nav``: until when the medium is reserved. ``tries``: failures of the
    # present packet; ``failed``: of the station in a row. ``expired``: a reply is overdue, but
    # something is being received that may be it.
    ("count", _INTS), ("since", _INTS), ("busy", _INTS), ("nav", _INTS), ("window", _INTS),
    ("tries", _INTS), ("failed", _INTS), ("role", _INTS), ("expired", _INTS), ("draws", _INTS),
    # Its queue, a ring: the first frame's position, how many there are, how many packets of the
    # first are done, since when the present packet is ready to go, whether its receiver has it.
    ("head", _INTS), ("length", _INTS), ("part", _INTS), ("ready", _INTS), ("got", _INTS),
    # Its reception: what it hears in mW, of how many; whose transmission it receives (-1: none),
    # at what power, without error with which chance so far (its log), interference accounted for
    # until when; whom to answer, and with what.
    ("heard", _FLOATS), ("signals", _INTS), ("lock", _INTS), ("power", _FLOATS),
    ("chance", _FLOATS), ("until", _INTS), ("peer", _INTS), ("reply", _INTS),
    # Until when it looks for preambles, what it heard before that, whose signal is the strongest
    # that came since, and which part of the interference it is not aware of.
    ("search", _INTS), ("before", _FLOATS), ("strongest", _INTS), ("unaware", _FLOATS),
    # Its transmission: whether it is on the air, since when, to whom (-1: all), with what, at which
    # rate, for how long after its end the medium is reserved; how many there were.
    ("on", _INTS), ("begun", _INTS), ("to", _INTS), ("kind", _INTS), ("rate", _INTS),
    ("reserve", _INTS), ("number", _INTS), ("ends", _INTS),
    # Counters: transmissions of data, failed ones (no reply), frames given up.
    ("transmitted", _INTS), ("failures", _INTS), ("dropped", _INTS),
])

# A frame in a queue: receiver (-1: all), how many packets, airtime of each and of the last one,
# their rate, airtimes of the control frames and their rates; ``rts_ns`` 0: no RTS.
FRAME = np.dtype([("dest", _INTS), ("packets", _INTS), ("air_ns", _INTS), ("last_ns", _INTS),
                  ("rate", _INTS), ("ack_ns", _INTS), ("ack_rate", _INTS), ("rts_ns", _INTS),
                  ("cts_ns", _INTS), ("rts_rate", _INTS)])

LINK = np.dtype([("station", _INTS), ("mw", _FLOATS)])  # who hears, and at which power

# When header and payload begin, counted from the beginning, and the rate of the header.
RATE = np.dtype([("bps", _FLOATS), ("header_ns", _INTS), ("payload_ns", _INTS),
                 ("header_rate", _INTS)])

OUTCOME = np.dtype([("time_ns", _INTS), ("what", _INTS), ("station", _INTS), ("position", _INTS),
                    ("receiver", _INTS)])

# ``energy_mw`` makes the medium busy; a preamble is found above ``signal_mw`` and a ratio of
# ``capture`` to noise and interference; above the ratio ``clear`` no bit has an error; the table
# of errors begins at ``table_db``, in steps of ``step_db``. ``unaware``: see ``arrive``. ``outcomes``: how many were noted.
SETUP = np.dtype([("slot_ns", _INTS), ("sifs_ns", _INTS), ("difs_ns", _INTS), ("eifs_ns", _INTS),
                  ("detection_ns", _INTS), ("cw_min", _INTS), ("cw_max", _INTS),
                  ("try_limit", _INTS), ("reset_at", _INTS), ("noise_mw", _FLOATS),
                  ("energy_mw", _FLOATS), ("signal_mw", _FLOATS), ("capture", _FLOATS),
                  ("clear", _FLOATS), ("table_db", _FLOATS), ("step_db", _FLOATS),
                  ("unaware", _INTS), ("outcomes", _INTS)])


class Dcf(NamedTuple):
    """What the functions below work on.

    stations [n] | words, the same as numbers | due [blocks, 1 + BLOCK] what is due next at each
    station of a block, behind the least of them, -1 if that is not known | frames [n, limit] rings
    | links | rates | table [rates, k] log(-log(chance that a bit has no error)) | setup [1] |
    outcomes, room for more than 2 n
    """

    stations: np.ndarray
    words: np.ndarray
    due: np.ndarray
    frames: np.ndarray
    links: np.ndarray
    rates: np.ndarray
    table: np.ndarray
    setup: np.ndarray
    outcomes: np.ndarray


_i8, _f8, _b1 = int64, float64, boolean
_station, _setup = from_dtype(STATION), from_dtype(SETUP)
_due, _rates, _table = _i8[:, ::1], from_dtype(RATE)[::1], _f8[:, ::1]
_dcf = types.NamedTuple((_station[::1], _i8[::1], _due, from_dtype(FRAME)[:, ::1],
                         from_dtype(LINK)[::1], _rates, _table, _setup[::1],
                         from_dtype(OUTCOME)[::1]), Dcf)


@intrinsic
def _pointer(typing_context, address):
    """The memory at an address."""
    def code(context, builder, signature, arguments):
        return builder.inttoptr(arguments[0], context.get_value_type(types.voidptr))
    return types.voidptr(int64), code


@njit(_dcf(_i8[:, ::1]), cache=True)
def view(at):
    """The arrays at addresses: ``at`` has a row for each field of ``Dcf``, address and shape.
    Python's arrays would do as well, but they would be unpacked at each call and their references
    counted at each use, which takes longer than all the rest."""
    return Dcf(carray(_pointer(at[0, 0]), (at[0, 1],), STATION),
               carray(_pointer(at[1, 0]), (at[1, 1],), np.int64),
               carray(_pointer(at[2, 0]), (at[2, 1], at[2, 2]), np.int64),
               carray(_pointer(at[3, 0]), (at[3, 1], at[3, 2]), FRAME),
               carray(_pointer(at[4, 0]), (at[4, 1],), LINK),
               carray(_pointer(at[5, 0]), (at[5, 1],), RATE),
               carray(_pointer(at[6, 0]), (at[6, 1], at[6, 2]), np.float64),
               carray(_pointer(at[7, 0]), (at[7, 1],), SETUP),
               carray(_pointer(at[8, 0]), (at[8, 1],), OUTCOME))


@njit(void(_due, _station), cache=True, error_model="numpy")
def schedule(due, s):
    """What is due next at station s has changed."""
    block, row = due[s.index // BLOCK], 1 + s.index % BLOCK
    before, after = block[row], min(s.air, min(s.contention, s.answer))
    block[row] = after
    if after < block[0]:
        block[0] = after
    elif before == block[0]:
        block[0] = -1


@njit(_i8(_due), cache=True, error_model="numpy")
def soonest(due):
    """The block with what is due first."""
    first = 0
    for b in range(due.shape[0]):
        block = due[b]
        if block[0] < 0:
            least = NEVER
            for row in range(1, BLOCK + 1):
                least = min(least, block[row])
            block[0] = least
        if block[0] < due[first, 0]:
            first = b
    return first


@njit(void(_setup, _station), cache=True, error_model="numpy")
def draw(setup, s):
    """A new backoff, uniform in 0..window."""
    s.count = np.int64(uniform(s.key, np.uint64(s.draws)) * (s.window + 1))
    s.draws += 1


@njit(void(_setup, _due, _station), cache=True, error_model="numpy")
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


@njit(void(_setup, _due, _station, _i8, _i8), cache=True, error_model="numpy")
def sense(setup, due, s, now, ifs):
    """Station s looks at the medium. If it has become busy, the counter stops; only whole idle
    slots count, and a station that was to begin at this very instant has not noticed. If it has
    become idle, counting begins ``ifs`` later."""
    busy = s.on == 1 or s.lock >= 0 or s.heard >= setup.energy_mw
    if busy and s.busy == 0:
        s.busy = 1
        if s.contention % KINDS == START and s.contention // KINDS == now and s.role == IDLE:
            return
        if now > s.since:
            s.count = max(s.count - (now - s.since) // setup.slot_ns, 0)
        plan(setup, due, s)
    elif s.busy == 1 and not busy:
        s.busy = 0
        s.since = max(now, s.nav) + ifs
        plan(setup, due, s)


@njit(_f8(_setup, _table, _i8, _f8), cache=True, error_model="numpy")
def log_success(setup, table, rate, ratio):
    """Log of the chance that a bit at ``rate`` has no error, at this signal to noise ratio."""
    at = (10.0 / 2.302585092994046 * log(ratio) - setup.table_db) / setup.step_db
    if at >= table.shape[1] - 1:
        return 0.0
    j = np.int64(max(at, 0.0))
    part = max(at, 0.0) - j
    return -exp(table[rate, j] + part * (table[rate, j + 1] - table[rate, j]))


@njit(void(_setup, _rates, _table, _station, _station, _i8), cache=True, error_model="numpy")
def account(setup, rates, table, r, source, now):
    """What happened to what station r receives since its interference changed last."""
    begin, r.until = r.until, now
    ratio = r.power / (setup.noise_mw + max(r.heard - r.power - r.unaware, 0.0))
    r.unaware = 0.0
    if ratio >= setup.clear:
        return
    rate = rates[source.rate]
    payload = source.begun + rate.payload_ns
    header = source.begun + rate.header_ns
    if begin < payload and now > header:
        bits = (min(now, payload) - max(begin, header)) * 1e-9 * rates[rate.header_rate].bps
        r.chance += bits * log_success(setup, table, rate.header_rate, ratio)
    if now > payload:
        bits = (now - max(begin, payload)) * 1e-9 * rate.bps
        r.chance += bits * log_success(setup, table, source.rate, ratio)


@njit(void(_setup, _station, _i8, _i8, _f8), cache=True, error_model="numpy")
def arrive(setup, r, i, now, mw):
    """Station i's signal comes to station r, which receives nothing yet. In ns-3, whose interference
    is what it was when the search for preambles began, and then what every later change makes it,
    r will not be aware of what came during the search before the frame that it receives; so of two
    frames sent at the same instant one may be read in spite of the other."""
    if now >= r.search:
        r.search, r.before, r.strongest, r.power = now + setup.detection_ns, r.heard, -1, 0.0
    r.unaware = 0.0
    if mw > r.power:
        r.strongest, r.power = i, mw
        if setup.unaware == 1:
            r.unaware = r.heard - r.before


@njit(void(_dcf, _station, _i8), cache=True, error_model="numpy")
def transmit(d, s, now):
    """Station s goes on the air. What it was receiving is lost."""
    setup, stations, due, links = d.setup[0], d.stations, d.due, d.links
    s.lock = -1
    s.on, s.begun = 1, now
    s.number += 1
    s.air = (now + setup.detection_ns) * KINDS + DETECT
    schedule(due, s)
    sense(setup, due, s, now, setup.difs_ns)
    for k in range(s.first, s.last):
        r = stations[links[k].station]
        if r.lock >= 0:
            account(setup, d.rates, d.table, r, stations[r.lock], now)
        else:
            arrive(setup, r, s.index, now, links[k].mw)
        r.heard += links[k].mw
        r.signals += 1


@njit(void(_dcf, _station, _i8, _i8), cache=True, error_model="numpy")
def send(d, s, now, kind):
    """Station s transmits a frame of the exchange that it or its peer began."""
    setup = d.setup[0]
    owner = s if kind == RTS or kind == DATA else d.stations[s.peer]
    frame = d.frames[owner.index, owner.head]
    data = frame.last_ns if owner.part == frame.packets - 1 else frame.air_ns
    s.kind, s.rate, s.reserve = kind, frame.rts_rate, 0
    s.to = s.peer if kind == CTS or kind == ACK else frame.dest
    if kind == RTS:
        airtime, s.reserve = frame.rts_ns, 3 * setup.sifs_ns + frame.cts_ns + data + frame.ack_ns
    elif kind == CTS:
        airtime, s.reserve = frame.cts_ns, 2 * setup.sifs_ns + data + frame.ack_ns
    elif kind == DATA:
        airtime, s.rate = data, frame.rate
        s.transmitted += 1
        if frame.dest >= 0:
            s.reserve = setup.sifs_ns + frame.ack_ns
    else:
        airtime, s.rate = frame.ack_ns, frame.ack_rate
    s.ends = now + airtime
    transmit(d, s, now)


@njit(void(_dcf, _station, _i8), cache=True, error_model="numpy")
def detect(d, s, now):
    """The beginning of station s's preamble is over: who hears it well enough receives it. Not
    before now does anybody know that the medium is busy."""
    setup, stations, due, links = d.setup[0], d.stations, d.due, d.links
    s.air = s.ends * KINDS + END
    schedule(due, s)
    for k in range(s.first, s.last):
        r, power = stations[links[k].station], links[k].mw
        found = power >= setup.capture * (setup.noise_mw + max(r.heard - power, 0.0))
        if found and power >= setup.signal_mw and r.on == 0 and r.lock < 0:
            r.lock, r.power, r.chance, r.until = s.index, power, 0.0, now
            if r.strongest != s.index:
                r.unaware = 0.0
        sense(setup, due, r, now, setup.difs_ns)


@njit(void(_dcf, _i8, _i8, _station, _i8), cache=True, error_model="numpy")
def tell(d, now, what, s, receiver):
    """Note an outcome of the first frame of station s's queue."""
    outcome = d.outcomes[d.setup[0].outcomes]
    outcome.time_ns, outcome.what, outcome.station = now, what, s.index
    outcome.position, outcome.receiver = s.head, receiver
    d.setup[0].outcomes += 1


@njit(void(_setup, _due, _station, _i8), cache=True, error_model="numpy")
def next_packet(setup, due, s, now):
    """The present packet of station s is through, one way or the other."""
    s.role, s.tries, s.got, s.expired, s.ready = IDLE, 0, 0, 0, now
    draw(setup, s)
    plan(setup, due, s)


@njit(void(_dcf, _station), cache=True, error_model="numpy")
def leave(d, s):
    """The first frame leaves station s's queue."""
    s.head = (s.head + 1) % d.frames.shape[1]
    s.length -= 1
    s.part = 0


@njit(void(_dcf, _station, _i8), cache=True, error_model="numpy")
def succeed(d, s, now):
    """The packet of station s was acknowledged, or needs no acknowledgement."""
    frame = d.frames[s.index, s.head]
    s.window, s.failed = d.setup[0].cw_min, 0
    s.part += 1
    if s.part == frame.packets:
        if frame.dest < 0:
            tell(d, now, DONE, s, -1)
        leave(d, s)
    next_packet(d.setup[0], d.due, s, now)


@njit(void(_dcf, _station, _i8), cache=True, error_model="numpy")
def fail(d, s, now):
    """No reply came. The window doubles up to its largest; what resets it, besides a success, is
    the station's ``reset_at``-th failure in a row, and not that a packet is given up."""
    setup = d.setup[0]
    s.failures += 1
    s.tries += 1
    s.failed += 1
    s.window = min(2 * s.window + 1, setup.cw_max)
    if s.failed == setup.reset_at:
        s.failed, s.window = 0, setup.cw_min
    if s.busy == 0:
        s.since = max(now, s.nav) + setup.difs_ns
    if s.tries < setup.try_limit:
        s.role, s.expired = IDLE, 0
        draw(setup, s)
        plan(setup, d.due, s)
        return
    s.dropped += 1
    frame = d.frames[s.index, s.head]
    if s.got == 0 or s.part < frame.packets - 1:  # else only its acknowledgements were lost
        tell(d, now, DROPPED, s, frame.dest)
    leave(d, s)
    next_packet(setup, d.due, s, now)


@njit(_b1(_station, _station), cache=True, error_model="numpy")
def survives(r, source):
    """Whether what station r was receiving has no error."""
    if r.chance == 0.0:
        return True
    key = r.key ^ (source.key << np.uint64(1))
    return uniform(key, np.uint64(source.number)) < exp(r.chance)


@njit(void(_setup, _due, _station, _station, _i8, _i8), cache=True, error_model="numpy")
def answer(setup, due, r, peer, now, kind):
    """Station r will send ``kind`` to ``peer`` after a short interframe space."""
    r.peer, r.reply = peer.index, kind
    r.answer = (now + setup.sifs_ns) * KINDS + ANSWER
    schedule(due, r)


@njit(void(_dcf, _station, _station, _i8), cache=True, error_model="numpy")
def take(d, r, s, now):
    """Station r has received station s's frame without errors."""
    setup, due = d.setup[0], d.due
    if s.to == -1:
        tell(d, now, RECEIVED, s, r.index)
    elif s.to != r.index:
        r.nav = max(r.nav, now + s.reserve)
    elif s.kind == DATA:
        answer(setup, due, r, s, now, ACK)
        if s.got == 0 and s.part == d.frames[s.index, s.head].packets - 1:
            tell(d, now, RECEIVED, s, r.index)
        s.got = 1
    elif s.kind == RTS:
        if r.nav <= now:
            answer(setup, due, r, s, now, CTS)
    elif r.role == AWAITING and s.kind == (ACK if r.kind == DATA else CTS):
        r.expired, r.contention = 0, NEVER
        if s.kind == CTS:
            r.role = SENDING
            answer(setup, due, r, s, now, DATA)
        else:
            succeed(d, r, now)


@njit(void(_dcf, _station, _i8), cache=True, error_model="numpy")
def finish(d, s, now):
    """Station s's transmission ends. Who could not make it out waits longer than the others."""
    setup, stations, due, links = d.setup[0], d.stations, d.due, d.links
    s.on, s.air = 0, NEVER
    for k in range(s.first, s.last):
        r, ifs = stations[links[k].station], setup.difs_ns
        if r.lock >= 0:
            account(setup, d.rates, d.table, r, stations[r.lock], now)
        else:
            r.unaware = 0.0
        r.signals -= 1
        r.heard = r.heard - links[k].mw if r.signals > 0 else 0.0
        if r.lock == s.index:
            r.lock = -1
            if survives(r, s):
                take(d, r, s, now)
            else:
                ifs = setup.eifs_ns
                if s.to == -1:
                    tell(d, now, MISSED, s, r.index)
            if r.expired == 1:
                fail(d, r, now)
        sense(setup, due, r, now, ifs)
    if s.kind == DATA and s.to == -1:
        succeed(d, s, now)
    elif s.kind == DATA or s.kind == RTS:
        rate = d.frames[s.index, s.head].ack_rate if s.kind == DATA else s.rate
        wait = setup.sifs_ns + setup.slot_ns + d.rates[rate].payload_ns
        s.role, s.contention = AWAITING, (now + wait) * KINDS + TIMEOUT
    schedule(due, s)
    sense(setup, due, s, now, setup.difs_ns)


@njit(void(_dcf, _station, _i8, _i8), cache=True, error_model="numpy")
def happen(d, s, now, what):
    """What is due at station s happens."""
    if what == END:
        finish(d, s, now)
    elif what == DETECT:
        detect(d, s, now)
    elif what == ANSWER:
        s.answer = NEVER
        schedule(d.due, s)
        send(d, s, now, s.reply)
    elif what == START:
        s.role, s.contention = SENDING, NEVER
        send(d, s, now, RTS if d.frames[s.index, s.head].rts_ns > 0 else DATA)
    else:
        s.contention = NEVER
        schedule(d.due, s)
        if s.lock >= 0:
            s.expired = 1
        else:
            fail(d, s, now)


@njit(_i8(_i8[::1], _i8), cache=True, error_model="numpy")
def pick(block, what):
    """The row of a block where ``what`` is due; if there are several, from either end, so that
    nobody is always the first in an instant."""
    row, step = 1, 1
    if uniform(np.uint64(0), np.uint64(what)) < 0.5:
        row, step = BLOCK, -1
    while block[row] != what:
        row += step
    return row


@njit(void(_dcf, _i8), cache=True, error_model="numpy")
def run(d, until):
    """Let happen what is due up to ``until``, or up to the first instant with an outcome."""
    d.setup[0].outcomes = 0
    while True:
        b = soonest(d.due)
        what = d.due[b, 0]
        if what // KINDS > until:
            break
        row = pick(d.due[b], what)
        happen(d, d.stations[b * BLOCK + row - 1], what // KINDS, what % KINDS)
        if d.setup[0].outcomes > 0:
            until = what // KINDS


@njit(void(_i8[:, :, ::1], _i8, _i8), cache=True, error_model="numpy")
def advance(where, present, until):
    """Let happen what is due up to ``until``, or up to the first instant with an outcome."""
    run(view(where[present]), until)


@njit(void(_i8[:, :, ::1], _i8, _i8), cache=True, error_model="numpy")
def settle(where, present, now):
    """Before the links change: let happen what is due up to now, and account for all receptions."""
    d = view(where[present])
    run(d, now)
    for i in range(d.stations.size):
        r = d.stations[i]
        if r.lock >= 0:
            account(d.setup[0], d.rates, d.table, r, d.stations[r.lock], now)


@njit(void(_i8[:, :, ::1], _i8, _i8), cache=True, error_model="numpy")
def relink(where, present, now):
    """The links have changed: what everybody hears, from who is on the air. Whoever can no longer
    hear what it was receiving has lost it."""
    d = view(where[present])
    stations, setup = d.stations, d.setup[0]
    for i in range(stations.size):
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
            r.lock = -1
            if r.expired == 1:
                fail(d, r, now)
        sense(setup, d.due, r, now, setup.eifs_ns)


@njit(_i8(_i8[:, :, ::1], _i8), cache=True, error_model="numpy")
def foresee(where, present):
    """Try out the future, up to the first outcome if nobody sends anything more. Returns when that
    is, ``NEVER`` if there is none."""
    d, future = view(where[present]), view(where[1 - present])
    future.words[:] = d.words
    future.due[:] = d.due
    run(future, NEVER // KINDS - 1)
    return future.outcomes[0].time_ns if future.setup[0].outcomes > 0 else NEVER


@njit(_i8(_i8[:, :, ::1], _i8, _i8, _i8, _i8, _i8, _i8, _i8, _i8, _i8, _i8, _i8, _i8, _i8),
      cache=True, error_model="numpy")
def enqueue(where, present, now, i, dest, packets, air_ns, last_ns, rate, ack_ns, ack_rate, rts_ns,
            cts_ns, rts_rate):
    """Station i gets a frame to send, after what is due before now. Returns its position in the
    queue, -1 if that is full."""
    d = view(where[present])
    run(d, now - 1)
    s, limit, setup = d.stations[i], d.frames.shape[1], d.setup[0]
    if s.length == limit:
        return -1
    position = (s.head + s.length) % limit
    frame = d.frames[i, position]
    frame.dest, frame.packets, frame.air_ns, frame.last_ns = dest, packets, air_ns, last_ns
    frame.rate, frame.ack_ns, frame.ack_rate = rate, ack_ns, ack_rate
    frame.rts_ns, frame.cts_ns, frame.rts_rate = rts_ns, cts_ns, rts_rate
    s.length += 1
    if s.length == 1 and s.role == IDLE:
        s.ready = now
        if (s.busy == 1 or now < s.nav) and s.count == 0:
            draw(setup, s)
        plan(setup, d.due, s)
    return position

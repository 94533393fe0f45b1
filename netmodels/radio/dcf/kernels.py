"""The 802.11 distributed coordination function as a state machine over arrays.

Stations are rows. The whole of it is one ``Dcf``; what changes in it is in ``due``, ``state``,
``level``, ``counts`` and ``told``, so that the future can be tried out on copies of these.

Nothing takes time to propagate: over 50 m it would be 0.17 us, a 50th of a slot.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import boolean, float64, int64, njit, types, uint64, void

from netmodels.kernels import exp, log, uniform

NEVER = np.int64(1) << 62

# What may be due, in the order of what happens first in one instant.
END, TIMEOUT, REPLY, START, DETECT, KINDS = range(6)

# Fields of a station. Contention:
(COUNT,  # backoff slots left ...
 SINCE,  # ... when counting begins; before that the medium has to be idle for DIFS or EIFS
 BUSY,  # whether the medium is sensed busy
 NAV,  # until when it is reserved (virtual carrier sense)
 WINDOW,  # contention window
 TRIES,  # transmissions of the present packet that failed
 FAILED,  # failures of the station in a row
 ROLE,  # what it does about the present packet: IDLE, SENDING, AWAITING a reply
 EXPIRED,  # the reply is overdue, but something is being received that may be it
 DRAWS,  # backoffs drawn so far
 # its queue, a ring:
 HEAD, LENGTH,  # position of the first frame, number of frames
 PART,  # packets of the first frame that are done
 READY,  # when the present packet became the next to be sent
 GOT,  # whether its receiver has it already (the acknowledgement was lost)
 # its reception:
 LOCK,  # whose transmission is being received, -1 none
 CHUNK,  # since when the present interference is not accounted for yet
 PEER,  # whom to reply to
 # its transmission:
 ON, TO, KIND,  # whether it is on the air; receiver, -1 all; DATA or ACK
 PAYLOAD, RATE,  # when the payload begins, and at which rate
 RESERVE,  # how long after its end the medium is reserved
 NUMBER,  # transmissions so far
 FIELDS) = range(26)

IDLE, SENDING, AWAITING = range(3)
DATA, ACK = range(2)

# Fields of a frame in a queue: receiver (-1: all), airtime of its packets and of the last one, how
# many they are, their rate, airtime and rate of the acknowledgement.
DEST, AIR_NS, LAST_NS, PARTS, DATA_RATE, ACK_NS, ACK_RATE, FRAME_FIELDS = range(8)

# Times in ns, and numbers.
(SLOT, SIFS, DIFS, EIFS, ACK_TIMEOUT, PREAMBLE, HEADER, DETECTION, CW_MIN, CW_MAX, TRY_LIMIT,
 RESET_AT, TIMES) = range(13)

# Powers in mW, and a ratio of powers.
NOISE, ENERGY, SIGNAL, CAPTURE, POWERS = range(5)

# What is counted.
TRANSMITTED, FAILURES, TOLD, COUNTS = range(4)

# What is told: when, what, of which station, the position of the frame in its queue, who received.
WHEN, WHAT, STATION, POSITION, RECEIVER, COLUMNS = range(6)
RECEIVED, MISSED, DONE, DROPPED = range(4)


class Dcf(NamedTuple):
    """A network of stations.

    due [KINDS, n] ns, when each station's next event of each kind is due | state [FIELDS, n] |
    level [2, n] the power in mW that a station hears, and the log of the chance that what it
    receives has no error so far | counts [COUNTS] | told [k, COLUMNS] outcomes, k > n

    Read only: queue [n, limit, FRAME_FIELDS] rings of frames | times [TIMES] | powers [POWERS] |
    first [n + 1], hearer, mw: station i is heard by hearer[first[i]:first[i + 1]], sorted, with
    the power mw there | table [rates, m] log(-log(chance that a bit has no error)) at a signal to
    noise ratio of grid[0] + j grid[1] dB, none from the ratio grid[2] on | bps [rates] | keys [n] of random numbers
    """

    due: np.ndarray
    state: np.ndarray
    level: np.ndarray
    counts: np.ndarray
    told: np.ndarray
    queue: np.ndarray
    times: np.ndarray
    powers: np.ndarray
    first: np.ndarray
    hearer: np.ndarray
    mw: np.ndarray
    table: np.ndarray
    grid: np.ndarray
    bps: np.ndarray
    keys: np.ndarray


_i8, _f8, _b1 = int64, float64, boolean
_i8x1, _i8x2, _f8x1, _f8x2 = int64[::1], int64[:, ::1], float64[::1], float64[:, ::1]
_dcf = types.NamedTuple((_i8x2, _i8x2, _f8x2, _i8x1, _i8x2, int64[:, :, ::1], _i8x1, _f8x1, _i8x1,
                         _i8x1, _f8x1, _f8x2, _f8x1, _f8x1, uint64[::1]), Dcf)


@njit(_i8(_dcf, _i8), cache=True)
def draw(d, i):
    """A new backoff, uniform in 0..window."""
    counter = np.uint64(d.state[DRAWS, i])
    d.state[DRAWS, i] += 1
    return np.int64(uniform(d.keys[i], counter) * (d.state[WINDOW, i] + 1))


@njit(void(_i8x2, _i8x2, _i8x1, _i8), cache=True)
def plan(due, state, times, i):
    """When station i will transmit if the medium stays idle."""
    due[START, i] = NEVER
    if state[LENGTH, i] > 0 and state[ROLE, i] == IDLE and state[BUSY, i] == 0:
        due[START, i] = max(state[SINCE, i] + state[COUNT, i] * times[SLOT], state[READY, i])


@njit(void(_i8x2, _i8x2, _i8x1, _i8, _i8, _i8), cache=True)
def turn(due, state, times, i, now, ifs):
    """The medium became busy for station i: its counter stops. Only whole idle slots count, and a
    station that was to begin at this very instant has not noticed. Or it became idle: counting
    begins ``ifs`` later."""
    if state[BUSY, i] == 0:
        state[BUSY, i] = 1
        if due[START, i] > now:
            due[START, i] = NEVER
            if now > state[SINCE, i]:
                slots = (now - state[SINCE, i]) // times[SLOT]
                state[COUNT, i] = max(state[COUNT, i] - slots, 0)
    else:
        state[BUSY, i] = 0
        state[SINCE, i] = max(now, state[NAV, i]) + ifs
        plan(due, state, times, i)


@njit(void(_dcf, _i8, _i8), cache=True)
def sense(d, i, now):
    """Station i and all that hear it look whether the medium is busy now."""
    state, level, energy, hearer = d.state, d.level, d.powers[ENERGY], d.hearer
    for k in range(d.first[i] - 1, d.first[i + 1]):
        r = hearer[k] if k >= d.first[i] else i
        busy = state[ON, r] == 1 or state[LOCK, r] >= 0 or level[0, r] >= energy
        if busy != (state[BUSY, r] == 1):
            turn(d.due, state, d.times, r, now, d.times[DIFS])


@njit(_f8(_f8x2, _f8x1, _i8, _f8), cache=True)
def log_success(table, grid, rate, ratio):
    """Log of the chance that a bit at ``rate`` has no error, at this signal to noise ratio."""
    at = (10.0 / 2.302585092994046 * log(ratio) - grid[0]) / grid[1]
    if at >= table.shape[1] - 1:
        return 0.0
    j = np.int64(max(at, 0.0))
    part = max(at, 0.0) - j
    return -exp(table[rate, j] + part * (table[rate, j + 1] - table[rate, j]))


@njit(void(_dcf, _i8, _i8, _f8), cache=True)
def account(d, r, now, power):
    """What happened to what station r receives since its interference changed last. The bits of
    the header go at the lowest rate."""
    state, source, begin = d.state, d.state[LOCK, r], d.state[CHUNK, r]
    ratio = power / (d.powers[NOISE] + max(d.level[0, r] - power, 0.0))
    payload, rate = state[PAYLOAD, source], state[RATE, source]
    header = payload - d.times[HEADER]
    if begin < payload and now > header:
        bits = (min(now, payload) - max(begin, header)) * 1e-9 * d.bps[0]
        d.level[1, r] += bits * log_success(d.table, d.grid, 0, ratio)
    if now > payload:
        bits = (now - max(begin, payload)) * 1e-9 * d.bps[rate]
        d.level[1, r] += bits * log_success(d.table, d.grid, rate, ratio)


@njit(_f8(_i8x1, _i8x1, _f8x1, _i8, _i8), cache=True)
def power_at(first, hearer, mw, source, i):
    """What station i hears of ``source`` in mW."""
    low, high = first[source], first[source + 1]
    while low < high:
        middle = (low + high) // 2
        if hearer[middle] < i:
            low = middle + 1
        else:
            high = middle
    return mw[low] if low < first[source + 1] and hearer[low] == i else 0.0


@njit(void(_dcf, _i8, _i8, _f8), cache=True)
def radiate(d, i, now, sign):
    """Station i goes on the air (``sign`` 1) or off it (-1), for everybody who hears it."""
    state, level, hearer, mw = d.state, d.level, d.hearer, d.mw
    noise, clear = d.powers[NOISE], d.grid[2]
    for k in range(d.first[i], d.first[i + 1]):
        r = hearer[k]
        source = state[LOCK, r]
        if source >= 0:
            power = mw[k] if source == i else power_at(d.first, hearer, mw, source, r)
            if power < clear * (noise + max(level[0, r] - power, 0.0)):
                account(d, r, now, power)
            state[CHUNK, r] = now
        level[0, r] = max(level[0, r] + sign * mw[k], 0.0)


@njit(void(_dcf, _i8, _i8, _i8, _i8, _i8, _i8, _i8), cache=True)
def transmit(d, i, now, to, kind, airtime, rate, reserve):
    """Station i begins to transmit. What it was receiving is lost."""
    state, times = d.state, d.times
    state[LOCK, i] = -1
    state[ON, i], state[TO, i], state[KIND, i] = 1, to, kind
    state[PAYLOAD, i] = now + times[PREAMBLE] + times[HEADER]
    state[RATE, i], state[RESERVE, i] = rate, reserve
    state[NUMBER, i] += 1
    d.due[END, i], d.due[DETECT, i] = now + airtime, now + times[DETECTION]
    radiate(d, i, now, 1.0)
    sense(d, i, now)


@njit(void(_dcf, _i8, _i8), cache=True)
def detect(d, i, now):
    """The beginning of station i's preamble is over: who hears it well enough receives it."""
    state, level, powers, hearer, mw = d.state, d.level, d.powers, d.hearer, d.mw
    d.due[DETECT, i] = NEVER
    for k in range(d.first[i], d.first[i + 1]):
        r, power = hearer[k], mw[k]
        if state[ON, r] == 1 or state[LOCK, r] >= 0 or power < powers[SIGNAL]:
            continue
        if power >= powers[CAPTURE] * (powers[NOISE] + max(level[0, r] - power, 0.0)):
            state[LOCK, r], state[CHUNK, r], level[1, r] = i, now, 0.0
            if state[BUSY, r] == 0:
                turn(d.due, state, d.times, r, now, d.times[DIFS])


@njit(void(_dcf, _i8, _i8, _i8, _i8, _i8), cache=True)
def tell(d, now, what, i, position, receiver):
    """Note an outcome."""
    row = d.told[d.counts[TOLD]]
    row[WHEN], row[WHAT], row[STATION] = now, what, i
    row[POSITION], row[RECEIVER] = position, receiver
    d.counts[TOLD] += 1


@njit(void(_dcf, _i8, _i8), cache=True)
def next_packet(d, i, now):
    """The present packet of station i is through, one way or the other."""
    d.state[ROLE, i], d.state[TRIES, i], d.state[GOT, i], d.state[READY, i] = IDLE, 0, 0, now
    d.state[EXPIRED, i] = 0
    d.state[COUNT, i] = draw(d, i)
    plan(d.due, d.state, d.times, i)


@njit(void(_dcf, _i8, _i8, _i8), cache=True)
def leave(d, i, now, what):
    """The first frame of station i's queue is DONE or DROPPED."""
    head = d.state[HEAD, i]
    tell(d, now, what, i, head, d.queue[i, head, DEST])
    d.state[HEAD, i] = (head + 1) % d.queue.shape[1]
    d.state[LENGTH, i] -= 1
    d.state[PART, i] = 0


@njit(void(_dcf, _i8, _i8), cache=True)
def succeed(d, i, now):
    """The packet of station i was acknowledged, or needs no acknowledgement."""
    d.due[TIMEOUT, i] = NEVER
    d.state[WINDOW, i], d.state[FAILED, i] = d.times[CW_MIN], 0
    d.state[PART, i] += 1
    if d.state[PART, i] == d.queue[i, d.state[HEAD, i], PARTS]:
        leave(d, i, now, DONE)
    next_packet(d, i, now)


@njit(void(_dcf, _i8, _i8), cache=True)
def fail(d, i, now):
    """No reply came. The window doubles up to its largest; what resets it, besides a success, is
    the station's ``RESET_AT``-th failure in a row, and not that a packet is given up."""
    d.counts[FAILURES] += 1
    d.state[TRIES, i] += 1
    d.state[FAILED, i] += 1
    d.state[WINDOW, i] = min(2 * d.state[WINDOW, i] + 1, d.times[CW_MAX])
    if d.state[FAILED, i] == d.times[RESET_AT]:
        d.state[FAILED, i], d.state[WINDOW, i] = 0, d.times[CW_MIN]
    if d.state[BUSY, i] == 0:
        d.state[SINCE, i] = max(now, d.state[NAV, i]) + d.times[DIFS]
    if d.state[TRIES, i] == d.times[TRY_LIMIT]:
        last = d.state[PART, i] == d.queue[i, d.state[HEAD, i], PARTS] - 1
        # It has arrived all the same if only its acknowledgements were lost.
        leave(d, i, now, DONE if last and d.state[GOT, i] == 1 else DROPPED)
        next_packet(d, i, now)
    else:
        d.state[ROLE, i], d.state[EXPIRED, i] = IDLE, 0
        d.state[COUNT, i] = draw(d, i)
        plan(d.due, d.state, d.times, i)


@njit(_b1(_dcf, _i8), cache=True)
def survives(d, r):
    """Whether what station r was receiving has no error."""
    source = d.state[LOCK, r]
    if d.level[1, r] == 0.0:
        return True
    key = d.keys[r] ^ (d.keys[source] << np.uint64(1))
    return uniform(key, np.uint64(d.state[NUMBER, source])) < exp(d.level[1, r])


@njit(void(_dcf, _i8, _i8), cache=True)
def take(d, r, now):
    """Station r has received a frame without errors."""
    i = d.state[LOCK, r]
    head, to = d.state[HEAD, i], d.state[TO, i]
    if d.state[KIND, i] == ACK:
        if to == r and d.state[ROLE, r] == AWAITING:
            succeed(d, r, now)
    elif to == -1:
        tell(d, now, RECEIVED, i, head, r)
    elif to == r:
        d.due[REPLY, r], d.state[PEER, r] = now + d.times[SIFS], i
        if d.state[GOT, i] == 0 and d.state[PART, i] == d.queue[i, head, PARTS] - 1:
            tell(d, now, RECEIVED, i, head, r)
        d.state[GOT, i] = 1
    else:
        d.state[NAV, r] = max(d.state[NAV, r], now + d.state[RESERVE, i])


@njit(_i8(_dcf, _i8, _i8, _i8), cache=True)
def end_reception(d, r, i, now):
    """Station i's transmission, which station r was receiving, is over. Returns how long the medium
    has to be idle before r counts down again: longer after a frame with errors."""
    ifs = d.times[DIFS]
    if survives(d, r):
        take(d, r, now)
    else:
        ifs = d.times[EIFS]
        if d.state[TO, i] == -1:
            tell(d, now, MISSED, i, d.state[HEAD, i], r)
    if d.state[EXPIRED, r] == 1:
        fail(d, r, now)
    return ifs


@njit(void(_dcf, _i8, _i8), cache=True)
def finish(d, i, now):
    """Station i's transmission ends."""
    state, level, hearer = d.state, d.level, d.hearer
    d.due[END, i] = NEVER
    radiate(d, i, now, -1.0)
    state[ON, i] = 0
    for k in range(d.first[i], d.first[i + 1]):
        r, ifs = hearer[k], d.times[DIFS]
        if state[LOCK, r] != i:
            continue
        if state[TO, i] in (r, -1) or level[1, r] < 0.0 or state[EXPIRED, r] == 1:
            ifs = end_reception(d, r, i, now)
        else:  # overheard: r keeps quiet as long as the frame asks for
            state[NAV, r] = max(state[NAV, r], now + state[RESERVE, i])
        state[LOCK, r] = -1
        if state[ON, r] == 0 and level[0, r] < d.powers[ENERGY]:
            turn(d.due, state, d.times, r, now, ifs)
    if state[KIND, i] == DATA:
        if state[TO, i] == -1:
            succeed(d, i, now)
        else:
            state[ROLE, i], d.due[TIMEOUT, i] = AWAITING, now + d.times[ACK_TIMEOUT]
    sense(d, i, now)


@njit(void(_dcf, _i8, _i8), cache=True)
def start(d, i, now):
    """Station i's backoff is over: the next packet goes."""
    frame = d.queue[i, d.state[HEAD, i]]
    last = d.state[PART, i] == frame[PARTS] - 1
    d.due[START, i] = NEVER
    d.state[ROLE, i] = SENDING
    d.counts[TRANSMITTED] += 1
    transmit(d, i, now, frame[DEST], DATA, frame[LAST_NS] if last else frame[AIR_NS],
             frame[DATA_RATE], d.times[SIFS] + frame[ACK_NS])


@njit(void(_dcf, _i8, _i8), cache=True)
def reply(d, i, now):
    """Station i acknowledges, whatever it senses."""
    peer = d.state[PEER, i]
    frame = d.queue[peer, d.state[HEAD, peer]]
    d.due[REPLY, i] = NEVER
    transmit(d, i, now, peer, ACK, frame[ACK_NS], frame[ACK_RATE], 0)


@njit(void(_dcf, _i8), cache=True)
def advance(d, until):
    """Let happen what is due up to ``until``, or up to the first instant with an outcome."""
    n = d.due.shape[1]
    due = d.due.ravel()
    d.counts[TOLD] = 0
    while True:
        at = np.argmin(due)
        now, what, i = due[at], at // n, at % n
        if now > until:
            break
        if what == END:
            finish(d, i, now)
        elif what == TIMEOUT:
            d.due[TIMEOUT, i] = NEVER
            if d.state[LOCK, i] >= 0:
                d.state[EXPIRED, i] = 1
            else:
                fail(d, i, now)
        elif what == REPLY:
            reply(d, i, now)
        elif what == START:
            start(d, i, now)
        else:
            detect(d, i, now)
        if d.counts[TOLD] > 0:
            until = now


@njit(void(_dcf, _i8, _i8), cache=True)
def enqueue(d, i, now):
    """A frame was written behind the last one of station i's queue."""
    d.state[LENGTH, i] += 1
    if d.state[LENGTH, i] > 1 or d.state[ROLE, i] != IDLE:
        return
    d.state[READY, i] = now
    busy = d.state[BUSY, i] == 1 or now < d.state[NAV, i]
    if busy and d.state[COUNT, i] == 0:
        d.state[COUNT, i] = draw(d, i)
    plan(d.due, d.state, d.times, i)


@njit(_i8(_dcf, _dcf), cache=True)
def foresee(d, copy):
    """When the next outcome will be if nobody sends anything more; ``NEVER`` if there is none.
    ``copy`` has arrays of its own for what changes."""
    copy.due[:], copy.state[:], copy.level[:], copy.counts[:] = d.due, d.state, d.level, d.counts
    advance(copy, NEVER - 1)
    return copy.told[0, WHEN] if copy.counts[TOLD] > 0 else NEVER

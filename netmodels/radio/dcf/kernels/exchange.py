"""The events of a transmission, at its station and at those who hear it: its start, preamble,
header, end and reply.

Signals arrive without delay (really 0.17 us over 50 m, a 50th of a slot); with ``unaware`` the
distances decide which of two frames in one slot comes first.
"""

from __future__ import annotations

from numba import boolean, int64, void

from desim.ports.kernels import lean
from netmodels.radio.dcf.kernels.contention import draw, plan, rest, sense
from netmodels.radio.dcf.kernels.frames import tune
from netmodels.radio.dcf.kernels.reception import account, arrive, survives
from netmodels.radio.dcf.kernels.records import (
    ACK,
    ACKED,
    ANSWER,
    AWAITING,
    CTS,
    DATA,
    DETECT,
    DONE,
    DROPPED,
    END,
    EXPIRED,
    FAILED,
    HEADER,
    HEARD,
    IDLE,
    KINDS,
    MISSED,
    NEVER,
    RECEIVED,
    RTS,
    SENDING,
    START,
    TIMEOUT,
    a_dcf,
    a_setup,
    a_station,
    all_due,
    schedule,
    touch,
)

_i8 = int64


@lean(void(a_dcf, a_station, _i8))
def transmit(d, s, now):
    """Station s goes on the air. What it was receiving is lost."""
    setup, stations, due, links = d.setup[0], d.stations, d.due, d.links
    s.lock = -1
    s.on, s.begun = 1, now
    s.number += 1
    s.air = (now + setup.detection_ns) * KINDS + DETECT
    schedule(due, s)
    sense(setup, due, s, now)
    for k in range(s.first, s.last):
        r = stations[links[k].station]
        touch(d, r)
        if r.lock >= 0:
            account(setup, d.rates, d.table, r, stations[r.lock], now)
        elif setup.unaware == 1:
            arrive(d, r, s, now, links[k])
        r.heard += links[k].mw
        r.signals += 1


@lean(void(a_dcf, a_station, _i8, _i8))
def send(d, s, now, kind):
    """Station s transmits a frame of the exchange that it or its peer began."""
    setup = d.setup[0]
    owner = s if kind in (RTS, DATA) else d.stations[s.peer]
    frame = d.frames[owner.index, owner.head]
    data = frame.last_ns if owner.part == frame.packets - 1 else frame.air_ns
    s.kind, s.rate, s.reserve = kind, frame.rts_rate, 0
    s.to = s.peer if kind in (CTS, ACK) else frame.dest
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


@lean(void(a_dcf, a_station, _i8))
def detect(d, s, now):
    """The beginning of station s's preamble is over: who hears it well enough, and was not sending
    when it came, receives it. Not before now does anybody know that the medium is busy."""
    setup, stations, due, links = d.setup[0], d.stations, d.due, d.links
    header = s.begun + d.rates[s.rate].payload_ns
    s.air = header * KINDS + HEADER if setup.gives_up == 1 else s.ends * KINDS + END
    schedule(due, s)
    for k in range(s.first, s.last):
        r, power = stations[links[k].station], links[k].mw
        if power < setup.signal_mw and r.heard < setup.energy_mw:
            continue  # to it this is noise
        touch(d, r)
        r.deaf = 0
        found = power >= setup.capture * (setup.noise_mw + max(r.heard - power, 0.0))
        if found and power >= setup.signal_mw and r.lock < 0 and r.ends <= s.begun:
            r.lock, r.power, r.chance, r.until = s.index, power, 0.0, now
            if now + d.rates[s.rate].payload_ns - setup.detection_ns <= r.doubt:
                r.nav = max(r.nav, r.announced)
            if r.strongest != s.index:
                r.unaware = 0.0
        sense(setup, due, r, now)


@lean(void(a_dcf, a_station, _i8))
def read_header(d, s, now):
    """The header of station s's frame is over. A receiver of ns-3 gives the frame up if that has
    errors, and takes the medium for idle from then on, until something new comes."""
    setup, stations, due, links = d.setup[0], d.stations, d.due, d.links
    s.air = s.ends * KINDS + END
    schedule(due, s)
    for k in range(s.first, s.last):
        r = stations[links[k].station]
        if r.lock == s.index:
            touch(d, r)
            unaware = r.unaware
            account(setup, d.rates, d.table, r, s, now)
            r.unaware = unaware  # nothing has changed
            if not survives(r, s):
                r.lock, r.deaf = -1, 1
                sense(setup, due, r, now)


@lean(void(a_dcf, _i8, _i8, a_station, _i8))
def tell(d, now, what, s, receiver):
    """Note an outcome of the first frame of station s's queue."""
    outcome = d.outcomes[d.setup[0].outcomes]
    outcome.time_ns, outcome.what, outcome.station = now, what, s.index
    outcome.position, outcome.receiver, outcome.packet = s.head, receiver, s.part
    d.setup[0].outcomes += 1


@lean(void(a_dcf, _i8, _i8, a_station))
def report(d, now, what, s):
    """Tell how an attempt of station s came out, if that may change the rate of the next one."""
    dest = d.frames[s.index, s.head].dest
    if d.choices.size > 0 and dest >= 0:
        tell(d, now, what, s, dest)


@lean(void(a_setup, all_due, a_station, _i8))
def next_packet(setup, due, s, now):
    """The present packet of station s is through, one way or the other."""
    s.role, s.tries, s.got, s.ready = IDLE, 0, 0, now
    draw(s)
    plan(setup, due, s)


@lean(void(a_dcf, a_station))
def leave(d, s):
    """The first frame leaves station s's queue."""
    s.head = (s.head + 1) % d.frames.shape[1]
    s.length -= 1
    s.part = 0


@lean(void(a_dcf, a_station))
def packet_done(d, s):
    """The present packet of station s has arrived, or was given up: the next one's turn."""
    s.part += 1
    if s.part == d.frames[s.index, s.head].packets:
        leave(d, s)


@lean(void(a_dcf, a_station, _i8))
def succeed(d, s, now):
    """The packet of station s was acknowledged, or needs no acknowledgement."""
    frame = d.frames[s.index, s.head]
    s.window, s.failed = d.setup[0].cw_min, 0
    report(d, now, ACKED, s)
    if frame.dest < 0 and s.part == frame.packets - 1:
        tell(d, now, DONE, s, -1)
    packet_done(d, s)
    next_packet(d.setup[0], d.due, s, now)


@lean(void(a_dcf, a_station, _i8))
def fail(d, s, now):
    """No reply came. The window doubles up to its largest; what resets it, besides a success, is
    the station's ``reset_at``-th failure in a row, and not that a packet is given up."""
    setup = d.setup[0]
    if s.kind == DATA:
        report(d, now, FAILED, s)
    s.failures += 1
    s.tries += 1
    s.failed += 1
    s.window = min(2 * s.window + 1, setup.cw_max)
    if s.failed == setup.reset_at:
        s.failed, s.window = 0, setup.cw_min
    if s.busy == 0:
        rest(setup, s, now)
    if s.tries < setup.try_limit:
        s.role = IDLE
        draw(s)
        plan(setup, d.due, s)
        return
    s.dropped += 1
    if s.got == 0:  # else only the acknowledgements were lost
        tell(d, now, DROPPED, s, d.frames[s.index, s.head].dest)
    packet_done(d, s)
    next_packet(setup, d.due, s, now)


@lean(void(a_setup, all_due, a_station, a_station, _i8, _i8))
def answer(setup, due, r, peer, now, kind):
    """Station r will send ``kind`` to ``peer`` after a short interframe space."""
    r.peer, r.reply = peer.index, kind
    r.answer = (now + setup.sifs_ns) * KINDS + ANSWER
    schedule(due, r)


@lean(void(a_dcf, a_station, a_station, _i8))
def keep_off(d, r, s, now):
    """Station r leaves the medium to station s's exchange: for as long as its frame says, but after
    an RTS only until something else should have been heard of it (802.11-2016, 10.3.2.4)."""
    until = now + s.reserve
    if s.kind == RTS:
        setup = d.setup[0]
        reply = d.frames[s.index, s.head].cts_ns + d.rates[s.rate].payload_ns
        r.announced, r.doubt = until, now + 2 * (setup.sifs_ns + setup.slot_ns) + reply
        until = min(until, r.doubt)
    r.nav = max(r.nav, until)


@lean(void(a_dcf, a_station, a_station, _i8))
def admit(d, r, s, now):
    """Station r has got the present packet of station s."""
    answer(d.setup[0], d.due, r, s, now, ACK)
    s.got = 1


@lean(void(a_dcf, a_station, a_station, _i8))
def take(d, r, s, now):
    """Station r has received station s's frame without errors."""
    setup, due = d.setup[0], d.due
    if s.to == -1:
        tell(d, now, RECEIVED, s, r.index)
    elif s.to != r.index:
        keep_off(d, r, s, now)
    elif s.kind == DATA and setup.judged == 1:
        tell(d, now, HEARD, s, r.index)
    elif s.kind == DATA:
        if s.got == 0 and s.part == d.frames[s.index, s.head].packets - 1:
            tell(d, now, RECEIVED, s, r.index)
        admit(d, r, s, now)
    elif s.kind == RTS:
        if r.nav <= now:
            answer(setup, due, r, s, now, CTS)
    elif r.role == AWAITING and s.kind == (ACK if r.kind == DATA else CTS):
        r.contention = NEVER
        schedule(due, r)  # the timeout is off, also where nothing else is to be sent
        if s.kind == CTS:
            r.role = SENDING
            answer(setup, due, r, s, now, DATA)
        else:
            succeed(d, r, now)


@lean(void(a_dcf, a_station, _i8))
def finish(d, s, now):
    """Station s's transmission ends. Who could not make it out waits for EIFS, but no longer than
    until it makes something out. Who waits for a reply, and this was none, has failed."""
    setup, stations, due, links = d.setup[0], d.stations, d.due, d.links
    s.on, s.air = 0, NEVER
    for k in range(s.first, s.last):
        r = stations[links[k].station]
        touch(d, r)
        if r.lock >= 0:
            account(setup, d.rates, d.table, r, stations[r.lock], now)
        else:
            r.unaware = 0.0
        r.lag = max(r.lag, s.lag + links[k].delay)
        r.signals -= 1
        r.heard = r.heard - links[k].mw if r.signals > 0 else 0.0
        if r.lock == s.index:
            r.lock = -1
            if survives(r, s):
                r.eifs = 0
                take(d, r, s, now)
            else:
                r.eifs = now + setup.eifs_ns if setup.eifs_at_end == 1 else NEVER
                if s.to == -1:
                    tell(d, now, MISSED, s, r.index)
            if r.role == AWAITING:
                fail(d, r, now)
        sense(setup, due, r, now)
    if s.kind == DATA and s.to == -1:
        succeed(d, s, now)
    elif s.kind == DATA or s.kind == RTS:
        rate = d.frames[s.index, s.head].ack_rate if s.kind == DATA else s.rate
        wait = setup.sifs_ns + setup.slot_ns + d.rates[rate].payload_ns
        s.role, s.contention = AWAITING, (now + wait) * KINDS + TIMEOUT
    schedule(due, s)
    sense(setup, due, s, now)


@lean(void(a_dcf, a_station, _i8))
def expire(d, s, now):
    """The first frame of station s's queue has waited too long; the next one's turn is now."""
    tell(d, now, EXPIRED, s, -1)
    leave(d, s)
    s.ready = now
    plan(d.setup[0], d.due, s)


@lean(boolean(a_dcf, a_station, _i8))
def begins(d, s, now):
    """Whether station s has read the header of a frame that may be the reply (10.3.2.9)."""
    if s.lock < 0:
        return False
    source = d.stations[s.lock]
    return source.begun + d.rates[source.rate].payload_ns <= now


@lean(void(a_dcf, a_station, _i8, _i8))
def happen(d, s, now, what):
    """Carry out the event ``what`` that is due at station s, there and at those who hear it."""
    touch(d, s)
    if what == END:
        finish(d, s, now)
    elif what == DETECT:
        detect(d, s, now)
    elif what == HEADER:
        read_header(d, s, now)
    elif what == ANSWER:
        s.answer = NEVER
        schedule(d.due, s)
        send(d, s, now, s.reply)
    elif what == START:
        frame = d.frames[s.index, s.head]
        if now > frame.expires and s.part == 0 and s.tries == 0:
            expire(d, s, now)
        else:
            if d.choices.size > 0 and frame.dest >= 0:
                tune(d.rates, frame, d.choices[s.index, frame.dest], frame.rts_ns > 0)
            s.role, s.contention, s.direct = SENDING, NEVER, 0
            send(d, s, now, RTS if frame.rts_ns > 0 else DATA)
    else:
        s.contention = NEVER
        schedule(d.due, s)
        if not begins(d, s, now):
            fail(d, s, now)

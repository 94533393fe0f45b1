"""Turns at the medium: whose it is, how a contender goes on, and how it tries again."""

from __future__ import annotations

import numpy as np

from desim.ports.kernels import inner, types
from netmodels.radio.dcf.kernels.aggregates import lapse
from netmodels.radio.dcf.kernels.contention import draw_backoff, plan_start
from netmodels.radio.dcf.kernels.queue import dequeue, end_packet, note
from netmodels.radio.dcf.kernels.records import (
    ANSWER,
    CF_END,
    DROPPED,
    EXPIRED,
    IDLE,
    KINDS,
    NEVER,
    NEXT,
    RATE_BITS,
    SENDING,
    START,
    a_dcf,
    a_setup,
    a_station,
    aifs_ns,
    all_due,
    mark_changed,
    reset_window,
    schedule,
    set_rate,
)
from netmodels.radio.dcf.kernels.times import CONTENDED, REPEATED, keep_times, stamp

boolean, int64, void = types.boolean, types.int64, types.void

_i8 = int64


@inner(void(a_setup, all_due, a_station, a_station, _i8, _i8))
def answer(setup, due, r, peer, now_ns, kind):
    """Station r will send ``kind`` to ``peer`` after a short interframe space."""
    r.answer_to, r.reply_kind = peer.index, kind
    r.answer_due = (now_ns + setup.sifs_ns) * KINDS + ANSWER
    schedule(due, r)


@inner(void(a_setup, all_due, a_station, _i8))
def next_packet(setup, due, s, now_ns):
    """Prepare station s for its next packet: the present one has arrived, or was given up."""
    s.role, s.tries, s.delivered, s.ready_ns = IDLE, 0, 0, now_ns
    draw_backoff(s)
    plan_start(setup, due, s)


@inner(void(a_setup, a_station))
def widen(setup, s):
    """Station s has failed: the window doubles up to its largest. It is reset by a success and by
    the station's ``reset_at``-th failure in a row, but not where a packet is given up."""
    s.failed_in_a_row += 1
    s.window = min(2 * s.window + 1, s.largest)
    if s.failed_in_a_row == setup.reset_at:
        s.failed_in_a_row = 0
        reset_window(s)


@inner(void(a_dcf, a_station, _i8))
def try_again(d, s, now_ns):
    """Station s has failed: it backs off, or gives the packet up."""
    setup = d.setup[0]
    if d.packets.shape[0] > 0 or s.tries < setup.try_limit:
        s.role = IDLE
        draw_backoff(s)
        plan_start(setup, d.due, s)
        return
    s.dropped += 1
    stamp(d, s, now_ns, REPEATED)
    if s.delivered == 0:  # else only the acknowledgements were lost
        note(d, now_ns, DROPPED, s, d.frames[s.index, s.queue_head].dest)
        keep_times(d, s)
    end_packet(d, s, now_ns)
    next_packet(setup, d.due, s, now_ns)


@inner(_i8(a_dcf, a_station, _i8))
def collide_inside(d, s, now_ns):
    """The contender that gets the medium, of those with station s's radio that would begin now: the
    one of the highest category. The others act as if theirs had collided (802.11-2016, 10.22.2.4).
    """
    first, due = s.index, now_ns * KINDS + START
    if d.stations[s.radio].next < 0:
        return first
    k = np.int64(s.radio)
    while k >= 0:
        if d.stations[k].contention_due == due and d.stations[k].rank > d.stations[first].rank:
            first = k
        k = d.stations[k].next
    k = np.int64(s.radio)
    while k >= 0:
        other = d.stations[k]
        if other.contention_due == due and k != first:
            mark_changed(d.touched, other)
            other.contention_due = NEVER
            schedule(d.due, other)
            other.slots_from_ns = now_ns + aifs_ns(d.setup[0], other)
            other.no_backoff = 0
            if d.packets.shape[0] == 0:
                other.tries += 1
            widen(d.setup[0], other)
            try_again(d, other, now_ns)
        k = other.next
    return first


@inner(void(a_dcf, a_station))
def adapt(d, s):
    """Let the first frame of station s's queue go at the rate that was chosen for its receiver."""
    frame = d.frames[s.index, s.queue_head]
    if d.choices.size > 0 and frame.dest >= 0:
        set_rate(d.rates, frame, d.choices[s.radio, frame.dest] & RATE_BITS, frame.rts_ns > 0)


@inner(boolean(a_dcf, a_station, _i8))
def goes_on(d, s, now_ns):
    """Station s goes on in its TXOP: with the next packet, if there is one and time for it, else it
    gives the rest of the time back. Returns whether it sends anything more."""
    setup, kind = d.setup[0], -1
    left_ns = s.txop_ends_ns - now_ns - setup.sifs_ns
    frame = d.frames[s.index, s.queue_head]
    if s.queue_length > 0 and now_ns + setup.sifs_ns <= frame.expires_ns:
        adapt(d, s)
        data_ns = frame.last_ns if s.packet == frame.packets - 1 else frame.air_ns
        reply_ns = setup.sifs_ns + frame.ack_ns if frame.dest >= 0 else 0
        if frame.rts_ns > 0:
            reply_ns += frame.rts_ns + d.rates[frame.rate].cts_ns + 2 * setup.sifs_ns
        if data_ns + reply_ns <= left_ns:
            kind = NEXT
    if kind < 0 and d.rates[s.rate].cf_end_ns < left_ns:
        kind = CF_END
    if kind < 0:
        s.txop_ends_ns = 0
        return False
    s.role, s.tries, s.delivered = SENDING, 0, 0
    answer(setup, d.due, s, s, now_ns, kind)
    return True


@inner(void(a_dcf, a_station, _i8))
def expire(d, s, now_ns):
    """Drop what is left of the first frame of station s's queue, which has waited too long."""
    frame = d.frames[s.index, s.queue_head]
    if d.packets.shape[0] > 0 and frame.dest >= 0:
        lapse(d, s, now_ns)
        s.tries, s.ready_ns = 0, now_ns
        plan_start(d.setup[0], d.due, s)
        return
    s.packet += s.delivered  # only the acknowledgements were lost
    if s.packet < frame.packets:
        note(d, now_ns, EXPIRED, s, -1)
        if s.packet > 0:  # the others have arrived, or some of them
            stamp(d, s, now_ns, CONTENDED if s.tries == 0 else REPEATED)
            keep_times(d, s)
    dequeue(d, s, now_ns)
    s.tries, s.delivered, s.ready_ns = 0, 0, now_ns
    plan_start(d.setup[0], d.due, s)

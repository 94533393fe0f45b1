"""The packets that a station sends at once: one, or an aggregate (A-MPDU, since 802.11n).

An aggregate has the packets for one receiver that are first in the sender's queue and have not been
acknowledged, whatever frames they belong to, within the window of 64, or 256, behind the first one.
Each has errors of its own; the block acknowledgement says which have arrived. With A-MSDUs several
packets in a row go as one: they are lost and counted together, also when they are repeated. A
receiver hands frames on in the order of its sender's queue, each when it has all packets of it that
were not given up.

``Dcf.packets`` has the state of each packet of the queue: how often it was sent without success,
and flags. A frame's ``slot`` is the place of its first one there.
"""

from __future__ import annotations

from desim.ports.kernels import from_dtype, inner, types
from netmodels.radio.dcf.kernels.queue import OVER, go_on, note_packet
from netmodels.radio.dcf.kernels.reception import add_errors, forget_losses, is_intact, is_lost
from netmodels.radio.dcf.kernels.records import (
    ALONE,
    DATA,
    END,
    FRAME,
    GIVEN_UP,
    HEARD,
    KINDS,
    LAPSED,
    PART,
    RATE,
    RECEIVED,
    REQUEST,
    VOICE,
    WITH_RTS,
    a_dcf,
    a_setup,
    a_station,
    airtime_ns,
    all_rates,
    mark_changed,
    mark_packets_changed,
    schedule,
)
from netmodels.radio.dcf.kernels.times import CONTENDED, REPEATED, SENT, keep_times, stamp

boolean, int64, void = types.boolean, types.int64, types.void

_i8 = int64

# Of a packet's state, beside OVER: unsuccessful transmissions; the receiver has it; it is in the
# present aggregate; (of a frame's last packet) the frame has arrived; it is in the A-MSDU of the
# packet before it.
TRIES, GOT, FLYING, ARRIVED, JOINED = 255, 256, 1024, 2048, 4096
_SUBFRAME_BYTES = 14  # header of an MSDU in an A-MSDU (9.3.2.2.2)

REQUESTS = 200  # attempts of an exchange: 500 ms and more with windows that double


@inner(_i8(a_setup, from_dtype(RATE), _i8))
def most_bytes(setup, how, most_ns):
    """The most that an aggregate may have at this rate: by its bytes, and by its time."""
    symbols = (most_ns - how.payload_ns - how.extension_ns) // how.symbol_ns
    return min(setup.most_bytes, (symbols * how.bits_per_symbol - 22) // 8)


@inner(void(a_dcf, a_station, _i8))
def compose(d, s, now_ns):
    """Decide what station s sends now: the present packet, or an aggregate that begins with it."""
    frame = d.frames[s.index, s.queue_head]
    s.data_ns = frame.last_ns if s.packet == frame.packets - 1 else frame.air_ns
    s.reply_ns, s.carried, s.passed, s.guarded = frame.ack_ns, 0, 0, frame.rts_ns > 0
    if frame.dest >= 0 and d.packets.shape[0] > 0:
        aggregate(d, s, frame, now_ns)
    if d.choices.size > 0 and frame.dest >= 0 and d.choices[s.radio, frame.dest] & WITH_RTS:
        s.guarded = 1


@inner(_i8(_i8))
def padded(size_bytes):
    """Bytes with those that fill up four."""
    return -(-size_bytes // 4) * 4


@inner(_i8(a_setup, _i8, _i8, boolean, _i8))
def grown(setup, state, body_bytes, sealed, size_bytes):
    """The bytes of an A-MSDU that has ``body_bytes`` (0: there is none) with one more packet; 0: it
    must not have that. What has been sent together stays together, and alone (``sealed``)."""
    again = state & TRIES > 0
    if body_bytes == 0 or setup.amsdu_bytes == 0 or (again and state & JOINED == 0) or (
            sealed and not again):
        return 0
    body = padded(body_bytes) + _SUBFRAME_BYTES + size_bytes - setup.head_bytes
    return body if body <= setup.amsdu_bytes else 0


@inner(void(a_dcf, a_station, from_dtype(FRAME), _i8))
def aggregate(d, s, first, now_ns):
    """Make an aggregate of the packets for the receiver of the ``first`` frame of station s's
    queue. One that is alone goes without, and has an acknowledgement of its own."""
    setup, how, packets = d.setup[0], d.rates[first.rate], d.packets
    mark_packets_changed(d, s)
    most_ns = setup.most_ns
    if s.txop_ends_ns > 0:
        most_ns = min(most_ns, s.txop_ends_ns - now_ns - setup.sifs_ns - how.block_ack_ns)
    most, window, size_bytes, full = most_bytes(setup, how, most_ns), 0, 0, False
    begin_bytes, body_bytes, sealed, joined = 0, 0, False, False  # of the present A-MSDU
    if s.rank == VOICE or d.choices.size > 0 and d.choices[s.radio, first.dest] & ALONE:
        most = 0
    for k in range(s.queue_length):
        frame = d.frames[s.index, (s.queue_head + k) % packets.shape[1]]
        if full or frame.dest != first.dest:
            continue
        for p in range(s.packet if k == 0 else 0, frame.packets):
            place = (frame.slot + p) % packets.shape[1]
            state = packets[s.index, place]
            if state & OVER:
                window, body_bytes = window + (state & JOINED == 0), 0
                continue
            one = frame.last_bytes if p == frame.packets - 1 else frame.size_bytes
            body = grown(setup, state, body_bytes, sealed, one)
            with_it = begin_bytes + setup.head_bytes + body
            if body > 0 and with_it <= most:
                joined, state = True, state | JOINED
            else:
                begin_bytes = padded(size_bytes) + setup.delimiter_bytes
                with_it = begin_bytes + one
                if window >= setup.most_packets or (s.carried > 0 and with_it > most):
                    full = True
                    break
                sealed, state, window = state & TRIES > 0, state & ~JOINED, window + 1
                body = _SUBFRAME_BYTES + one - setup.head_bytes
                s.carried += 1
            size_bytes, body_bytes = with_it, body
            packets[s.index, place] = state | FLYING
    if s.carried == 1 and joined:
        s.data_ns = airtime_ns(how, size_bytes - setup.delimiter_bytes)
    elif s.carried > 1:
        s.data_ns, s.reply_ns = airtime_ns(how, size_bytes), how.block_ack_ns
        s.guarded = size_bytes > setup.rts_bytes


@inner(void(a_dcf, a_station, a_station, _i8, _i8))
def mark_received(d, r, s, now_ns, count):
    """Mark those in the first ``count`` packets of station s's aggregate that have come to station
    r without errors; where transmissions are judged, note them."""
    packets, judged, number = d.packets, d.setup[0].judged == 1, -1
    mark_packets_changed(d, s)
    s.delivered = s.taken = 0
    for k in range(s.queue_length):
        position = (s.queue_head + k) % packets.shape[1]
        frame = d.frames[s.index, position]
        if number >= count:
            break
        if frame.dest != r.index:
            continue
        for p in range(s.packet if k == 0 else 0, frame.packets):
            place = (frame.slot + p) % packets.shape[1]
            state = packets[s.index, place]
            if state & FLYING == 0:
                continue
            number += state & JOINED == 0
            if number < count and not is_lost(r, number):
                if judged:
                    s.delivered += 1
                    note_packet(d, now_ns, HEARD, s, r.index, position, p)
                else:
                    s.taken += state & JOINED == 0
                    packets[s.index, place] |= GOT


@inner(boolean(a_dcf, a_station, a_station, _i8))
def receive_block(d, r, s, now_ns):
    """Station r has received packets of station s's aggregate, which is over. Returns whether it
    acknowledges them now; where transmissions are judged, each is first."""
    mark_received(d, r, s, now_ns, s.carried)
    forget_losses(r)
    if d.setup[0].judged == 1:
        return False
    take_block(d, s, now_ns)
    release(d, s, r.index, now_ns)
    return True


@inner(_i8(a_setup, all_rates, a_station))
def next_part(setup, rates, s):
    """The next event of station s's frame, whose header is over: the end of a packet of its
    aggregate, where receivers hand each on then, or that of the frame."""
    if setup.apart == 0 or s.kind != DATA or s.passed + 1 >= s.carried:
        return s.ends_ns * KINDS + END
    first_ns = s.begun_ns + rates[s.rate].payload_ns
    return (first_ns + (s.passed + 1) * (s.ends_ns - first_ns) // s.carried) * KINDS + PART


@inner(void(a_dcf, a_station, _i8))
def end_part(d, s, now_ns):
    """A packet of station s's aggregate is over. If its receiver finds no error, it hands on what
    it has without a gap."""
    setup, r = d.setup[0], d.stations[s.dest]
    s.passed += 1
    s.air_due = next_part(setup, d.rates, s)
    schedule(d.due, s)
    if r.receives_from == s.index:
        mark_changed(d.touched, r)
        unaware_mw = r.unaware_mw
        add_errors(setup, d.rates, d.table, r, s, now_ns)
        r.unaware_mw = unaware_mw  # nothing has changed
        if not is_lost(r, s.passed - 1) and is_intact(r, s):
            mark_received(d, r, s, now_ns, s.passed)
            take_block(d, s, now_ns)
            release(d, s, r.index, now_ns)


@inner(void(a_dcf, a_station, _i8, _i8, _i8, _i8))
def judge_packet(d, s, now_ns, position, packet, lost):
    """A packet of station s's aggregate is ``lost`` at its receiver (0, 1), or has arrived."""
    mark_packets_changed(d, s)
    s.delivered -= 1
    if lost == 0:
        place = (d.frames[s.index, position].slot + packet) % d.packets.shape[1]
        s.taken = max(s.taken + (d.packets[s.index, place] & JOINED == 0), 1)
        d.packets[s.index, place] |= GOT
    if s.delivered == 0 and s.taken > 0:
        take_block(d, s, now_ns)


@inner(_i8(a_dcf, a_station, _i8))
def clear_packets(d, s, count):
    """Places for ``count`` packets behind the last frame of station s's queue; the first one."""
    packets, first = d.packets, 0
    mark_packets_changed(d, s)
    if s.queue_length > 0:
        last = d.frames[s.index, (s.queue_head + s.queue_length - 1) % packets.shape[1]]
        first = (last.slot + last.packets) % packets.shape[1]
    for k in range(count):
        packets[s.index, (first + k) % packets.shape[1]] = 0
    return first


@inner(void(a_dcf, a_dcf, a_station))
def copy_packets(d, future, s):
    """Copy the states of the packets of station s's queue, which is not empty."""
    limit = d.packets.shape[1]
    last = d.frames[s.index, (s.queue_head + s.queue_length - 1) % limit]
    first = (d.frames[s.index, s.queue_head].slot + s.packet) % limit
    end = (last.slot + last.packets) % limit
    if end <= first:
        end += limit
    for place in range(first, min(end, limit)):
        future.packets[s.index, place] = d.packets[s.index, place]
    for place in range(end - limit):
        future.packets[s.index, place] = d.packets[s.index, place]


@inner(void(a_dcf, a_station, _i8))
def take_block(d, s, now_ns):
    """Some of station s's packets have arrived: what that took."""
    stamp(d, s, now_ns, SENT)
    keep_times(d, s)


@inner(void(a_dcf, a_station, _i8, _i8))
def release(d, s, dest, now_ns):
    """Note the frames of station s that ``dest`` hands on now: whole ones without a gap."""
    packets = d.packets
    mark_packets_changed(d, s)
    for k in range(s.queue_length):
        position = (s.queue_head + k) % packets.shape[1]
        frame = d.frames[s.index, position]
        last = (frame.slot + frame.packets - 1) % packets.shape[1]
        if frame.dest != dest or packets[s.index, last] & ARRIVED:
            continue
        for p in range(s.packet if k == 0 else 0, frame.packets):
            if packets[s.index, (frame.slot + p) % packets.shape[1]] & (GOT | OVER) == 0:
                return
        packets[s.index, last] |= ARRIVED
        note_packet(d, now_ns, RECEIVED, s, dest, position, frame.packets - 1)


@inner(boolean(a_dcf, a_station, _i8, boolean))
def close_block(d, s, now_ns, acknowledged):
    """The exchange with the receiver of station s's first frame is over: it is done with packets of
    which it learns that they have arrived, and gives up those that were sent too often. Returns
    whether some are left in doubt."""
    packets, dest, window = d.packets, d.frames[s.index, s.queue_head].dest, 0
    doubt, gave_up = False, False
    mark_packets_changed(d, s)
    for k in range(s.queue_length):
        position = (s.queue_head + k) % packets.shape[1]
        frame = d.frames[s.index, position]
        if frame.dest != dest:
            continue
        if window > d.setup[0].most_packets:
            break
        for p in range(s.packet if k == 0 else 0, frame.packets):
            place = (frame.slot + p) % packets.shape[1]
            state = packets[s.index, place]
            window += state & JOINED == 0
            if window > d.setup[0].most_packets:
                break
            if state & GOT and acknowledged:
                state |= OVER
            elif state & FLYING:
                state += state & TRIES < TRIES
                if state & TRIES >= d.setup[0].block_limit:
                    state |= OVER
                    if state & GOT == 0:
                        s.dropped += 1
                        gave_up = True
                        note_packet(d, now_ns, GIVEN_UP, s, dest, position, p)
                else:
                    doubt = True
            packets[s.index, place] = state & ~FLYING
    if gave_up:
        stamp(d, s, now_ns, REPEATED)
        keep_times(d, s)
        release(d, s, dest, now_ns)
    go_on(d, s, now_ns)
    return doubt


@inner(void(a_dcf, a_station, _i8))
def settle_block(d, s, now_ns):
    """Station s has got a block acknowledgement, or that of a packet."""
    s.asks = 0
    close_block(d, s, now_ns, True)


@inner(void(a_dcf, a_station, _i8))
def miss_block(d, s, now_ns):
    """Station s has got no reply. It asks again until it has one, at most for about as long as
    ns-3's packets live (NeedBarRetransmission; 500 ms)."""
    if s.kind == REQUEST:
        s.asks = s.tries < REQUESTS
        return
    head, dest = s.queue_head, d.frames[s.index, s.queue_head].dest
    doubt = close_block(d, s, now_ns, False) and s.kind == DATA and s.carried > 1
    s.asks = d.setup[0].requests == 1 and doubt and d.frames[s.index, s.queue_head].dest == dest
    if s.queue_head != head:
        s.tries = 0


@inner(void(a_dcf, a_station, _i8))
def lapse(d, s, now_ns):
    """Drop what is left of the first frame of station s's queue, which has waited too long."""
    packets, frame = d.packets, d.frames[s.index, s.queue_head]
    mark_packets_changed(d, s)
    for p in range(s.packet, frame.packets):
        place = (frame.slot + p) % packets.shape[1]
        if packets[s.index, place] & (GOT | OVER) == 0:
            note_packet(d, now_ns, LAPSED, s, frame.dest, s.queue_head, p)
        packets[s.index, place] |= OVER
    s.asks = 0
    stamp(d, s, now_ns, CONTENDED if s.tries == 0 else REPEATED)
    keep_times(d, s)
    release(d, s, frame.dest, now_ns)
    go_on(d, s, now_ns)

"""The events of a transmission: its start, the ends of preamble, header and frame, and the reply.

``s`` is the station that transmits, ``r`` one that hears it. Signals arrive without delay (really
0.17 us over 50 m, a 50th of a slot); with ``unaware`` the distances decide which of two frames in
one slot comes first.
"""

from __future__ import annotations

from desim.ports.kernels import inner, types
from netmodels.radio.dcf.kernels.aggregates import (
    compose,
    lapse,
    miss_block,
    receive_block,
    release,
    settle_block,
)
from netmodels.radio.dcf.kernels.contention import (
    draw_backoff,
    plan_start,
    sense_carrier,
    start_slots,
)
from netmodels.radio.dcf.kernels.queue import dequeue, end_packet, note, note_attempt
from netmodels.radio.dcf.kernels.reception import add_errors, arrive, is_intact
from netmodels.radio.dcf.kernels.records import (
    ACK,
    ANSWER,
    AWAITING,
    CTS,
    DATA,
    DETECT,
    DONE,
    DROPPED,
    END,
    EXPIRED,
    HEADER,
    HEARD,
    IDLE,
    KINDS,
    MISSED,
    NEVER,
    RATE_BITS,
    RECEIVED,
    REQUEST,
    RTS,
    SENDING,
    START,
    TIMEOUT,
    a_dcf,
    a_setup,
    a_station,
    all_due,
    mark_changed,
    reset_window,
    schedule,
    set_rate,
)
from netmodels.radio.dcf.kernels.times import (
    CONTENDED,
    REPEATED,
    SENT,
    keep_times,
    stamp,
)

boolean, int64, void = types.boolean, types.int64, types.void

_i8 = int64


@inner(void(a_dcf, a_station, _i8))
def transmit(d, s, now_ns):
    """Station s goes on the air, and loses the frame that it was receiving."""
    setup, stations, due, links = d.setup[0], d.stations, d.due, d.links
    s.receives_from = -1
    s.on_air, s.begun_ns = 1, now_ns
    s.transmission += 1
    s.air_due = (now_ns + setup.detection_ns) * KINDS + DETECT
    schedule(due, s)
    sense_carrier(setup, due, s, now_ns)
    for k in range(s.first_link, s.last_link):
        r = stations[links[k].station]
        mark_changed(d, r)
        if r.receives_from >= 0:
            add_errors(setup, d.rates, d.table, r, stations[r.receives_from], now_ns)
        elif setup.unaware == 1:
            arrive(d, r, s, now_ns, links[k])
        r.heard_mw += links[k].power_mw
        r.signals += 1


@inner(void(a_dcf, a_station, _i8, _i8))
def send(d, s, now_ns, kind):
    """Station s transmits a frame of the exchange that it or its peer began."""
    setup = d.setup[0]
    owner = d.stations[s.answer_to] if kind in (CTS, ACK) else s
    frame = d.frames[owner.index, owner.queue_head]
    if owner.index == s.index:
        stamp(d, s, now_ns, CONTENDED if s.tries == 0 else REPEATED)
    after_ns = setup.sifs_ns + owner.reply_ns
    s.kind, s.rate, s.reserve_ns = kind, frame.rts_rate, 0
    s.dest = s.answer_to if kind in (CTS, ACK) else frame.dest
    how = d.rates[frame.rate]
    if kind == RTS:
        airtime_ns = how.rts_ns
        s.reserve_ns = 2 * setup.sifs_ns + how.cts_ns + owner.data_ns + after_ns
    elif kind == CTS:
        airtime_ns, s.reserve_ns = how.cts_ns, setup.sifs_ns + owner.data_ns + after_ns
    elif kind == DATA:
        airtime_ns, s.rate = s.data_ns, frame.rate
        s.transmitted += 1
        if frame.dest >= 0:
            s.reserve_ns = after_ns
    elif kind == REQUEST:
        airtime_ns, s.rate, s.reserve_ns = how.request_ns, frame.ack_rate, after_ns
        s.transmitted += 1
    else:
        airtime_ns, s.rate = owner.reply_ns, frame.ack_rate
    s.ends_ns = now_ns + airtime_ns
    s.sent_ns += airtime_ns
    transmit(d, s, now_ns)


@inner(void(a_dcf, a_station, _i8))
def detect(d, s, now_ns):
    """The beginning of station s's preamble is over. Stations that hear it well enough, and were
    not sending when it came, receive the frame; only now do they know that the medium is busy."""
    setup, stations, due, links = d.setup[0], d.stations, d.due, d.links
    header_ends_ns = s.begun_ns + d.rates[s.rate].payload_ns
    s.air_due = header_ends_ns * KINDS + HEADER if setup.gives_up == 1 else s.ends_ns * KINDS + END
    schedule(due, s)
    for k in range(s.first_link, s.last_link):
        r, power_mw = stations[links[k].station], links[k].power_mw
        if power_mw < setup.signal_mw and r.heard_mw < setup.energy_mw:
            continue  # to it this is noise
        mark_changed(d, r)
        r.ignores_energy = 0
        others_mw = setup.noise_mw + max(r.heard_mw - power_mw, 0.0)
        found = power_mw >= setup.signal_mw and power_mw >= setup.capture_ratio * others_mw
        if found and r.receives_from < 0 and r.ends_ns <= s.begun_ns:
            r.receives_from, r.power_mw = s.index, power_mw
            r.log_chance, r.lost, r.accounted_ns = 0.0, 0, now_ns
            if now_ns + d.rates[s.rate].payload_ns - setup.detection_ns <= r.nav_timeout_ns:
                r.nav_ns = max(r.nav_ns, r.announced_nav_ns)
            if r.strongest != s.index:
                r.unaware_mw = 0.0
        sense_carrier(setup, due, r, now_ns)


@inner(void(a_dcf, a_station, _i8))
def read_header(d, s, now_ns):
    """The header of station s's frame is over. If it has errors, a receiver of ns-3 gives up the
    frame, and takes the medium for idle until a new signal comes."""
    setup, stations, due, links = d.setup[0], d.stations, d.due, d.links
    s.air_due = s.ends_ns * KINDS + END
    schedule(due, s)
    for k in range(s.first_link, s.last_link):
        r = stations[links[k].station]
        if r.receives_from == s.index:
            mark_changed(d, r)
            unaware_mw = r.unaware_mw
            add_errors(setup, d.rates, d.table, r, s, now_ns)
            r.unaware_mw = unaware_mw  # nothing has changed
            if not is_intact(r, s):
                r.receives_from, r.ignores_energy = -1, 1
                sense_carrier(setup, due, r, now_ns)


@inner(void(a_setup, all_due, a_station, _i8))
def next_packet(setup, due, s, now_ns):
    """Prepare station s for its next packet: the present one has arrived, or was given up."""
    s.role, s.tries, s.delivered, s.ready_ns = IDLE, 0, 0, now_ns
    draw_backoff(s)
    plan_start(setup, due, s)


@inner(void(a_dcf, a_station, _i8))
def succeed(d, s, now_ns):
    """The packet of station s was acknowledged, or needs no acknowledgement."""
    frame = d.frames[s.index, s.queue_head]
    s.failed_in_a_row = 0
    reset_window(s)
    if s.kind == DATA:
        note_attempt(d, now_ns, s, s.taken if s.carried > 0 else 1)
    if frame.dest < 0:
        stamp(d, s, now_ns, SENT)
        if s.packet == frame.packets - 1:
            note(d, now_ns, DONE, s, -1)
            keep_times(d, s)
    if frame.dest >= 0 and d.packets.shape[0] > 0:
        settle_block(d, s, now_ns)
    else:
        end_packet(d, s, now_ns)
    next_packet(d.setup[0], d.due, s, now_ns)


@inner(void(a_dcf, a_station, _i8))
def fail(d, s, now_ns):
    """Station s got no reply. The window doubles up to its largest. It is reset by a success and by
    the station's ``reset_at``-th failure in a row, but not where a packet is given up."""
    setup = d.setup[0]
    if s.kind == DATA:
        note_attempt(d, now_ns, s, 0)
    s.failures += 1
    s.tries += 1
    s.failed_in_a_row += 1
    s.window = min(2 * s.window + 1, s.largest)
    if s.failed_in_a_row == setup.reset_at:
        s.failed_in_a_row = 0
        reset_window(s)
    if s.busy == 0:
        start_slots(setup, s, now_ns)
    blocks = d.packets.shape[0] > 0
    if blocks:
        miss_block(d, s, now_ns)
    if blocks or s.tries < setup.try_limit:
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


@inner(void(a_setup, all_due, a_station, a_station, _i8, _i8))
def answer(setup, due, r, peer, now_ns, kind):
    """Station r will send ``kind`` to ``peer`` after a short interframe space."""
    r.answer_to, r.reply_kind = peer.index, kind
    r.answer_due = (now_ns + setup.sifs_ns) * KINDS + ANSWER
    schedule(due, r)


@inner(void(a_dcf, a_station, a_station, _i8))
def set_nav(d, r, s, now_ns):
    """Station r sets its NAV as station s's frame says; after an RTS it is reset if the exchange
    does not go on (802.11-2016, 10.3.2.4)."""
    until_ns = now_ns + s.reserve_ns
    if s.kind == RTS:
        setup = d.setup[0]
        cts_ns = d.rates[d.frames[s.index, s.queue_head].rate].cts_ns
        reply_ns = cts_ns + d.rates[s.rate].payload_ns
        r.announced_nav_ns = until_ns
        r.nav_timeout_ns = now_ns + 2 * (setup.sifs_ns + setup.slot_ns) + reply_ns
        until_ns = min(until_ns, r.nav_timeout_ns)
    r.nav_ns = max(r.nav_ns, until_ns)


@inner(void(a_dcf, a_station, a_station, _i8))
def acknowledge(d, r, s, now_ns):
    """Station r has received the present packet of station s, and will acknowledge it."""
    answer(d.setup[0], d.due, r, s, now_ns, ACK)
    stamp(d, s, now_ns, SENT if s.delivered == 0 else REPEATED)
    if s.delivered == 0:
        keep_times(d, s)
    s.delivered = 1


@inner(void(a_dcf, a_station, a_station, _i8))
def receive(d, r, s, now_ns):
    """Station r has received station s's frame without errors."""
    setup, due = d.setup[0], d.due
    if s.dest == -1:
        note(d, now_ns, RECEIVED, s, r.index)
    elif s.dest != r.index:
        set_nav(d, r, s, now_ns)
    elif s.kind == DATA and s.carried > 0:
        if receive_block(d, r, s, now_ns):
            answer(setup, due, r, s, now_ns, ACK)
    elif s.kind == DATA and setup.judged == 1:
        note(d, now_ns, HEARD, s, r.index)
    elif s.kind == DATA:
        if s.delivered == 0 and s.packet == d.frames[s.index, s.queue_head].packets - 1:
            note(d, now_ns, RECEIVED, s, r.index)
        acknowledge(d, r, s, now_ns)
    elif s.kind == RTS:
        if r.nav_ns <= now_ns:
            answer(setup, due, r, s, now_ns, CTS)
    elif s.kind == REQUEST:
        answer(setup, due, r, s, now_ns, ACK)
    elif r.role == AWAITING and s.kind == (CTS if r.kind == RTS else ACK):
        r.contention_due = NEVER
        schedule(due, r)  # the timeout is off, also where the queue is empty
        if s.kind == CTS:
            r.role = SENDING
            answer(setup, due, r, s, now_ns, DATA)
        else:
            succeed(d, r, now_ns)


@inner(void(a_dcf, a_station, _i8))
def end_transmission(d, s, now_ns):
    """Station s's transmission ends. A receiver that finds errors waits for EIFS, or until it
    decodes another frame. A station that awaits a reply has failed if this was none."""
    setup, stations, due, links = d.setup[0], d.stations, d.due, d.links
    s.on_air, s.air_due = 0, NEVER
    for k in range(s.first_link, s.last_link):
        r = stations[links[k].station]
        mark_changed(d, r)
        if r.receives_from >= 0:
            add_errors(setup, d.rates, d.table, r, stations[r.receives_from], now_ns)
        else:
            r.unaware_mw = 0.0
        r.lag_ns = max(r.lag_ns, s.lag_ns + links[k].delay_ns)
        r.signals -= 1
        r.heard_mw = r.heard_mw - links[k].power_mw if r.signals > 0 else 0.0
        if r.receives_from == s.index:
            r.receives_from = -1
            if is_intact(r, s):
                r.eifs_ends_ns = 0
                receive(d, r, s, now_ns)
            else:
                r.eifs_ends_ns = now_ns + setup.eifs_ns if setup.eifs_at_end == 1 else NEVER
                if s.dest == -1:
                    note(d, now_ns, MISSED, s, r.index)
            if r.role == AWAITING:
                fail(d, r, now_ns)
        sense_carrier(setup, due, r, now_ns)
    if s.kind == DATA and s.dest == -1:
        succeed(d, s, now_ns)
    elif s.kind == DATA or s.kind == RTS or s.kind == REQUEST:
        rate = s.rate if s.kind == RTS else d.frames[s.index, s.queue_head].ack_rate
        wait_ns = setup.sifs_ns + setup.slot_ns + d.rates[rate].payload_ns
        s.role, s.contention_due = AWAITING, (now_ns + wait_ns) * KINDS + TIMEOUT
    schedule(due, s)
    sense_carrier(setup, due, s, now_ns)


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


@inner(boolean(a_dcf, a_station, _i8))
def reply_has_begun(d, s, now_ns):
    """Whether station s has received the header of a frame that may be the reply (802.11-2016,
    10.3.2.9)."""
    if s.receives_from < 0:
        return False
    source = d.stations[s.receives_from]
    return source.begun_ns + d.rates[source.rate].payload_ns <= now_ns


@inner(void(a_dcf, a_station, _i8, _i8))
def carry_out(d, s, now_ns, what):
    """Carry out the event ``what`` of station s, there and at the stations that hear it."""
    mark_changed(d, s)
    if what == END:
        end_transmission(d, s, now_ns)
    elif what == DETECT:
        detect(d, s, now_ns)
    elif what == HEADER:
        read_header(d, s, now_ns)
    elif what == ANSWER:
        s.answer_due = NEVER
        schedule(d.due, s)
        if s.reply_kind == ACK and d.setup[0].judged == 1 and d.packets.shape[0] > 0:
            release(d, d.stations[s.answer_to], s.index, now_ns)
        send(d, s, now_ns, s.reply_kind)
    elif what == START:
        frame = d.frames[s.index, s.queue_head]
        if now_ns > frame.expires_ns and (s.packet == 0 or frame.dest >= 0):
            expire(d, s, now_ns)
        else:
            if d.choices.size > 0 and frame.dest >= 0:
                rate = d.choices[s.index, frame.dest] & RATE_BITS
                set_rate(d.rates, frame, rate, frame.rts_ns > 0)
            s.role, s.contention_due, s.no_backoff = SENDING, NEVER, 0
            if s.asks == 1:
                s.reply_ns = d.rates[frame.rate].block_ack_ns
                send(d, s, now_ns, REQUEST)
            else:
                compose(d, s)
                send(d, s, now_ns, RTS if s.guarded == 1 else DATA)
    else:
        s.contention_due = NEVER
        schedule(d.due, s)
        if not reply_has_begun(d, s, now_ns):
            fail(d, s, now_ns)

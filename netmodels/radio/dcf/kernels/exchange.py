"""The events of a transmission: its start, the ends of preamble, header and frame, and the reply.

``s`` is the station that transmits, ``r`` one that hears it. Signals arrive without delay (really
0.17 us over 50 m, a 50th of a slot); with ``unaware`` the distances decide which of two frames in
one slot comes first.
"""

from __future__ import annotations

from desim.ports.kernels import inner, types
from netmodels.radio.dcf.kernels.aggregates import (
    compose,
    end_part,
    miss_block,
    next_part,
    receive_block,
    release,
    settle_block,
)
from netmodels.radio.dcf.kernels.contention import sense_carrier, start_slots
from netmodels.radio.dcf.kernels.queue import end_packet, note, note_attempt
from netmodels.radio.dcf.kernels.reception import add_errors, arrive, forget_losses, is_intact
from netmodels.radio.dcf.kernels.records import (
    ACK,
    ANSWER,
    AWAITING,
    CF_END,
    CTS,
    DATA,
    DETECT,
    DONE,
    END,
    HEADER,
    HEARD,
    KINDS,
    MISSED,
    NEVER,
    NEXT,
    OTHER,
    PART,
    RECEIVED,
    REQUEST,
    RTS,
    SENDING,
    START,
    TIMEOUT,
    VOICE,
    a_dcf,
    a_station,
    mark_changed,
    reset_window,
    schedule,
)
from netmodels.radio.dcf.kernels.times import CONTENDED, REPEATED, SENT, keep_times, stamp
from netmodels.radio.dcf.kernels.turns import (
    adapt,
    answer,
    collide_inside,
    expire,
    goes_on,
    next_packet,
    try_again,
    widen,
)

boolean, int64, void = types.boolean, types.int64, types.void

_i8 = int64


@inner(void(a_dcf, a_station, _i8))
def transmit(d, s, now_ns):
    """Station s goes on the air, and loses the frame that it was receiving."""
    setup, stations, due, links = d.setup[0], d.stations, d.due, d.links
    radio = stations[s.radio]
    s.on_air, s.begun_ns = 1, now_ns
    radio.receives_from = -1
    radio.sent_ns += s.ends_ns - now_ns
    if radio.index != s.index:
        mark_changed(d.touched, radio)
        radio.on_air, radio.ends_ns = OTHER, s.ends_ns
    s.transmission += 1
    s.air_due = (now_ns + setup.detection_ns) * KINDS + DETECT
    schedule(due, s)
    sense_carrier(setup, due, stations, d.touched, radio, now_ns)
    for k in range(s.first_link, s.last_link):
        r = stations[links[k].station]
        mark_changed(d.touched, r)
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
    after_ns, how = setup.sifs_ns + owner.reply_ns, d.rates[frame.rate]
    s.kind, s.reserve_ns = kind, 0
    s.dest = s.answer_to if kind in (CTS, ACK) else frame.dest
    if kind != CF_END:
        s.rate = frame.rts_rate
    if kind == CF_END:
        s.rate, s.dest = d.rates[s.rate].header_rate, -1
        airtime_ns = d.rates[s.rate].cf_end_ns
    elif kind == RTS:
        airtime_ns = how.rts_ns
        s.reserve_ns = 2 * setup.sifs_ns + how.cts_ns + owner.data_ns + after_ns
    elif kind == CTS:
        airtime_ns, s.reserve_ns = how.cts_ns, setup.sifs_ns + owner.data_ns + after_ns
    elif kind == DATA:
        airtime_ns, s.rate = s.data_ns, frame.rate
        s.transmitted += s.rank <= VOICE  # beacons are no data
        if frame.dest >= 0:
            s.reserve_ns = after_ns
    elif kind == REQUEST:
        airtime_ns, s.rate, s.reserve_ns = how.request_ns, frame.ack_rate, after_ns
        s.transmitted += 1
    else:
        airtime_ns, s.rate = owner.reply_ns, frame.ack_rate
    s.ends_ns = now_ns + airtime_ns
    if owner.txop_ends_ns > 0 and kind != CF_END:
        s.reserve_ns = max(s.reserve_ns, owner.txop_ends_ns - s.ends_ns)
    transmit(d, s, now_ns)


@inner(void(a_dcf, a_station, _i8))
def detect(d, s, now_ns):
    """The beginning of station s's preamble is over. Stations that hear it well enough, and were
    not sending when it came, receive the frame; only now do they know that the medium is busy."""
    setup, stations, due, links = d.setup[0], d.stations, d.due, d.links
    header_due = (s.begun_ns + d.rates[s.rate].payload_ns) * KINDS + HEADER
    s.air_due = header_due if setup.gives_up == 1 else next_part(setup, d.rates, s)
    schedule(due, s)
    for k in range(s.first_link, s.last_link):
        r, power_mw = stations[links[k].station], links[k].power_mw
        if power_mw < setup.signal_mw and r.heard_mw < setup.energy_mw:
            continue  # to it this is noise
        mark_changed(d.touched, r)
        r.ignores_energy = 0
        others_mw = setup.noise_mw + max(r.heard_mw - power_mw, 0.0)
        found = power_mw >= setup.signal_mw and power_mw >= setup.capture_ratio * others_mw
        if found and r.receives_from < 0 and r.ends_ns <= s.begun_ns:
            r.receives_from, r.power_mw = s.index, power_mw
            r.log_chance, r.accounted_ns = forget_losses(r), now_ns
            if now_ns + d.rates[s.rate].payload_ns - setup.detection_ns <= r.nav_timeout_ns:
                r.nav_ns = max(r.nav_ns, r.announced_nav_ns)
            if r.strongest != s.index:
                r.unaware_mw = 0.0
        sense_carrier(setup, due, stations, d.touched, r, now_ns)


@inner(void(a_dcf, a_station, _i8))
def read_header(d, s, now_ns):
    """The header of station s's frame is over. If it has errors, a receiver of ns-3 gives up the
    frame, and takes the medium for idle until a new signal comes."""
    setup, stations, due, links = d.setup[0], d.stations, d.due, d.links
    s.air_due = next_part(setup, d.rates, s)
    schedule(due, s)
    for k in range(s.first_link, s.last_link):
        r = stations[links[k].station]
        if r.receives_from == s.index:
            mark_changed(d.touched, r)
            unaware_mw = r.unaware_mw
            add_errors(setup, d.rates, d.table, r, s, now_ns)
            r.unaware_mw = unaware_mw  # nothing has changed
            if not is_intact(r, s):
                r.receives_from, r.ignores_energy = -1, 1
                sense_carrier(setup, due, stations, d.touched, r, now_ns)


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
    if s.txop_ns == 0 or not goes_on(d, s, now_ns):
        next_packet(d.setup[0], d.due, s, now_ns)


@inner(void(a_dcf, a_station, _i8))
def fail(d, s, now_ns):
    """Station s got no reply."""
    if s.kind == DATA:
        note_attempt(d, now_ns, s, 0)
    s.failures += 1
    s.tries += 1
    s.txop_ends_ns = 0
    widen(d.setup[0], s)
    if s.busy == 0:
        start_slots(d.setup[0], d.stations, d.stations[s.radio], s, now_ns)
    if d.packets.shape[0] > 0:
        miss_block(d, s, now_ns)
    try_again(d, s, now_ns)


@inner(void(a_dcf, a_station, a_station, _i8))
def take_reply(d, r, s, now_ns):
    """Contender r gets the reply of station s, if it awaits that."""
    mark_changed(d.touched, r)
    if r.role == AWAITING and s.kind == (CTS if r.kind == RTS else ACK):
        r.contention_due = NEVER
        schedule(d.due, r)  # the timeout is off, also where the queue is empty
        if s.kind == CTS:
            r.role = SENDING
            answer(d.setup[0], d.due, r, s, now_ns, DATA)
        else:
            succeed(d, r, now_ns)


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
    if s.kind == CF_END:
        r.nav_ns = now_ns
    elif s.dest == -1:
        note(d, now_ns, RECEIVED, s, r.index)
    elif s.dest != r.index and d.stations[s.dest].radio != r.index:
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
    else:
        take_reply(d, d.stations[s.dest], s, now_ns)


@inner(void(a_dcf, a_station, _i8))
def end_transmission(d, s, now_ns):
    """Station s's transmission ends. A receiver that finds errors waits for EIFS, or until it
    decodes another frame. A station that awaits a reply has failed if this was none."""
    setup, stations, due, links = d.setup[0], d.stations, d.due, d.links
    radio = stations[s.radio]
    s.on_air, radio.on_air, s.air_due = 0, 0, NEVER
    mark_changed(d.touched, radio)
    for k in range(s.first_link, s.last_link):
        r = stations[links[k].station]
        mark_changed(d.touched, r)
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
                if s.dest == -1 and s.kind != CF_END:
                    note(d, now_ns, MISSED, s, r.index)
            holder = stations[r.holder]
            if holder.role == AWAITING:
                mark_changed(d.touched, holder)
                fail(d, holder, now_ns)
        sense_carrier(setup, due, stations, d.touched, r, now_ns)
    if s.kind == DATA and s.dest == -1:
        succeed(d, s, now_ns)
    elif s.kind == DATA or s.kind == RTS or s.kind == REQUEST:
        rate = s.rate if s.kind == RTS else d.frames[s.index, s.queue_head].ack_rate
        wait_ns = setup.sifs_ns + setup.slot_ns + d.rates[rate].payload_ns
        s.role, s.contention_due = AWAITING, (now_ns + wait_ns) * KINDS + TIMEOUT
    elif s.kind == CF_END:
        s.txop_ends_ns = 0
        next_packet(setup, due, s, now_ns)
    schedule(due, s)
    if radio.heard_mw < setup.idle_mw:
        radio.ignores_energy = 1
    sense_carrier(setup, due, stations, d.touched, radio, now_ns)


@inner(void(a_dcf, a_station, _i8))
def begin(d, s, now_ns):
    """Station s begins an exchange, which has the medium."""
    frame = d.frames[s.index, s.queue_head]
    adapt(d, s)
    s.role, s.contention_due, s.no_backoff = SENDING, NEVER, 0
    if s.asks == 1:
        s.reply_ns = d.rates[frame.rate].block_ack_ns
        send(d, s, now_ns, REQUEST)
    else:
        compose(d, s, now_ns)
        send(d, s, now_ns, RTS if s.guarded == 1 else DATA)


@inner(void(a_dcf, a_station, _i8))
def start(d, s, now_ns):
    """Station s has the medium, for an exchange or a TXOP."""
    mark_changed(d.touched, s)
    frame = d.frames[s.index, s.queue_head]
    if now_ns > frame.expires_ns and (s.packet == 0 or frame.dest >= 0):
        expire(d, s, now_ns)
        return
    if s.txop_ns > 0:
        s.txop_ends_ns = now_ns + s.txop_ns
    d.stations[s.radio].holder = s.index
    begin(d, s, now_ns)


@inner(boolean(a_dcf, a_station, _i8))
def reply_has_begun(d, s, now_ns):
    """Whether station s has received the header of a frame that may be the reply (802.11-2016,
    10.3.2.9)."""
    radio = d.stations[s.radio]
    if radio.receives_from < 0:
        return False
    source = d.stations[radio.receives_from]
    return source.begun_ns + d.rates[source.rate].payload_ns <= now_ns


@inner(void(a_dcf, a_station, _i8, _i8))
def carry_out(d, s, now_ns, what):
    """Carry out the event ``what`` of station s, there and at the stations that hear it."""
    mark_changed(d.touched, s)
    if what == END:
        end_transmission(d, s, now_ns)
    elif what == DETECT:
        detect(d, s, now_ns)
    elif what == HEADER:
        read_header(d, s, now_ns)
    elif what == PART:
        end_part(d, s, now_ns)
    elif what == ANSWER:
        s.answer_due = NEVER
        schedule(d.due, s)
        if s.reply_kind == ACK and d.setup[0].judged == 1 and d.packets.shape[0] > 0:
            release(d, d.stations[s.answer_to], s.index, now_ns)
        if s.reply_kind == NEXT:
            begin(d, s, now_ns)
        else:
            send(d, s, now_ns, s.reply_kind)
    elif what == START:
        start(d, d.stations[collide_inside(d, s, now_ns)], now_ns)
    else:
        s.contention_due = NEVER
        schedule(d.due, s)
        if not reply_has_begun(d, s, now_ns):
            fail(d, s, now_ns)

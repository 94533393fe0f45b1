"""The queue of a station: its outcomes, and how it goes on."""

from __future__ import annotations

from desim.ports.kernels import inner, types
from netmodels.radio.dcf.kernels.records import TRIED, a_dcf, a_station
from netmodels.radio.dcf.kernels.times import begin_frame

int64, void = types.int64, types.void

_i8 = int64

OVER = 512  # of a packet's state (``aggregates.py``): the sender is done with it


@inner(void(a_dcf, _i8, _i8, a_station, _i8, _i8, _i8))
def note_packet(d, now_ns, what, s, receiver, position, packet):
    """Note an outcome of a packet of the frame at ``position`` in station s's queue."""
    outcome = d.outcomes[d.setup[0].outcomes]
    outcome.time_ns, outcome.what, outcome.station = now_ns, what, s.index
    outcome.position, outcome.receiver, outcome.packet = position, receiver, packet
    d.setup[0].outcomes += 1


@inner(void(a_dcf, _i8, _i8, a_station, _i8))
def note(d, now_ns, what, s, receiver):
    """Note an outcome of the present packet of station s."""
    note_packet(d, now_ns, what, s, receiver, s.queue_head, s.packet)


@inner(void(a_dcf, _i8, a_station, _i8))
def note_attempt(d, now_ns, s, acknowledged):
    """Note how many packets of an attempt of station s were acknowledged, if rates adapt."""
    dest = d.frames[s.index, s.queue_head].dest
    if d.choices.size > 0 and dest >= 0:
        note_packet(d, now_ns, TRIED, s, dest, max(s.carried, 1), acknowledged)


@inner(void(a_dcf, a_station, _i8))
def next_frame(d, s, now_ns):
    """Take the first frame out of station s's queue."""
    s.queue_head = (s.queue_head + 1) % d.frames.shape[1]
    s.queue_length -= 1
    s.packet = 0
    begin_frame(d, s, now_ns)


@inner(void(a_dcf, a_station, _i8))
def go_on(d, s, now_ns):
    """Take the packets out of station s's queue that it is done with, from the first on."""
    packets = d.packets
    while packets.shape[0] > 0 and s.queue_length > 0:
        frame = d.frames[s.index, s.queue_head]
        while s.packet < frame.packets and (
                packets[s.index, (frame.slot + s.packet) % packets.shape[1]] & OVER):
            s.packet += 1
        if s.packet < frame.packets:
            return
        next_frame(d, s, now_ns)


@inner(void(a_dcf, a_station, _i8))
def dequeue(d, s, now_ns):
    """Take the first frame out of station s's queue, and all behind it that have arrived."""
    next_frame(d, s, now_ns)
    go_on(d, s, now_ns)


@inner(void(a_dcf, a_station, _i8))
def end_packet(d, s, now_ns):
    """Go on to the next packet of station s's queue."""
    s.packet += 1
    if s.packet == d.frames[s.index, s.queue_head].packets:
        dequeue(d, s, now_ns)

"""Packets and frames at the exits of a switch.
"""

from __future__ import annotations

from desim.ports.kernels import inner, types
from netmodels.switch.kernels.interface import is_alone, packet_ns
from netmodels.switch.kernels.records import (
    A_PORT,
    ALL_SENT,
    AN_EXIT,
    I8,
    QUANTUM_BYTES,
    WIRES,
    append,
)


@inner(types.void(WIRES, I8, I8, I8))
def note(wires, f, packet, time_ns):
    """Leave a note; the callers have seen to it that there is room."""
    switch, notes = wires.switch[0], wires.notes
    notes[switch.noted, 0], notes[switch.noted, 1] = f, packet
    notes[switch.noted, 2] = time_ns
    switch.noted += 1


@inner(types.void(WIRES, I8, I8))
def cross(wires, f, at_ns):
    """A packet of frame f is in the switch, and joins the queue of each of its exits."""
    frames, switch = wires.frames, wires.switch[0]
    number, wire_ns = frames[f].begun - 1, packet_ns(frames[f])
    while f >= 0:
        frame = frames[f]
        exit_ = wires.exits[frame.exit]
        wait_ns = exit_.free_ns - at_ns
        if wait_ns > 0 and wait_ns + wire_ns > switch.limit_ns:
            note(wires, f, number, at_ns)
        else:
            frame.out_ns = max(at_ns, exit_.free_ns) + wire_ns
            exit_.free_ns = frame.out_ns
            exit_.booked_ns += wire_ns
            exit_.last_ns = at_ns
        f = frame.copy


@inner(types.void(WIRES, A_PORT, I8))
def leave(wires, line, f):
    """All packets of frame f have left its interface."""
    line.queued -= 1
    line.inside -= 1
    while f >= 0:
        frame = wires.frames[f]
        wires.exits[frame.exit].coming -= 1
        note(wires, f, ALL_SENT, frame.out_ns + wires.switch[0].hop_ns)
        f = frame.copy


@inner(types.boolean(WIRES, A_PORT, I8))
def skip(wires, line, now_ns):
    """Let the packets of a train cross at once until the last that ends by now is being sent.
    Returns False if that is so, if other frames are in its way, or if some may be lost. (A train of
    110 packets crosses in 0.1 us; one by one they take 1 us.)"""
    frame, switch = wires.frames[line.sending], wires.switch[0]
    exit_, left_ns = wires.exits[frame.exit], now_ns - line.end_ns
    if exit_.coming > 1 or frame.copy >= 0 or not is_alone(line, wires.flows):
        return False
    still = max(frame.longer - frame.begun, 0)
    long = min(still, left_ns // frame.long_ns)
    short = 0
    if long == still:
        short = min(frame.packets - frame.begun - long,
                    (left_ns - long * frame.long_ns) // frame.short_ns)
    at_ns, wire_ns = line.end_ns + switch.hop_ns, packet_ns(frame)
    out_ns = max(at_ns, exit_.free_ns)
    # No packet waits longer than the first: none is longer.
    if long + short == 0 or out_ns - at_ns + wire_ns > switch.limit_ns:
        return False
    flow = wires.flows[frame.flow]
    if switch.fair:
        for k in range(frame.begun, frame.begun + long + short):
            while flow.deficit <= 0:
                flow.deficit += QUANTUM_BYTES
                if line.new.first >= 0:
                    line.new.first = -1
                    append(line.old, wires.flows, frame.flow)
            flow.deficit -= frame.long_bytes if k < frame.longer else frame.short_bytes
    frame.begun += long + short
    if frame.begun == frame.packets:
        flow.frames.first = frame.next
    sent_ns = long * frame.long_ns + short * frame.short_ns
    line.end_ns += sent_ns
    sent_ns -= packet_ns(frame)
    exit_.free_ns = out_ns + wire_ns + sent_ns
    exit_.booked_ns += wire_ns + sent_ns
    exit_.last_ns = at_ns + sent_ns
    return True


@inner(I8(WIRES, AN_EXIT, I8, I8, I8))
def foresee(wires, exit_, begin_ns, total_ns, first_ns):
    """Shortcut: the arrival of a frame that will be in the switch within ``ahead_ns``, as if it
    joined its exit's queue now, behind all frames foreseen before. -1 while a frame for that exit
    is at an interface, or if the exit may not have room."""
    switch = wires.switch[0]
    if exit_.coming > 0:
        return -1
    at_ns = begin_ns + first_ns + switch.hop_ns
    wait_ns = exit_.free_ns - at_ns
    if wait_ns > 0 and wait_ns + first_ns > switch.limit_ns:
        return -1
    exit_.free_ns = max(at_ns, exit_.free_ns) + total_ns
    exit_.booked_ns += total_ns
    exit_.last_ns = max(exit_.last_ns, at_ns + total_ns - first_ns)
    return exit_.free_ns + switch.hop_ns

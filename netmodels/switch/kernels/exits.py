"""Packets and frames at the exits of a switch.

An exit has spans of time in which it sends. A packet may be booked before it has come
(``foresee``); another one that comes earlier goes in front of it where half of it fits.
"""

from __future__ import annotations

from desim.ports.kernels import inner, types
from netmodels.switch.kernels.interface import is_alone, packet_ns
from netmodels.switch.kernels.records import (
    A_PORT,
    ALL_SENT,
    I8,
    MOST_SPANS,
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
def _forget(wires, exit_, now_ns):
    """Drop the spans of an exit that are over, so that there is room for one more."""
    count, spans = wires.exits[exit_].spans, wires.spans[exit_]
    gone = 0
    while gone < count and spans[2 * gone + 1] <= now_ns:
        gone += 1
    if count - gone == MOST_SPANS:  # as if the exit were busy between the first two
        spans[2] = spans[0]
        gone = 1
    if gone > 0:
        for k in range(2 * (count - gone)):
            spans[k] = spans[k + 2 * gone]
        wires.exits[exit_].spans = count - gone


@inner(types.UniTuple(I8, 2)(WIRES, I8, I8, I8, I8))
def place(wires, exit_, at_ns, total_ns, now_ns):
    """The time at which an exit will begin to send, for ``total_ns``, what comes at ``at_ns``; and
    the number of the span behind that."""
    _forget(wires, exit_, now_ns)
    spans, begin_ns, k = wires.spans[exit_], at_ns, 0
    # What comes first is sent first. Of none, half, and all of a packet that has to fit, half gives
    # the best mean delay (docs/network-models.md).
    while k < wires.exits[exit_].spans and begin_ns + total_ns // 2 > spans[2 * k]:
        begin_ns = max(begin_ns, spans[2 * k + 1])
        k += 1
    return begin_ns, k


@inner(types.void(WIRES, I8, I8, I8, I8))
def book(wires, exit_, k, begin_ns, total_ns):
    """Have an exit send for ``total_ns`` from ``begin_ns`` on, in front of its span ``k``, which
    becomes longer by what overlaps."""
    spans, count = wires.spans[exit_], wires.exits[exit_].spans
    if k > 0 and spans[2 * k - 1] == begin_ns:
        k -= 1
    else:
        for j in range(2 * count - 1, 2 * k - 1, -1):
            spans[j + 2] = spans[j]
        spans[2 * k] = begin_ns
        count += 1
    spans[2 * k + 1] = begin_ns + total_ns
    while k + 1 < count and spans[2 * k + 1] >= spans[2 * k + 2]:
        spans[2 * k + 1] += spans[2 * k + 3] - spans[2 * k + 2]
        for j in range(2 * k + 2, 2 * count - 2):
            spans[j] = spans[j + 2]
        count -= 1
    wires.exits[exit_].spans = count
    wires.exits[exit_].booked_ns += total_ns


@inner(types.void(WIRES, I8, I8))
def cross(wires, f, at_ns):
    """A packet of frame f is in the switch, and joins the queue of each of its exits."""
    frames, switch = wires.frames, wires.switch[0]
    number, wire_ns = frames[f].begun - 1, packet_ns(frames[f])
    while f >= 0:
        frame = frames[f]
        begin_ns, k = place(wires, frame.exit, at_ns, wire_ns, at_ns - switch.hop_ns)
        if begin_ns > at_ns and begin_ns - at_ns + wire_ns > switch.limit_ns:
            note(wires, f, number, at_ns)
        else:
            frame.out_ns = begin_ns + wire_ns
            book(wires, frame.exit, k, begin_ns, wire_ns)
        f = frame.copy


@inner(types.void(WIRES, A_PORT, I8, I8))
def leave(wires, line, f, now_ns):
    """All packets of frame f have left its interface now."""
    line.queued -= 1
    line.inside -= 1
    while f >= 0:
        frame = wires.frames[f]
        wires.exits[frame.exit].coming -= 1
        frame.left_ns = now_ns
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
    out_ns, behind = place(wires, frame.exit, at_ns, wire_ns, line.end_ns)
    # No packet waits longer than the first: none is longer.
    if long + short == 0 or behind < exit_.spans or out_ns - at_ns + wire_ns > switch.limit_ns:
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
    book(wires, frame.exit, behind, out_ns, wire_ns + sent_ns)
    return True


@inner(I8(WIRES, I8, I8, I8, I8, I8))
def foresee(wires, exit_, begin_ns, total_ns, first_ns, now_ns):
    """Shortcut: the arrival of a frame that will be in the switch within ``ahead_ns``: its exit is
    booked now. -1 while a frame for that exit is at an interface, if the exit may not have room, or
    if packets of others may come between those of a train."""
    switch, spans = wires.switch[0], wires.spans[exit_]
    if wires.exits[exit_].coming > 0:
        return -1
    at_ns = begin_ns + first_ns + switch.hop_ns
    out_ns, k = place(wires, exit_, at_ns, total_ns, now_ns)
    if out_ns > at_ns and out_ns - at_ns + first_ns > switch.limit_ns:
        return -1
    is_last = k == wires.exits[exit_].spans
    if total_ns > first_ns and (out_ns > at_ns or not is_last and out_ns + total_ns > spans[2 * k]):
        return -1
    book(wires, exit_, k, out_ns, total_ns)
    return out_ns + total_ns + switch.hop_ns

"""The queues of a switch, packet by packet: ``packets.py`` in compiled form, to the nanosecond.

Lists are chains of record numbers, -1 at their ends.
"""

from __future__ import annotations

import numpy as np
from numba import boolean, from_dtype, int64, void

from desim.ports.kernels import lean

QUANTUM_BYTES = 1514  # fq_codel: MTU and Ethernet header
NEVER = np.int64(1) << 62

# Of a port: when the packet that is being sent ends, of which frame; its flows that are new and
# those that are not, each from first to last.
LINE = np.dtype([("end_ns", "i8"), ("sending", "i8"), ("new", "i8"), ("new_last", "i8"),
                 ("old", "i8"), ("old_last", "i8")])

# Its frames, from first to last; what it may send before others have their turn; the flow behind
# it in a list of its port, and whether it is in one.
FLOW = np.dtype([("first", "i8"), ("last", "i8"), ("deficit", "i8"), ("next", "i8"),
                 ("listed", "i8")])

# The frame behind it in its flow, its packets (``PacketTrain``), how many of them have begun. Its
# exit, when the last of its packets has left that, how many were lost there; the record for its
# next exit (a broadcast has several).
FRAME = np.dtype([("next", "i8"), ("packets", "i8"), ("longer", "i8"), ("long_ns", "i8"),
                  ("short_ns", "i8"), ("long_bytes", "i8"), ("short_bytes", "i8"),
                  ("begun", "i8"), ("exit", "i8"), ("out_ns", "i8"), ("lost", "i8"),
                  ("copy", "i8")])

# Until when it will be busy, with how much so far, when the last packet came.
EXIT = np.dtype([("free_ns", "i8"), ("booked_ns", "i8"), ("last_ns", "i8")])

# What happened: a packet of a frame (a copy of one) was lost; or, packet -1, all are sent.
NOTE = np.dtype([("frame", "i8"), ("packet", "i8")])

_line, _flow, _frame = from_dtype(LINE), from_dtype(FLOW), from_dtype(FRAME)
_lines, _flows, _frames = _line[::1], _flow[::1], _frame[::1]
_exits, _notes, _i8 = from_dtype(EXIT)[::1], from_dtype(NOTE)[::1], int64


@lean(void(_line, _flows, _i8))
def _join_old(line, flows, k):
    flows[k].next = -1
    if line.old < 0:
        line.old = k
    else:
        flows[line.old_last].next = k
    line.old_last = k


@lean(_i8(_line, _flows, _frames))
def _take(line, flows, frames):
    """The frame whose next packet is sent now; -1: nothing waits."""
    while True:
        k, new = line.new, True
        if k < 0:
            k, new = line.old, False
            if k < 0:
                return -1
        flow = flows[k]
        f = flow.first
        if f >= 0 and flow.deficit > 0:
            frame = frames[f]
            flow.deficit -= frame.long_bytes if frame.begun < frame.longer else frame.short_bytes
            frame.begun += 1
            if frame.begun == frame.packets:
                flow.first = frame.next
            return f
        if new:
            line.new = flow.next
        else:
            line.old = flow.next
        if flow.deficit <= 0:
            flow.deficit += QUANTUM_BYTES
            _join_old(line, flows, k)
        elif new and line.old >= 0:
            _join_old(line, flows, k)
        else:
            flow.listed = 0


@lean(_i8(_frame))
def _wire_ns(frame):
    """Time on the wire of the packet that began last."""
    return frame.long_ns if frame.begun <= frame.longer else frame.short_ns


@lean(void(_line, _flows, _frames, _i8))
def _next(line, flows, frames, begin_ns):
    """The line is free: the next packet's turn."""
    line.sending = _take(line, flows, frames)
    line.end_ns = NEVER
    if line.sending >= 0:
        line.end_ns = begin_ns + _wire_ns(frames[line.sending])


@lean(void(_lines, _flows, _frames, _i8, _i8, _i8, _i8))
def put(lines, flows, frames, port, begin_ns, k, f):
    """Frame f, of flow k, is to be sent."""
    line, flow = lines[port], flows[k]
    frames[f].next = -1
    if flow.first < 0:
        flow.first = f
    else:
        frames[flow.last].next = f
    flow.last = f
    if flow.listed == 0:
        flow.listed, flow.deficit, flow.next = 1, QUANTUM_BYTES, -1
        if line.new < 0:
            line.new = k
        else:
            flows[line.new_last].next = k
        line.new_last = k
    if line.sending < 0:
        _next(line, flows, frames, begin_ns)


@lean(_i8(_frames, _exits, _notes, _i8, _i8, _i8, _i8))
def _cross(frames, exits, notes, noted, f, at_ns, limit_ns):
    """A packet of frame f is in the switch, and joins the queue of each of its exits. Returns how
    many notes there are."""
    number, wire_ns = frames[f].begun - 1, _wire_ns(frames[f])
    while f >= 0:
        frame = frames[f]
        exit_ = exits[frame.exit]
        wait_ns = exit_.free_ns - at_ns
        if wait_ns > 0 and wait_ns + wire_ns > limit_ns:
            frame.lost += 1
            notes[noted].frame, notes[noted].packet = f, number
            noted += 1
        else:
            frame.out_ns = max(at_ns, exit_.free_ns) + wire_ns
            exit_.free_ns = frame.out_ns
            exit_.booked_ns += wire_ns
            exit_.last_ns = at_ns
        f = frame.copy
    return noted


@lean(_i8(_lines, _flows, _frames, _exits, _notes, _i8, _i8, _i8, _i8))
def run(lines, flows, frames, exits, notes, noted, now_ns, hop_ns, limit_ns):
    """All that has been sent up to now. Of packets that end at once the lower port's is the first.
    Returns how many notes there are, less 1 and negative if there is no room for more."""
    while True:
        end_ns, p = now_ns + 1, -1
        for k in range(lines.size):
            if lines[k].end_ns < end_ns:
                end_ns, p = lines[k].end_ns, k
        if p < 0:
            return noted
        if noted + lines.size + 1 > notes.size:
            return -1 - noted
        line = lines[p]
        f = line.sending
        noted = _cross(frames, exits, notes, noted, f, end_ns + hop_ns, limit_ns)
        if frames[f].begun == frames[f].packets:
            notes[noted].frame, notes[noted].packet = f, -1
            noted += 1
        _next(line, flows, frames, end_ns)


@lean(boolean(_line, _flows))
def _alone(line, flows):
    """No more than one flow waits."""
    if line.new >= 0:
        return flows[line.new].next < 0 and line.old < 0
    return line.old < 0 or flows[line.old].next < 0


@lean(_i8(_lines, _flows, _frames, _lines, _flows, _frames, _i8))
def due_ns(lines, flows, frames, lines_2, flows_2, frames_2, port):
    """When the first of a port's frames will be sent, if nothing else is put there; found by
    running copies."""
    line = lines[port]
    frame = frames[line.sending]
    left = frame.packets - frame.begun
    if left == 0:
        return line.end_ns
    if _alone(line, flows):
        long = max(frame.longer - frame.begun, 0)
        return line.end_ns + long * frame.long_ns + (left - long) * frame.short_ns
    lines_2[port] = line
    for k in range(flows.size):
        flows_2[k] = flows[k]
    for k in range(frames.size):
        frames_2[k] = frames[k]
    tried = lines_2[port]
    while frames_2[tried.sending].begun < frames_2[tried.sending].packets:
        _next(tried, flows_2, frames_2, tried.end_ns)
    return tried.end_ns

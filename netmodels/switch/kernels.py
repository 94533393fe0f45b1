"""The queues of a switch, packet by packet: ``reference_queues.py`` compiled, to the nanosecond.

State: see ``netmodels.kernels``. Lists are chains of record numbers, -1 at their ends.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from desim.ports.kernels import carray, from_dtype, inner, kernel, lean, types
from netmodels.kernels import pointer

boolean, int64, void = types.boolean, types.int64, types.void

QUANTUM_BYTES = 1514  # fq_codel: MTU and Ethernet header
NEVER = 1 << 62

LIST = np.dtype([("first", "i8"), ("last", "i8")])

# The interface of a port: when the packet that is being sent ends, and its frame; the lists of
# flows that are new and of those that are not.
INTERFACE = np.dtype([("end_ns", "i8"), ("sending", "i8"), ("new", LIST), ("old", LIST)])

# A flow: the list of its frames; the bytes that it may send in its turn; the flow behind it in a
# list of its interface, and whether it is in one.
FLOW = np.dtype([("frames", LIST), ("deficit", "i8"), ("next", "i8"), ("listed", "i8")])

# A frame: the one behind it in its flow, its packets (``PacketTrain``), how many have begun. Its
# exit, when the last of its packets leaves that, how many were lost there; the record for its next
# exit (a broadcast has several).
FRAME = np.dtype([("next", "i8"), ("packets", "i8"), ("longer", "i8"), ("long_ns", "i8"),
                  ("short_ns", "i8"), ("long_bytes", "i8"), ("short_bytes", "i8"),
                  ("begun", "i8"), ("exit", "i8"), ("out_ns", "i8"), ("lost", "i8"),
                  ("copy", "i8")])

# An exit: until when it will be busy, for how long it has been in all, when the last packet came.
EXIT = np.dtype([("free_ns", "i8"), ("booked_ns", "i8"), ("last_ns", "i8")])

# An event: a packet of a frame (a copy of one) was lost; or, packet -1, all are sent.
NOTE = np.dtype([("frame", "i8"), ("packet", "i8")])


class Queues(NamedTuple):
    """The state of a switch: interfaces [ports] | flows | frames | exits [ports] | notes."""

    interfaces: np.ndarray
    flows: np.ndarray
    frames: np.ndarray
    exits: np.ndarray
    notes: np.ndarray


_i8 = int64
_interface, _frame, _flows = from_dtype(INTERFACE), from_dtype(FRAME), from_dtype(FLOW)[::1]
_queues = types.NamedTuple((_interface[::1], _flows, _frame[::1], from_dtype(EXIT)[::1],
                            from_dtype(NOTE)[::1]), Queues)
_rows = _i8[:, :, ::1]  # ``Addresses.rows`` of the queues, and of copies to try out


@kernel(_queues(_i8[:, ::1]), inner=True)
def _arrays_at(rows):
    """The state whose addresses are in ``rows``, those of one of ``Addresses.states``."""
    return Queues(carray(pointer(rows[0, 0]), (rows[0, 1],), INTERFACE),
                  carray(pointer(rows[1, 0]), (rows[1, 1],), FLOW),
                  carray(pointer(rows[2, 0]), (rows[2, 1],), FRAME),
                  carray(pointer(rows[3, 0]), (rows[3, 1],), EXIT),
                  carray(pointer(rows[4, 0]), (rows[4, 1],), NOTE))


@inner([void(from_dtype(LIST), records, _i8) for records in (_flows, _frame[::1])])
def _append(queue, records, k):
    """Append record k, a flow or a frame, to a list of such."""
    records[k].next = -1
    if queue.first < 0:
        queue.first = k
    else:
        records[queue.last].next = k
    queue.last = k


@inner(_i8(_queues, _interface))
def _take(queues, line):
    """Take the next packet to send. Returns its frame; -1: nothing waits."""
    flows, frames = queues.flows, queues.frames
    while True:
        new = line.new.first >= 0
        queue = line.new if new else line.old
        k = queue.first
        if k < 0:
            return -1
        flow = flows[k]
        f = flow.frames.first
        if f >= 0 and flow.deficit > 0:
            frame = frames[f]
            flow.deficit -= frame.long_bytes if frame.begun < frame.longer else frame.short_bytes
            frame.begun += 1
            if frame.begun == frame.packets:
                flow.frames.first = frame.next
            return f
        queue.first = flow.next
        if flow.deficit <= 0:
            flow.deficit += QUANTUM_BYTES
            _append(line.old, flows, k)
        elif new and line.old.first >= 0:
            _append(line.old, flows, k)
        else:
            flow.listed = 0


@inner(_i8(_frame))
def _wire_ns(frame):
    """Time on the wire of the packet that began last."""
    return frame.long_ns if frame.begun <= frame.longer else frame.short_ns


@inner(void(_queues, _interface, _i8))
def _next(queues, line, begin_ns):
    """Begin the next packet on the free line."""
    line.sending = _take(queues, line)
    line.end_ns = NEVER
    if line.sending >= 0:
        line.end_ns = begin_ns + _wire_ns(queues.frames[line.sending])


@lean(void(_rows, _i8, _i8, _i8, _i8))
def put(rows, port, begin_ns, k, f):
    """Queue frame f, of flow k, at a port's interface; it may begin at ``begin_ns``."""
    queues = _arrays_at(rows[0])
    flows, frames, line = queues.flows, queues.frames, queues.interfaces[port]
    flow = flows[k]
    _append(flow.frames, frames, f)
    if flow.listed == 0:
        flow.listed, flow.deficit = 1, QUANTUM_BYTES
        _append(line.new, flows, k)
    if line.sending < 0:
        _next(queues, line, begin_ns)


@inner(_i8(_queues, _i8, _i8, _i8, _i8))
def _cross(queues, noted, f, at_ns, limit_ns):
    """A packet of frame f is in the switch, and joins the queue of each of its exits. Returns how
    many notes there are."""
    frames, exits, notes = queues.frames, queues.exits, queues.notes
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


@lean(_i8(_rows, _i8, _i8, _i8, _i8))
def run(rows, noted, now_ns, hop_ns, limit_ns):
    """Send up to now. Of packets that end at once the lower port's is the first. Returns how many
    notes there are, less 1 and negative if more do not fit."""
    queues = _arrays_at(rows[0])
    lines, frames, notes = queues.interfaces, queues.frames, queues.notes
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
        noted = _cross(queues, noted, f, end_ns + hop_ns, limit_ns)
        if frames[f].begun == frames[f].packets:
            notes[noted].frame, notes[noted].packet = f, -1
            noted += 1
        _next(queues, line, end_ns)


@inner(boolean(_interface, _flows))
def _alone(line, flows):
    """Whether at most one flow waits."""
    new, old = line.new.first, line.old.first
    if new >= 0:
        return flows[new].next < 0 and old < 0
    return old < 0 or flows[old].next < 0


@lean(_i8(_rows, _i8))
def due_ns(rows, port):
    """The time at which the first of a port's frames will be sent if nothing else is put there. It
    is found by running copies."""
    queues = _arrays_at(rows[0])
    flows, frames, line = queues.flows, queues.frames, queues.interfaces[port]
    frame = frames[line.sending]
    left = frame.packets - frame.begun
    if left == 0:
        return line.end_ns
    if _alone(line, flows):
        long = max(frame.longer - frame.begun, 0)
        return line.end_ns + long * frame.long_ns + (left - long) * frame.short_ns
    trial = _arrays_at(rows[1])
    trial.interfaces[port] = line
    for k in range(flows.size):
        trial.flows[k] = flows[k]
    for k in range(frames.size):
        trial.frames[k] = frames[k]
    tried = trial.interfaces[port]
    while trial.frames[tried.sending].begun < trial.frames[tried.sending].packets:
        _next(trial, tried, tried.end_ns)
    return tried.end_ns

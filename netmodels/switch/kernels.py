"""The wires of a switch: ports, interfaces and exits as a state machine over records.

``reference_queues.py`` compiled, to the nanosecond, but by whole frames; and a shortcut for frames
that will be in the switch soon. State: see ``netmodels.kernels``. Lists are chains of record
numbers, -1 at their ends.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from desim.ports.kernels import carray, from_dtype, inner, kernel, lean, types
from netmodels.kernels import pointer
from netmodels.switch.trains import PacketTrain

boolean, int64, void = types.boolean, types.int64, types.void

QUANTUM_BYTES = 1514  # fq_codel: MTU and Ethernet header
NEVER = 1 << 62
FULL = -1  # an answer: there are too few frames or notes; with more of them, call again
ALL_SENT = -1  # in a note, instead of a packet's number

LIST = np.dtype([("first", "i8"), ("last", "i8")])

# What all ports share: from a packet's end on one wire to the other end of the cable; how much an
# exit may hold, as time; a frame that will be in the switch so soon is settled when it is sent;
# between hosts of one port; whether flows are served in turn. The first frame record that is free,
# and how many are; notes so far; when the next frame will have been sent.
SWITCH = np.dtype([("hop_ns", "i8"), ("limit_ns", "i8"), ("ahead_ns", "i8"), ("local_ns", "i8"),
                   ("fair", "i8"), ("free", "i8"), ("room", "i8"), ("noted", "i8"),
                   ("due_ns", "i8")])

# A port, into the switch: when all that was sent to it will be out, and how long that takes in all;
# frames that are not sent yet, and those of them that its interface knows; the list of the others.
# When the first of the former will have been sent. The interface: when the packet that is being
# sent ends, and its frame; the lists of flows that are new and of those that are not.
PORT = np.dtype([("free_ns", "i8"), ("booked_ns", "i8"), ("queued", "i8"), ("inside", "i8"),
                 ("waiting", LIST), ("due_ns", "i8"), ("end_ns", "i8"), ("sending", "i8"),
                 ("new", LIST), ("old", LIST)])

# An exit: until when it will be busy, for how long it has been in all, when the last packet came;
# frames at interfaces that are for it.
EXIT = np.dtype([("free_ns", "i8"), ("booked_ns", "i8"), ("last_ns", "i8"), ("coming", "i8")])

# A flow: the list of its frames; the bytes that it may send in its turn; the flow behind it in a
# list of its interface, and whether it is in one.
FLOW = np.dtype([("frames", LIST), ("deficit", "i8"), ("next", "i8"), ("listed", "i8")])

# A frame: the one behind it in a list; its packets (``PacketTrain``), how many have begun; its port
# and flow, when it begins if nothing is put before it. Its exit, and when the last of its packets
# leaves that; the record for its next exit, if it is a broadcast, and whether it is none.
FRAME = np.dtype([("next", "i8"), ("packets", "i8"), ("longer", "i8"), ("long_ns", "i8"),
                  ("short_ns", "i8"), ("long_bytes", "i8"), ("short_bytes", "i8"),
                  ("total_ns", "i8"), ("begun", "i8"), ("port", "i8"), ("flow", "i8"),
                  ("begin_ns", "i8"), ("exit", "i8"), ("out_ns", "i8"), ("copy", "i8"),
                  ("unicast", "i8")])


class Wires(NamedTuple):
    """The state of a switch: switch [1] | ports | flows | frames | exits | notes | many.

    ``notes`` [n, 3]: a frame's record and the number of a packet that was lost at its exit, or
    ``ALL_SENT`` and the time (ns) when the last of the others is at the receivers, after ``wake``
    from now on. ``many`` [n]: exits of frames that are sent at once, and the answers.
    """

    switch: np.ndarray
    ports: np.ndarray
    flows: np.ndarray
    frames: np.ndarray
    exits: np.ndarray
    notes: np.ndarray
    many: np.ndarray


_i8 = int64
_switch, _port, _exit = from_dtype(SWITCH), from_dtype(PORT), from_dtype(EXIT)
_frame, _flows = from_dtype(FRAME), from_dtype(FLOW)[::1]
_wires = types.NamedTuple((_switch[::1], _port[::1], _flows, _frame[::1], _exit[::1],
                           _i8[:, ::1], _i8[::1]), Wires)
_rows = _i8[:, :, ::1]  # ``Addresses.rows`` of the wires, and of copies to try out
_train = types.NamedUniTuple(_i8, 7, PacketTrain)


@kernel(_wires(_i8[:, ::1]), inner=True)
def _arrays_at(rows):
    """The state whose addresses are in ``rows``, those of one of ``Addresses.states``."""
    return Wires(carray(pointer(rows[0, 0]), (rows[0, 1],), SWITCH),
                 carray(pointer(rows[1, 0]), (rows[1, 1],), PORT),
                 carray(pointer(rows[2, 0]), (rows[2, 1],), FLOW),
                 carray(pointer(rows[3, 0]), (rows[3, 1],), FRAME),
                 carray(pointer(rows[4, 0]), (rows[4, 1],), EXIT),
                 carray(pointer(rows[5, 0]), (rows[5, 1], rows[5, 2]), np.int64),
                 carray(pointer(rows[6, 0]), (rows[6, 1],), np.int64))


@inner([void(from_dtype(LIST), records, _i8) for records in (_flows, _frame[::1])])
def _append(queue, records, k):
    """Append record k, a flow or a frame, to a list of such."""
    records[k].next = -1
    if queue.first < 0:
        queue.first = k
    else:
        records[queue.last].next = k
    queue.last = k


@inner(_i8(_wires, _port))
def _take(wires, line):
    """Take the next packet to send. Returns its frame; -1: nothing waits."""
    flows, frames = wires.flows, wires.frames
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


@inner(void(_wires, _port, _i8))
def _next(wires, line, begin_ns):
    """Begin the next packet on the free line."""
    line.sending = _take(wires, line)
    line.end_ns = NEVER
    if line.sending >= 0:
        line.end_ns = begin_ns + _wire_ns(wires.frames[line.sending])


@inner(void(_wires, _i8, _i8, _i8))
def _note(wires, f, packet, time_ns):
    """Leave a note; the callers have seen to it that there is room."""
    switch, notes = wires.switch[0], wires.notes
    notes[switch.noted, 0], notes[switch.noted, 1] = f, packet
    notes[switch.noted, 2] = time_ns
    switch.noted += 1


@inner(void(_wires, _i8, _i8))
def _cross(wires, f, at_ns):
    """A packet of frame f is in the switch, and joins the queue of each of its exits."""
    frames, switch = wires.frames, wires.switch[0]
    number, wire_ns = frames[f].begun - 1, _wire_ns(frames[f])
    while f >= 0:
        frame = frames[f]
        exit_ = wires.exits[frame.exit]
        wait_ns = exit_.free_ns - at_ns
        if wait_ns > 0 and wait_ns + wire_ns > switch.limit_ns:
            _note(wires, f, number, at_ns)
        else:
            frame.out_ns = max(at_ns, exit_.free_ns) + wire_ns
            exit_.free_ns = frame.out_ns
            exit_.booked_ns += wire_ns
            exit_.last_ns = at_ns
        f = frame.copy


@inner(void(_wires, _port, _i8))
def _leave(wires, line, f):
    """All packets of frame f have left its interface."""
    line.queued -= 1
    line.inside -= 1
    while f >= 0:
        frame = wires.frames[f]
        wires.exits[frame.exit].coming -= 1
        _note(wires, f, ALL_SENT, frame.out_ns + wires.switch[0].hop_ns)
        f = frame.copy


@inner(boolean(_port, _flows))
def _alone(line, flows):
    """Whether at most one flow waits."""
    new, old = line.new.first, line.old.first
    if new >= 0:
        return flows[new].next < 0 and old < 0
    return old < 0 or flows[old].next < 0


@inner(boolean(_wires, _port, _i8))
def _skip(wires, line, now_ns):
    """Let the packets of a train cross at once until the last that ends by now is being sent.
    Returns False if that is so, if other frames are in its way, or if some may be lost. (A train of
    110 packets crosses in 0.1 us; one by one they take 1 us.)"""
    frame, switch = wires.frames[line.sending], wires.switch[0]
    exit_, left_ns = wires.exits[frame.exit], now_ns - line.end_ns
    if exit_.coming > 1 or frame.copy >= 0 or not _alone(line, wires.flows):
        return False
    still = max(frame.longer - frame.begun, 0)
    long = min(still, left_ns // frame.long_ns)
    short = 0
    if long == still:
        short = min(frame.packets - frame.begun - long,
                    (left_ns - long * frame.long_ns) // frame.short_ns)
    at_ns, wire_ns = line.end_ns + switch.hop_ns, _wire_ns(frame)
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
                    _append(line.old, wires.flows, frame.flow)
            flow.deficit -= frame.long_bytes if k < frame.longer else frame.short_bytes
    frame.begun += long + short
    if frame.begun == frame.packets:
        flow.frames.first = frame.next
    sent_ns = long * frame.long_ns + short * frame.short_ns
    line.end_ns += sent_ns
    sent_ns -= _wire_ns(frame)
    exit_.free_ns = out_ns + wire_ns + sent_ns
    exit_.booked_ns += wire_ns + sent_ns
    exit_.last_ns = at_ns + sent_ns
    return True


@lean(boolean(_rows, _i8))
def run(rows, now_ns):
    """Send up to now. Of packets that end at once the lower port's is the first. Returns False if
    there is no room for all notes."""
    wires = _arrays_at(rows[0])
    lines, frames, switch = wires.ports, wires.frames, wires.switch[0]
    while True:
        end_ns, p = now_ns + 1, -1
        for k in range(lines.size):
            if lines[k].end_ns < end_ns:
                end_ns, p = lines[k].end_ns, k
        if p < 0:
            return True
        line = lines[p]
        if _skip(wires, line, now_ns):
            continue
        if switch.noted + frames.size + lines.size > wires.notes.shape[0]:
            return False
        f = line.sending
        _cross(wires, f, end_ns + switch.hop_ns)
        if frames[f].begun == frames[f].packets:
            _leave(wires, line, f)
        _next(wires, line, end_ns)


@inner(void(_wires, _wires, _i8))
def _copy(wires, trial, k):
    """Copy the flows of a list that begins with flow k, and the first frame of each."""
    while k >= 0:
        flow = wires.flows[k]
        trial.flows[k] = flow
        if flow.frames.first >= 0:
            trial.frames[flow.frames.first] = wires.frames[flow.frames.first]
        k = flow.next


@inner(_i8(_rows, _i8))
def _due_ns(rows, port):
    """The time at which the first of the frames at a port's interface will be sent if nothing else
    is put there. It is found by running copies."""
    wires = _arrays_at(rows[0])
    line = wires.ports[port]
    frame = wires.frames[line.sending]
    left = frame.packets - frame.begun
    if left == 0:
        return line.end_ns
    if _alone(line, wires.flows):
        long = max(frame.longer - frame.begun, 0)
        return line.end_ns + long * frame.long_ns + (left - long) * frame.short_ns
    trial = _arrays_at(rows[1])
    trial.ports[port] = line
    _copy(wires, trial, line.new.first)
    _copy(wires, trial, line.old.first)
    tried = trial.ports[port]
    while trial.frames[tried.sending].begun < trial.frames[tried.sending].packets:
        _next(trial, tried, tried.end_ns)
    return tried.end_ns


@inner(_i8(_wires, _exit, _i8, _i8, _i8))
def _foresee(wires, exit_, begin_ns, total_ns, first_ns):
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


@lean(_i8(_rows, _i8, _i8, _i8, _train))
def send(rows, now_ns, port, exit_, train):
    """Book a frame on a port's line. Returns the delay until it is at its receiver; -1: it is not
    known, or there is more than one exit (``exit_`` is -1), and the frame has to be ``put``."""
    wires = _arrays_at(rows[0])
    line = wires.ports[port]
    begin_ns = max(line.free_ns, now_ns)
    line.free_ns = begin_ns + train.total_ns
    line.booked_ns += train.total_ns
    if exit_ < 0 or line.queued > 0 or line.free_ns - now_ns > wires.switch[0].ahead_ns:
        return -1
    out_ns = _foresee(wires, wires.exits[exit_], begin_ns, train.total_ns, train.long_ns)
    return -1 if out_ns < 0 else out_ns - now_ns


@inner(void(_rows, _i8, _i8))
def _enter(rows, now_ns, f):
    """Frame f is at its port's interface."""
    wires = _arrays_at(rows[0])
    flows, frames, frame = wires.flows, wires.frames, wires.frames[f]
    line, flow = wires.ports[frame.port], flows[frame.flow]
    copy = f
    while copy >= 0:
        wires.exits[frames[copy].exit].coming += 1
        copy = frames[copy].copy
    _append(flow.frames, frames, f)
    if flow.listed == 0:
        flow.listed, flow.deficit = 1, QUANTUM_BYTES
        _append(line.new, flows, frame.flow)
    if line.sending < 0:
        _next(wires, line, frame.begin_ns)
    line.inside += 1
    if line.inside == 1 or now_ns + frame.total_ns < line.due_ns:
        line.due_ns = _due_ns(rows, frame.port)
        wires.switch[0].due_ns = min(wires.switch[0].due_ns, line.due_ns)


@inner(_i8(_rows, _i8, _i8, _i8, _i8, _i8, _i8, _i8, _i8, _train))
def _put(rows, now_ns, port, flow, begin_ns, exit_, copy, unicast, last, train):
    """``put`` where there is room."""
    wires = _arrays_at(rows[0])
    switch, frames, line = wires.switch[0], wires.frames, wires.ports[port]
    f = switch.free
    frame = frames[f]
    switch.free = frame.next
    switch.room -= 1
    frame.packets, frame.longer, frame.begun = train.packets, train.longer, 0
    frame.long_ns, frame.short_ns, frame.total_ns = train.long_ns, train.short_ns, train.total_ns
    frame.long_bytes, frame.short_bytes = train.long_bytes, train.short_bytes
    frame.port, frame.flow, frame.begin_ns = port, flow, begin_ns
    frame.exit, frame.out_ns, frame.copy, frame.unicast = exit_, 0, copy, unicast
    if last:
        line.queued += 1
        if line.inside > 0 and switch.fair == 0:
            _append(line.waiting, frames, f)
        else:
            _enter(rows, now_ns, f)
    return f


@lean(types.UniTuple(_i8, 2)(_rows, _i8, _i8, _i8, _i8, _i8, _i8, _i8, _train))
def put(rows, now_ns, port, flow, exit_, copy, unicast, last, train):
    """Queue the frame that was booked last at its port's interface; a broadcast once for each exit,
    with the record before as ``copy`` (-1: none), until the ``last``. Returns its record or
    ``FULL``, and when to ``wake``."""
    wires = _arrays_at(rows[0])
    switch = wires.switch[0]
    if switch.room == 0 or switch.fair and not run(rows, now_ns):
        return FULL, NEVER
    f = _put(rows, now_ns, port, flow, wires.ports[port].free_ns - train.total_ns, exit_, copy,
             unicast, last, train)
    return f, switch.due_ns


@lean(types.UniTuple(_i8, 2)(_rows, _i8, _i8, _i8, _train))
def send_many(rows, now_ns, port, count, train):
    """``send``, and where need be ``put``, ``count`` frames to the exits in ``many``, which becomes
    the delay of each, or -1 - its record. Where flows are served in turn, it ends before the first
    that would have to be put. Returns how many were taken or ``FULL``, and when to ``wake``."""
    wires = _arrays_at(rows[0])
    switch, many, line = wires.switch[0], wires.many, wires.ports[port]
    if switch.room < count:
        return FULL, NEVER
    for i in range(count):
        exit_ = many[i]
        if exit_ == port:
            many[i] = switch.local_ns
            continue
        many[i] = send(rows, now_ns, port, exit_, train)
        if many[i] < 0:
            begin_ns = line.free_ns - train.total_ns
            if switch.fair:
                line.free_ns = begin_ns
                line.booked_ns -= train.total_ns
                return i, switch.due_ns
            many[i] = -1 - _put(rows, now_ns, port, port, begin_ns, exit_, -1, 1, 1,
                                train)
    return count, switch.due_ns


@inner(void(_rows, _i8, _i8))
def _go_on(rows, now_ns, port):
    """Settle frames that will be in the switch soon, and queue the next one on the free line."""
    wires = _arrays_at(rows[0])
    line, ahead_ns = wires.ports[port], wires.switch[0].ahead_ns
    while line.waiting.first >= 0 and line.inside == 0:
        f = line.waiting.first
        frame = wires.frames[f]
        line.waiting.first = frame.next
        out_ns = -1
        if frame.begin_ns + frame.total_ns - now_ns <= ahead_ns and frame.unicast:
            out_ns = _foresee(wires, wires.exits[frame.exit], frame.begin_ns, frame.total_ns,
                              frame.long_ns)
        if out_ns < 0:
            _enter(rows, now_ns, f)
        else:
            line.queued -= 1
            _note(wires, f, ALL_SENT, out_ns)


@lean(types.UniTuple(_i8, 2)(_rows, _i8))
def wake(rows, now_ns):
    """Send up to now. Returns how many notes there are or ``FULL``, and when to call next. The
    records of frames in notes that all is sent are free then."""
    wires = _arrays_at(rows[0])
    switch, lines, notes = wires.switch[0], wires.ports, wires.notes
    if not run(rows, now_ns):
        return FULL, NEVER
    due_ns = NEVER
    for p in range(lines.size):
        line = lines[p]
        if line.due_ns <= now_ns:
            line.due_ns = NEVER
            if line.inside > 0:
                line.due_ns = _due_ns(rows, p)
            else:
                _go_on(rows, now_ns, p)
        due_ns = min(due_ns, line.due_ns)
    switch.due_ns = due_ns
    noted, switch.noted = switch.noted, 0
    for k in range(noted):
        if notes[k, 1] == ALL_SENT:
            # A gap of the line may take longer than the cable.
            f, notes[k, 2] = notes[k, 0], max(notes[k, 2] - now_ns, 0)
            wires.frames[f].next = switch.free
            switch.free = f
            switch.room += 1
    return noted, due_ns

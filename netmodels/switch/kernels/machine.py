"""The wires of a switch as a state machine: frames come and go, and ``wake`` moves it to now.

By whole frames, and to the nanosecond what it would be packet by packet (in plain Python:
``tests/packet_by_packet.py``), but for the shortcut for frames that will be in the switch soon
(``exits.foresee``). Its state: ``records``.
"""

from __future__ import annotations

from desim.ports.kernels import inner, lean, types
from netmodels.switch.kernels.exits import cross, foresee, leave, note, skip
from netmodels.switch.kernels.interface import begin_next, copy_flows, is_alone
from netmodels.switch.kernels.records import (
    ALL_SENT,
    FULL,
    I8,
    NEVER,
    QUANTUM_BYTES,
    ROWS,
    TRAIN,
    append,
    arrays_at,
)


@lean(types.boolean(ROWS, I8))
def run(rows, now_ns):
    """Send up to now. Of packets that end at once the lower port's is the first. Returns False if
    there is no room for all notes."""
    wires = arrays_at(rows[0])
    lines, frames, switch = wires.ports, wires.frames, wires.switch[0]
    while True:
        end_ns, p = now_ns + 1, -1
        for k in range(lines.size):
            if lines[k].end_ns < end_ns:
                end_ns, p = lines[k].end_ns, k
        if p < 0:
            return True
        line = lines[p]
        if skip(wires, line, now_ns):
            continue
        if switch.noted + frames.size + lines.size > wires.notes.shape[0]:
            return False
        f = line.sending
        cross(wires, f, end_ns + switch.hop_ns)
        if frames[f].begun == frames[f].packets:
            leave(wires, line, f, end_ns)
        begin_next(wires, line, end_ns)


@inner(I8(ROWS, I8))
def _due_ns(rows, port):
    """The time at which the first of the frames at a port's interface will be sent if nothing else
    is put there. It is found by running copies."""
    wires = arrays_at(rows[0])
    line = wires.ports[port]
    frame = wires.frames[line.sending]
    left = frame.packets - frame.begun
    if left == 0:
        return line.end_ns
    if is_alone(line, wires.flows):
        long = max(frame.longer - frame.begun, 0)
        return line.end_ns + long * frame.long_ns + (left - long) * frame.short_ns
    trial = arrays_at(rows[1])
    trial.ports[port] = line
    copy_flows(wires, trial, line.new.first)
    copy_flows(wires, trial, line.old.first)
    tried = trial.ports[port]
    while trial.frames[tried.sending].begun < trial.frames[tried.sending].packets:
        begin_next(trial, tried, tried.end_ns)
    return tried.end_ns


@lean(I8(ROWS, I8, I8, I8, TRAIN))
def send(rows, now_ns, port, exit_, train):
    """Book a frame on a port's line. Returns the delay until it is at its receiver; -1: it is not
    known, or there is more than one exit (``exit_`` is -1), and the frame has to be ``put``."""
    wires = arrays_at(rows[0])
    line = wires.ports[port]
    begin_ns = max(line.free_ns, now_ns)
    line.free_ns = begin_ns + train.total_ns
    line.booked_ns += train.total_ns
    if exit_ < 0 or line.queued > 0 or line.free_ns - now_ns > wires.switch[0].ahead_ns:
        return -1
    out_ns = foresee(wires, exit_, begin_ns, train.total_ns, train.long_ns, now_ns)
    return -1 if out_ns < 0 else out_ns - now_ns


@inner(types.void(ROWS, I8, I8))
def _enter(rows, now_ns, f):
    """Frame f is at its port's interface."""
    wires = arrays_at(rows[0])
    flows, frames, frame = wires.flows, wires.frames, wires.frames[f]
    line, flow = wires.ports[frame.port], flows[frame.flow]
    copy = f
    while copy >= 0:
        wires.exits[frames[copy].exit].coming += 1
        copy = frames[copy].copy
    append(flow.frames, frames, f)
    if flow.listed == 0:
        flow.listed, flow.deficit = 1, QUANTUM_BYTES
        append(line.new, flows, frame.flow)
    if line.sending < 0:
        begin_next(wires, line, frame.begin_ns)
    line.inside += 1
    if line.inside == 1 or now_ns + frame.total_ns < line.due_ns:
        line.due_ns = _due_ns(rows, frame.port)
        wires.switch[0].due_ns = min(wires.switch[0].due_ns, line.due_ns)


@inner(I8(ROWS, I8, I8, I8, I8, I8, I8, I8, I8, TRAIN))
def _put(rows, now_ns, port, flow, begin_ns, exit_, copy, unicast, last, train):
    """``put`` where there is room."""
    wires = arrays_at(rows[0])
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
            append(line.waiting, frames, f)
        else:
            _enter(rows, now_ns, f)
    return f


@lean(types.UniTuple(I8, 2)(ROWS, I8, I8, I8, I8, I8, I8, I8, TRAIN))
def put(rows, now_ns, port, flow, exit_, copy, unicast, last, train):
    """Queue the frame that was booked last at its port's interface; a broadcast once for each exit,
    with the record before as ``copy`` (-1: none), until the ``last``. Returns its record or
    ``FULL``, and when to ``wake``."""
    wires = arrays_at(rows[0])
    switch = wires.switch[0]
    if switch.room == 0 or switch.fair and not run(rows, now_ns):
        return FULL, NEVER
    f = _put(rows, now_ns, port, flow, wires.ports[port].free_ns - train.total_ns, exit_, copy,
             unicast, last, train)
    return f, switch.due_ns


@lean(types.UniTuple(I8, 2)(ROWS, I8, I8, I8, TRAIN))
def send_many(rows, now_ns, port, count, train):
    """``send``, and where need be ``put``, ``count`` frames to the exits in ``many``, which becomes
    the delay of each, or -1 - its record. Where flows are served in turn, it ends before the first
    that would have to be put. Returns how many were taken or ``FULL``, and when to ``wake``."""
    wires = arrays_at(rows[0])
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


@inner(types.void(ROWS, I8, I8))
def _go_on(rows, now_ns, port):
    """Settle frames that will be in the switch soon, and queue the next one on the free line."""
    wires = arrays_at(rows[0])
    line, ahead_ns = wires.ports[port], wires.switch[0].ahead_ns
    while line.waiting.first >= 0 and line.inside == 0:
        f = line.waiting.first
        frame = wires.frames[f]
        line.waiting.first = frame.next
        out_ns = -1
        if frame.begin_ns + frame.total_ns - now_ns <= ahead_ns and frame.unicast:
            out_ns = foresee(wires, frame.exit, frame.begin_ns, frame.total_ns, frame.long_ns,
                             now_ns)
        if out_ns < 0:
            _enter(rows, now_ns, f)
        else:
            line.queued -= 1
            frame.left_ns = frame.begin_ns + frame.total_ns
            note(wires, f, ALL_SENT, out_ns)


@lean(types.UniTuple(I8, 5)(ROWS, I8))
def wake(rows, now_ns):
    """Send up to now. Returns how many notes there are or ``FULL``, when to call next, and the
    first note. The records of frames in notes that all is sent are free then."""
    wires = arrays_at(rows[0])
    switch, lines, notes = wires.switch[0], wires.ports, wires.notes
    if not run(rows, now_ns):
        return FULL, NEVER, 0, 0, 0
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
    return noted, due_ns, notes[0, 0], notes[0, 1], notes[0, 2]

"""Packets at the interface of a port: flows in turn, by deficit round robin.

In plain Python: ``tests/packet_by_packet.py``.
"""

from __future__ import annotations

from desim.ports.kernels import inner, types
from netmodels.switch.kernels.records import (
    A_FRAME,
    A_PORT,
    FLOWS,
    I8,
    NEVER,
    QUANTUM_BYTES,
    WIRES,
    append,
)


@inner(I8(WIRES, A_PORT))
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
            append(line.old, flows, k)
        elif new and line.old.first >= 0:
            append(line.old, flows, k)
        else:
            flow.listed = 0


@inner(I8(A_FRAME))
def packet_ns(frame):
    """Time on the wire of the packet that began last."""
    return frame.long_ns if frame.begun <= frame.longer else frame.short_ns


@inner(types.void(WIRES, A_PORT, I8))
def begin_next(wires, line, begin_ns):
    """Begin the next packet on the free line."""
    line.sending = _take(wires, line)
    line.end_ns = NEVER
    if line.sending >= 0:
        line.end_ns = begin_ns + packet_ns(wires.frames[line.sending])


@inner(types.boolean(A_PORT, FLOWS))
def is_alone(line, flows):
    """Whether at most one flow waits."""
    new, old = line.new.first, line.old.first
    if new >= 0:
        return flows[new].next < 0 and old < 0
    return old < 0 or flows[old].next < 0


@inner(types.void(WIRES, WIRES, I8))
def copy_flows(wires, trial, k):
    """Copy the flows of a list that begins with flow k, and the first frame of each."""
    while k >= 0:
        flow = wires.flows[k]
        trial.flows[k] = flow
        if flow.frames.first >= 0:
            trial.frames[flow.frames.first] = wires.frames[flow.frames.first]
        k = flow.next

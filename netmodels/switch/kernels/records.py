"""The records of a switch, the arrays that have them, and the lists that they are in.

See ``netmodels.kernels``. Lists are chains of record numbers, -1 at their ends.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from desim.ports.kernels import carray, from_dtype, inner, kernel, types
from netmodels.kernels import pointer
from netmodels.switch.trains import PacketTrain

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

# An exit: for how long it has been booked in all; frames at interfaces that are for it; how many
# spans it has.
EXIT = np.dtype([("booked_ns", "i8"), ("coming", "i8"), ("spans", "i8")])
MOST_SPANS = 8  # of an exit: eight hosts at full load need seven

# A flow: the list of its frames; the bytes that it may send in its turn; the flow behind it in a
# list of its interface, and whether it is in one.
FLOW = np.dtype([("frames", LIST), ("deficit", "i8"), ("next", "i8"), ("listed", "i8")])

# A frame: the one behind it in a list; its packets (``PacketTrain``), how many have begun; its port
# and flow, when it begins if nothing is put before it. Its exit, and when the last of its packets
# leaves that; the record for its next exit, if it is a broadcast, and whether it is none. When the
# last of its packets has left the interface.
FRAME = np.dtype([("next", "i8"), ("packets", "i8"), ("longer", "i8"), ("long_ns", "i8"),
                  ("short_ns", "i8"), ("long_bytes", "i8"), ("short_bytes", "i8"),
                  ("total_ns", "i8"), ("begun", "i8"), ("port", "i8"), ("flow", "i8"),
                  ("begin_ns", "i8"), ("exit", "i8"), ("out_ns", "i8"), ("copy", "i8"),
                  ("unicast", "i8"), ("left_ns", "i8")])


class Wires(NamedTuple):
    """The state of a switch: switch [1] | ports | flows | frames | exits | spans | notes | many.

    ``spans`` [ports, 2 * ``MOST_SPANS``]: when an exit sends, begin and end (ns) in turn, ascending
    and apart. ``notes`` [n, 3]: a frame's record and the number of a packet that was lost at its
    exit, or ``ALL_SENT`` and the time (ns) when the last of the others is at the receivers, after
    ``wake`` from now on. ``many`` [n]: exits of frames that are sent at once, and the answers.
    """

    switch: np.ndarray
    ports: np.ndarray
    flows: np.ndarray
    frames: np.ndarray
    exits: np.ndarray
    spans: np.ndarray
    notes: np.ndarray
    many: np.ndarray


I8 = types.int64
SWITCH_RECORD, A_PORT, AN_EXIT = from_dtype(SWITCH), from_dtype(PORT), from_dtype(EXIT)
A_FRAME, FLOWS = from_dtype(FRAME), from_dtype(FLOW)[::1]
WIRES = types.NamedTuple((SWITCH_RECORD[::1], A_PORT[::1], FLOWS, A_FRAME[::1], AN_EXIT[::1],
                           I8[:, ::1], I8[:, ::1], I8[::1]), Wires)
ROWS = I8[:, :, ::1]  # ``Addresses.rows`` of the wires, and of copies to try out
TRAIN = types.NamedUniTuple(I8, 7, PacketTrain)


@kernel(WIRES(I8[:, ::1]), inner=True)
def arrays_at(rows):
    """The state whose addresses are in ``rows``, those of one of ``Addresses.states``."""
    return Wires(carray(pointer(rows[0, 0]), (rows[0, 1],), SWITCH),
                 carray(pointer(rows[1, 0]), (rows[1, 1],), PORT),
                 carray(pointer(rows[2, 0]), (rows[2, 1],), FLOW),
                 carray(pointer(rows[3, 0]), (rows[3, 1],), FRAME),
                 carray(pointer(rows[4, 0]), (rows[4, 1],), EXIT),
                 carray(pointer(rows[5, 0]), (rows[5, 1], rows[5, 2]), np.int64),
                 carray(pointer(rows[6, 0]), (rows[6, 1], rows[6, 2]), np.int64),
                 carray(pointer(rows[7, 0]), (rows[7, 1],), np.int64))


@inner([types.void(from_dtype(LIST), records, I8) for records in (FLOWS, A_FRAME[::1])])
def append(queue, records, k):
    """Append record k, a flow or a frame, to a list of such."""
    records[k].next = -1
    if queue.first < 0:
        queue.first = k
    else:
        records[queue.last].next = k
    queue.last = k

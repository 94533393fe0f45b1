"""The state of a DCF's stations: records in arrays, the arrays' addresses, and the next events."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import carray, float64, from_dtype, int8, int64, njit, types, void
from numba.extending import intrinsic

from desim.ports.kernels import lean, uniform_half_open

NEVER = np.int64(1) << 62

# What may be due, in the order of what happens first in one instant. A time and what is due then
# are one number, ``time_ns * KINDS + kind``, so that the smallest comes next.
END, TIMEOUT, ANSWER, START, DETECT, HEADER, KINDS = 0, 1, 2, 3, 4, 5, 8

BLOCK = 32  # stations whose next events have a common minimum

IDLE, SENDING, AWAITING = range(3)  # what a station does about its present packet
RTS, CTS, DATA, ACK = range(4)
RECEIVED, MISSED, DONE, DROPPED, EXPIRED, ACKED, FAILED, HEARD = range(8)  # outcomes


STATION = np.dtype([  # 256 B, for the future is tried out on copies
    ("key", "u8"),  # of its random numbers
    # Its reception: what it hears in mW; at what power what it receives, without error with which
    # chance so far (its log), interference accounted for until when. Until when it looks for
    # preambles, what it heard before that, and which part of the interference it is not aware of.
    ("heard", "f8"), ("power", "f8"), ("chance", "f8"), ("until", "i8"), ("search", "i8"),
    ("before", "f8"), ("unaware", "f8"),
    # By how many ns its slots come later than they would if nothing took time to propagate, and
    # when the strongest of these signals came, so counted.
    ("lag", "i8"), ("came", "i8"),
    # Contention: from when on slots count (before that the medium has to be idle for DIFS or EIFS);
    # for how long the medium was busy, while it is less the time when it became so; until when it
    # is reserved; until when EIFS lasts (``NEVER``: it begins when the medium is idle); since when
    # the present packet is ready to go. Until when something should be heard of what an RTS has
    # announced, and its reservation if it is.
    ("since", "i8"), ("occupied", "i8"), ("nav", "i8"), ("eifs", "i8"), ("ready", "i8"),
    ("doubt", "i8"), ("announced", "i8"),
    # What is due next: of its contention (START, TIMEOUT), its transmission (DETECT, HEADER, END),
    # and the answer that it owes.
    ("contention", "i8"), ("air", "i8"), ("answer", "i8"),
    # When its transmission has begun and will end.
    ("begun", "i8"), ("ends", "i8"),
    # Counters: transmissions of data, failed ones (no reply), packets given up.
    ("transmitted", "i4"), ("failures", "i4"), ("dropped", "i4"),
    ("index", "i4"),  # its number
    ("first", "i4"), ("last", "i4"),  # links[first:last] are those that hear it
    # How many signals it hears, whose it receives (-1: none), and whose is the strongest that came
    # since it looks for preambles.
    ("signals", "i4"), ("lock", "i4"), ("strongest", "i4"),
    # How many draws there were of slots that are left, of a window.
    ("draws", "i4"), ("count", "i2"), ("window", "i2"),
    # Its queue, a ring: how many packets of the first frame are done, its position, how many frames
    # there are.
    ("part", "i4"), ("head", "i2"), ("length", "i2"),
    # To whom it transmits (-1: all), for how long after that the medium is reserved; how many
    # transmissions there were. Whom to answer.
    ("to", "i4"), ("reserve", "i4"), ("number", "i4"), ("peer", "i4"),
    # Failures of the present packet; of the station in a row.
    ("tries", "u1"), ("failed", "u1"),
    # Whether the medium is busy; what it does; whether its receiver has the present packet. Whether
    # it takes no notice of energy until something new comes; whether it goes without a backoff if
    # the medium stays idle.
    ("busy", "i1"), ("role", "i1"), ("got", "i1"), ("deaf", "i1"), ("direct", "i1"),
    # Whether it is on the air, with what, at which rate; what to answer.
    ("on", "i1"), ("kind", "i1"), ("rate", "i1"), ("reply", "i1"), ("_", "i1"),
])

# A frame in a queue: until when it may begin, receiver (-1: all), how many packets, size of each
# and of the last one; their airtimes, those of acknowledgements and control frames, and the rates
# of all that; ``rts_ns`` 0: no RTS.
FRAME = np.dtype([("expires", "i8"), ("dest", "i4"), ("packets", "i4"), ("size_bytes", "i4"),
                  ("last_bytes", "i4"), ("air_ns", "i4"), ("last_ns", "i4"), ("ack_ns", "i4"),
                  ("rts_ns", "i4"), ("cts_ns", "i4"), ("rate", "i1"), ("ack_rate", "i1"),
                  ("rts_rate", "i1")])

# Who hears, how long it is on the way there, and at which power.
LINK = np.dtype([("station", "i4"), ("delay", "i4"), ("mw", "f8")])

# When header and payload begin, counted from the beginning, and the rate of the header. Of OFDM:
# bits of a symbol, its time, silence behind the frame. Rate of the reply; airtimes of control
# frames.
RATE = np.dtype([("bps", "f8"), ("header_ns", "i8"), ("payload_ns", "i8"), ("header_rate", "i8"),
                 ("bits", "i8"), ("symbol_ns", "i8"), ("extension_ns", "i8"), ("reply_rate", "i8"),
                 ("ack_ns", "i8"), ("rts_ns", "i8"), ("cts_ns", "i8")])

OUTCOME = np.dtype([("time_ns", "i8"), ("what", "i8"), ("station", "i8"), ("position", "i8"),
                    ("receiver", "i8"), ("packet", "i8")])

# ``energy_mw`` makes the medium busy; a preamble is found above ``signal_mw`` and a ratio of
# ``capture`` to noise and interference; above the ratio ``clear`` no bit has an error; the table
# of errors begins at ``table_db``, in steps of ``step_db``. ``unaware``: see ``arrive``,
# ``gives_up``: ``read_header``, ``eifs_at_end``: ``rest``,
# ``pause_ns``: what is queued on an idle medium waits for. ``judged``:
# whether somebody judges what unicast transmissions come to. ``outcomes``: how many were noted.
SETUP = np.dtype([("slot_ns", "i8"), ("sifs_ns", "i8"), ("difs_ns", "i8"), ("eifs_ns", "i8"),
                  ("detection_ns", "i8"), ("cw_min", "i8"), ("cw_max", "i8"),
                  ("try_limit", "i8"), ("reset_at", "i8"), ("noise_mw", "f8"),
                  ("energy_mw", "f8"), ("signal_mw", "f8"), ("capture", "f8"),
                  ("clear", "f8"), ("table_db", "f8"), ("step_db", "f8"),
                  ("unaware", "i8"), ("eifs_at_end", "i8"), ("gives_up", "i8"),
                  ("pause_ns", "i8"), ("judged", "i8"),
                  ("outcomes", "i8")])


class Dcf(NamedTuple):
    """The arrays that the functions below work on.

    stations [n] | due [blocks * (1 + BLOCK)] the least of each block of stations, -1 if that is not
    known, and behind them what is due next at each station | touched [1 + n, 2] which stations may
    have changed since their future was the same: how many, then the list, and beside it whether
    each is in it | frames [n, limit] rings | links | rates | table [rates, k]
    log(-log(chance that a bit has no error)) | setup [1] | outcomes, room for more than 2 n |
    choices [n, n] the rate from whom to whom, or [0, 0]: each frame has its own
    """

    stations: np.ndarray
    due: np.ndarray
    touched: np.ndarray
    frames: np.ndarray
    links: np.ndarray
    rates: np.ndarray
    table: np.ndarray
    setup: np.ndarray
    outcomes: np.ndarray
    choices: np.ndarray


_i8, _f8 = int64, float64
a_station, a_setup = from_dtype(STATION), from_dtype(SETUP)
all_due, all_rates, a_table = _i8[::1], from_dtype(RATE)[::1], _f8[:, ::1]
a_dcf = types.NamedTuple((a_station[::1], all_due, _i8[:, ::1], from_dtype(FRAME)[:, ::1],
                         from_dtype(LINK)[::1], all_rates, a_table, a_setup[::1],
                         from_dtype(OUTCOME)[::1], int8[:, ::1]), Dcf)


@intrinsic
def _pointer(typing_context, address):
    """The memory at an address."""
    def code(context, builder, signature, arguments):
        return builder.inttoptr(arguments[0], context.get_value_type(types.voidptr))
    return types.voidptr(int64), code


@njit(a_dcf(_i8[:, ::1]), cache=True)
def view(at):
    """The arrays at the given addresses: ``at`` has a row for each field of ``Dcf``, address and
    shape. Passing the Python arrays would work, but unpacking ten of them takes 2.0 us at each
    call, looking them up here 0.16 us; many calls take less than the difference."""
    return Dcf(carray(_pointer(at[0, 0]), (at[0, 1],), STATION),
               carray(_pointer(at[1, 0]), (at[1, 1],), np.int64),
               carray(_pointer(at[2, 0]), (at[2, 1], at[2, 2]), np.int64),
               carray(_pointer(at[3, 0]), (at[3, 1], at[3, 2]), FRAME),
               carray(_pointer(at[4, 0]), (at[4, 1],), LINK),
               carray(_pointer(at[5, 0]), (at[5, 1],), RATE),
               carray(_pointer(at[6, 0]), (at[6, 1], at[6, 2]), np.float64),
               carray(_pointer(at[7, 0]), (at[7, 1],), SETUP),
               carray(_pointer(at[8, 0]), (at[8, 1],), OUTCOME),
               carray(_pointer(at[9, 0]), (at[9, 1], at[9, 2]), np.int8))


@lean(void(a_dcf, a_station))
def touch(d, s):
    """Station s may have changed."""
    touched = d.touched
    if touched[1 + s.index, 1] == 0:
        touched[1 + s.index, 1] = 1
        touched[0, 0] += 1
        touched[touched[0, 0], 0] = s.index


@lean(void(all_due, a_station))
def schedule(due, s):
    """The next event of station s has changed."""
    b, place = s.index // BLOCK, due.size // (1 + BLOCK) + s.index
    before, after = due[place], min(s.air, min(s.contention, s.answer))
    due[place] = after
    if after < due[b]:
        due[b] = after
    elif before == due[b]:
        due[b] = -1


@lean(_i8(all_due))
def soonest(due):
    """The block with the first event."""
    first, blocks = 0, due.size // (1 + BLOCK)
    for b in range(blocks):
        if due[b] < 0:
            least = NEVER
            for place in range(blocks + b * BLOCK, blocks + (b + 1) * BLOCK):
                least = min(least, due[place])
            due[b] = least
        if due[b] < due[first]:
            first = b
    return first


@lean(_i8(all_due, _i8))
def pick(due, b):
    """The station of a block whose turn it is; if there are several, from either end, so that
    nobody is always the first in an instant."""
    what, i, step = due[b], b * BLOCK, 1
    if uniform_half_open(np.uint64(0), np.uint64(what)) < 0.5:
        i, step = i + BLOCK - 1, -1
    while due[due.size // (1 + BLOCK) + i] != what:
        i += step
    return i

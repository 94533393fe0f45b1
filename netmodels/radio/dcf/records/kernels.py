"""What the stations of a DCF are: records in arrays, where the arrays are, and what is due next."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import carray, float64, from_dtype, int64, njit, types, void
from numba.extending import intrinsic

from netmodels.kernels import uniform

NEVER = np.int64(1) << 62

# What may be due, in the order of what happens first in one instant. A time and what is due then
# are one number, ``time_ns * KINDS + kind``, so that the smallest comes next.
END, TIMEOUT, ANSWER, START, DETECT, KINDS = 0, 1, 2, 3, 4, 8

BLOCK = 32  # stations whose next events have a common minimum

IDLE, SENDING, AWAITING = range(3)  # what a station does about its present packet
RTS, CTS, DATA, ACK = range(4)
RECEIVED, MISSED, DONE, DROPPED = range(4)  # outcomes


STATION = np.dtype([
    # What is due next: of its transmission (DETECT, END), its contention (START, TIMEOUT), and the
    # answer that it owes.
    ("air", "i8"), ("contention", "i8"), ("answer", "i8"),
    ("index", "i8"), ("key", "u8"),  # its number; of its random numbers
    ("first", "i8"), ("last", "i8"),  # links[first:last] are those that hear it
    # Contention. ``count`` slots are left from ``since`` on; before that the medium has to be idle
    # for DIFS or EIFS. ``nav``: until when the medium is reserved. ``tries``: failures of the
    # present packet; ``failed``: of the station in a row. ``expired``: a reply is overdue, but
    # something is being received that may be it.
    ("count", "i8"), ("since", "i8"), ("busy", "i8"), ("nav", "i8"), ("window", "i8"),
    ("tries", "i8"), ("failed", "i8"), ("role", "i8"), ("expired", "i8"), ("draws", "i8"),
    # Its queue, a ring: the first frame's position, how many there are, how many packets of the
    # first are done, since when the present packet is ready to go, whether its receiver has it.
    ("head", "i8"), ("length", "i8"), ("part", "i8"), ("ready", "i8"), ("got", "i8"),
    # Its reception: what it hears in mW, of how many; whose transmission it receives (-1: none),
    # at what power, without error with which chance so far (its log), interference accounted for
    # until when; whom to answer, and with what.
    ("heard", "f8"), ("signals", "i8"), ("lock", "i8"), ("power", "f8"),
    ("chance", "f8"), ("until", "i8"), ("peer", "i8"), ("reply", "i8"),
    # Until when it looks for preambles, what it heard before that, whose signal is the strongest
    # that came since, and which part of the interference it is not aware of.
    ("search", "i8"), ("before", "f8"), ("strongest", "i8"), ("unaware", "f8"),
    # Its transmission: whether it is on the air, since when, to whom (-1: all), with what, at which
    # rate, for how long after its end the medium is reserved; how many there were.
    ("on", "i8"), ("begun", "i8"), ("to", "i8"), ("kind", "i8"), ("rate", "i8"),
    ("reserve", "i8"), ("number", "i8"), ("ends", "i8"),
    # Counters: transmissions of data, failed ones (no reply), frames given up.
    ("transmitted", "i8"), ("failures", "i8"), ("dropped", "i8"),
])

# A frame in a queue: receiver (-1: all), how many packets, airtime of each and of the last one,
# their rate, airtimes of the control frames and their rates; ``rts_ns`` 0: no RTS.
FRAME = np.dtype([("dest", "i8"), ("packets", "i8"), ("air_ns", "i8"), ("last_ns", "i8"),
                  ("rate", "i8"), ("ack_ns", "i8"), ("ack_rate", "i8"), ("rts_ns", "i8"),
                  ("cts_ns", "i8"), ("rts_rate", "i8")])

LINK = np.dtype([("station", "i8"), ("mw", "f8")])  # who hears, and at which power

# When header and payload begin, counted from the beginning, and the rate of the header.
RATE = np.dtype([("bps", "f8"), ("header_ns", "i8"), ("payload_ns", "i8"),
                 ("header_rate", "i8")])

OUTCOME = np.dtype([("time_ns", "i8"), ("what", "i8"), ("station", "i8"), ("position", "i8"),
                    ("receiver", "i8")])

# ``energy_mw`` makes the medium busy; a preamble is found above ``signal_mw`` and a ratio of
# ``capture`` to noise and interference; above the ratio ``clear`` no bit has an error; the table
# of errors begins at ``table_db``, in steps of ``step_db``. ``unaware``: see ``arrive``.
# ``outcomes``: how many were noted.
SETUP = np.dtype([("slot_ns", "i8"), ("sifs_ns", "i8"), ("difs_ns", "i8"), ("eifs_ns", "i8"),
                  ("detection_ns", "i8"), ("cw_min", "i8"), ("cw_max", "i8"),
                  ("try_limit", "i8"), ("reset_at", "i8"), ("noise_mw", "f8"),
                  ("energy_mw", "f8"), ("signal_mw", "f8"), ("capture", "f8"),
                  ("clear", "f8"), ("table_db", "f8"), ("step_db", "f8"),
                  ("unaware", "i8"), ("outcomes", "i8")])


class Dcf(NamedTuple):
    """What the functions below work on.

    stations [n] | due [blocks, 1 + BLOCK] what is due next at each station of a block, behind the
    least of them, -1 if that is not known | touched [n] whether a station may have changed since
    its future was the same | frames [n, limit] rings | links | rates | table [rates, k]
    log(-log(chance that a bit has no error)) | setup [1] | outcomes, room for more than 2 n
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


_i8, _f8 = int64, float64
a_station, a_setup = from_dtype(STATION), from_dtype(SETUP)
all_due, all_rates, a_table = _i8[:, ::1], from_dtype(RATE)[::1], _f8[:, ::1]
a_dcf = types.NamedTuple((a_station[::1], all_due, _i8[::1], from_dtype(FRAME)[:, ::1],
                         from_dtype(LINK)[::1], all_rates, a_table, a_setup[::1],
                         from_dtype(OUTCOME)[::1]), Dcf)


@intrinsic
def _pointer(typing_context, address):
    """The memory at an address."""
    def code(context, builder, signature, arguments):
        return builder.inttoptr(arguments[0], context.get_value_type(types.voidptr))
    return types.voidptr(int64), code


@njit(a_dcf(_i8[:, ::1]), cache=True)
def view(at):
    """The arrays at addresses: ``at`` has a row for each field of ``Dcf``, address and shape.
    Python's arrays would do as well, but they would be unpacked at each call and their references
    counted at each use, which takes longer than all the rest."""
    return Dcf(carray(_pointer(at[0, 0]), (at[0, 1],), STATION),
               carray(_pointer(at[1, 0]), (at[1, 1], at[1, 2]), np.int64),
               carray(_pointer(at[2, 0]), (at[2, 1],), np.int64),
               carray(_pointer(at[3, 0]), (at[3, 1], at[3, 2]), FRAME),
               carray(_pointer(at[4, 0]), (at[4, 1],), LINK),
               carray(_pointer(at[5, 0]), (at[5, 1],), RATE),
               carray(_pointer(at[6, 0]), (at[6, 1], at[6, 2]), np.float64),
               carray(_pointer(at[7, 0]), (at[7, 1],), SETUP),
               carray(_pointer(at[8, 0]), (at[8, 1],), OUTCOME))


@njit(void(all_due, a_station), cache=True, error_model="numpy")
def schedule(due, s):
    """What is due next at station s has changed."""
    block, row = due[s.index // BLOCK], 1 + s.index % BLOCK
    before, after = block[row], min(s.air, min(s.contention, s.answer))
    block[row] = after
    if after < block[0]:
        block[0] = after
    elif before == block[0]:
        block[0] = -1


@njit(_i8(all_due), cache=True, error_model="numpy")
def soonest(due):
    """The block with what is due first."""
    first = 0
    for b in range(due.shape[0]):
        block = due[b]
        if block[0] < 0:
            least = NEVER
            for row in range(1, BLOCK + 1):
                least = min(least, block[row])
            block[0] = least
        if block[0] < due[first, 0]:
            first = b
    return first


@njit(_i8(_i8[::1], _i8), cache=True, error_model="numpy")
def pick(block, what):
    """The row of a block where ``what`` is due; if there are several, from either end, so that
    nobody is always the first in an instant."""
    row, step = 1, 1
    if uniform(np.uint64(0), np.uint64(what)) < 0.5:
        row, step = BLOCK, -1
    while block[row] != what:
        row += step
    return row

"""The state of the stations as records (``netmodels.kernels``), and the agenda of their events.

Beside them the rates and airtimes of frames, which are fields of their records.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from desim.ports.kernels import carray, from_dtype, inner, kernel, types, uniform_half_open
from netmodels.kernels import pointer

float64, int16, int64, void = types.float64, types.int16, types.int64, types.void

NEVER = 1 << 62

# Kinds of events, in the order in which they are carried out in one instant. Fields that end in
# ``_due`` hold a time and a kind in one number, ``time_ns * KINDS + kind``: the least comes next.
END, TIMEOUT, ANSWER, START, DETECT, HEADER, PART, KINDS = 0, 1, 2, 3, 4, 5, 6, 8

BLOCK = 32  # stations whose next events have a common minimum

OTHER = 2  # of ``on_air``: another contender with this radio is
IDLE, SENDING, AWAITING = range(3)  # the role of a station: it awaits a reply
# ACK: of a block of packets, too; REQUEST: for that; CF_END: the rest of a TXOP is free.
# NEXT: whatever a station begins its next exchange with.
RTS, CTS, DATA, ACK, REQUEST, CF_END, NEXT = range(7)
# Outcomes.
RECEIVED, MISSED, DONE, DROPPED, EXPIRED, TRIED, HEARD, GIVEN_UP, LAPSED = range(9)
# Of a choice, beside its rate: no aggregate; an RTS first.
RATE_BITS, ALONE, WITH_RTS = 255, 256, 512


WORDS = 4  # of 64 packets each, in the longest aggregate
VOICE = 3  # the highest rank of data

# A station is a radio and a contender for the air. One that sends in several access categories has
# another contender for each further one: a record that sends, but hears nothing itself. What its
# radio hears of the medium is copied into it.
STATION = np.dtype([  # 341 B, for the future is tried out on copies
    ("key", "u8"),  # of its random numbers
    # Reception. All signals that it hears; the one that it receives, the log of the chance that
    # this has had no error yet, and until when its interference is accounted for. Until when the
    # search for preambles lasts, what was heard before it, and the part of the interference that
    # ns-3's receiver does not see (``arrive``).
    ("heard_mw", "f8"), ("power_mw", "f8"), ("log_chance", "f8"), ("accounted_ns", "i8"),
    ("search_ends_ns", "i8"), ("heard_before_mw", "f8"), ("unaware_mw", "f8"),
    # How much later its slots begin than they would without propagation, and when the strongest
    # signal of this search came, counted in the same way.
    ("lag_ns", "i8"), ("came_ns", "i8"),
    # Contention. When slots begin to count (before, the medium is idle for DIFS or EIFS); for how
    # long the medium was busy (while it is: less the time when it became so); the ends of its
    # reservation (NAV) and of EIFS (``NEVER``: EIFS begins when the medium is idle); since when the
    # present packet is ready. When the NAV of an RTS is reset unless a frame follows, and that NAV.
    ("slots_from_ns", "i8"), ("occupied_ns", "i8"), ("nav_ns", "i8"), ("eifs_ends_ns", "i8"),
    ("ready_ns", "i8"), ("nav_timeout_ns", "i8"), ("announced_nav_ns", "i8"),
    # Its next events: of contention (START, TIMEOUT), of its transmission (DETECT, HEADER, PART,
    # END), and the answer that it owes (ANSWER).
    ("contention_due", "i8"), ("air_due", "i8"), ("answer_due", "i8"),
    # Its transmission, and for how long it has been sending, that one included up to its end.
    ("begun_ns", "i8"), ("ends_ns", "i8"), ("sent_ns", "i8"),
    # Counters: transmissions of data, attempts without a reply, packets given up.
    ("transmitted", "i4"), ("failures", "i4"), ("dropped", "i4"),
    ("index", "i4"),  # its number
    ("first_link", "i4"), ("last_link", "i4"),  # links[first_link:last_link] are those who hear it
    # The number of signals that it hears; the station that it receives (-1: none), and the one with
    # the strongest signal since the search for preambles began.
    ("signals", "i4"), ("receives_from", "i4"), ("strongest", "i4"),
    # Backoff: the number of draws so far, slots that are left, the contention window in slots.
    ("draws", "i4"), ("slots_left", "i2"), ("window", "i2"),
    # Its queue, a ring of frames: the present packet of the first frame, where that is, how many
    # frames there are.
    ("packet", "i4"), ("queue_head", "i2"), ("queue_length", "i2"),
    # Its transmission: the receiver (-1: all), for how long after it the medium is reserved, its
    # number. The station to answer.
    ("dest", "i4"), ("reserve_ns", "i4"), ("transmission", "i4"), ("answer_to", "i4"),
    # Of the exchange that it begins: airtimes of data and acknowledgement.
    ("data_ns", "i4"), ("reply_ns", "i4"),
    # Bit k, in words of 64: the k-th packet of the aggregate that it receives has an error. How
    # many packets the aggregate has that it sends (0: a single packet outside of a block).
    ("lost", "u8", (WORDS,)), ("carried", "i2"),
    ("tries", "u1"), ("failed_in_a_row", "u1"),  # of the present packet; of the station
    # Flags: the medium is busy; (its role;) the receiver has the present packet; energy does not
    # make the medium busy until a new signal comes; it may begin without a backoff.
    ("busy", "i1"), ("role", "i1"), ("delivered", "i2"), ("ignores_energy", "i1"),
    ("no_backoff", "i1"),
    # Whether it is on the air, with which kind of frame, at which rate; the kind of its answer.
    ("on_air", "i1"), ("kind", "i1"), ("rate", "i1"), ("reply_kind", "i1"),
    # Of its aggregate: an RTS goes first; it lacks a block acknowledgement, and asks for it first;
    # how many packets have been taken as arrived (``judge_packet``), and how many are over.
    ("guarded", "i1"), ("asks", "i1"), ("taken", "i2"), ("passed", "i2"),
    # Its access: slots of AIFS behind SIFS, the bits of the least window, and the largest window.
    ("aifsn", "i1"), ("least_bits", "i1"), ("largest", "i2"),
    # Its category's rank, from 0 for background to VOICE. Its TXOP limit (0: one exchange), and
    # the end of the present TXOP (0: there is none).
    ("rank", "i1"), ("txop_ns", "i4"), ("txop_ends_ns", "i8"),
    # The station whose radio it uses, the next contender of that (-1: none), and, of a radio, the
    # contender that has begun the last exchange.
    ("radio", "i4"), ("next", "i4"), ("holder", "i4"),
])

# A frame in a queue: until when it may begin, receiver (-1: all), number of packets, size of each
# and of the last one; airtimes of these, of acknowledgement and RTS, and their rates;
# ``rts_ns`` 0: no RTS. ``slot``: the place of its first packet in ``Dcf.packets``.
FRAME = np.dtype([("expires_ns", "i8"), ("dest", "i4"), ("packets", "i4"), ("size_bytes", "i4"),
                  ("last_bytes", "i4"), ("air_ns", "i4"), ("last_ns", "i4"), ("ack_ns", "i4"),
                  ("rts_ns", "i4"), ("rate", "i1"), ("ack_rate", "i1"),
                  ("rts_rate", "i1"), ("slot", "i4")])

# A station that hears another one: the delay and the power of the signal.
LINK = np.dtype([("station", "i4"), ("delay_ns", "i4"), ("power_mw", "f8")])

# ``standards.Rate`` and what follows from it: header and payload begin so long after the frame;
# the rate of the header; of OFDM, bits and duration of a symbol and the silence behind the frame;
# the rate of replies, and the airtimes of control frames.
RATE = np.dtype([("bps", "f8"), ("header_ns", "i8"), ("payload_ns", "i8"), ("header_rate", "i8"),
                 ("bits_per_symbol", "i8"), ("symbol_ns", "i8"), ("extension_ns", "i8"),
                 ("reply_rate", "i8"), ("ack_ns", "i8"), ("rts_ns", "i8"), ("cts_ns", "i8"),
                 ("block_ack_ns", "i8"), ("request_ns", "i8"), ("cf_end_ns", "i8")])

OUTCOME = np.dtype([("time_ns", "i8"), ("what", "i8"), ("station", "i8"), ("position", "i8"),
                    ("receiver", "i8"), ("packet", "i8")])

# ``eifs_ns``: EIFS without DIFS. ``energy_mw`` makes the medium busy; below ``idle_mw`` not for who
# has just sent, until a new signal comes. A preamble is found from ``signal_mw`` on, and from a
# ratio of ``capture_ratio`` to noise and interference; above the ratio ``clear_ratio`` no bit has
# an error; the table of errors begins at ``table_first_db``. ``unaware``: see ``arrive``,
# ``gives_up``: ``read_header``, ``eifs_at_end``: ``start_slots``. ``pauses``: a packet that comes
# while the medium is idle waits for AIFS. ``judged``: the caller judges each unicast transmission.
# Of aggregates: packets, bytes and ns at most, bytes of the delimiter that a packet gets in them
# alone; above how many bytes an RTS goes first; bytes of an A-MSDU at most, and of what a packet
# has beside its MSDU. ``block_limit``: ``try_limit`` of packets in a block; ``requests``: a missed
# block acknowledgement is asked for before anything else is sent; ``apart``: a receiver hands a
# packet on when it is over, not with the aggregate (``end_part``). ``first_counts``:
# ``sense_carrier``. ``outcomes``: how many were noted.
SETUP = np.dtype([("slot_ns", "i8"), ("sifs_ns", "i8"), ("eifs_ns", "i8"),
                  ("detection_ns", "i8"),
                  ("try_limit", "i8"), ("reset_at", "i8"), ("noise_mw", "f8"),
                  ("energy_mw", "f8"), ("idle_mw", "f8"), ("signal_mw", "f8"),
                  ("capture_ratio", "f8"),
                  ("clear_ratio", "f8"), ("table_first_db", "f8"), ("table_step_db", "f8"),
                  ("unaware", "i8"), ("eifs_at_end", "i8"), ("gives_up", "i8"),
                  ("pauses", "i8"), ("judged", "i8"), ("most_packets", "i8"),
                  ("most_bytes", "i8"), ("most_ns", "i8"), ("delimiter_bytes", "i8"),
                  ("rts_bytes", "i8"), ("amsdu_bytes", "i8"), ("head_bytes", "i8"),
                  ("block_limit", "i8"), ("requests", "i8"), ("apart", "i8"),
                  ("first_counts", "i8"), ("outcomes", "i8")])


class Dcf(NamedTuple):
    """The state of all stations.

    stations [n] | due [blocks * (1 + BLOCK)] the least of each block of stations, -1 if that is not
    known, and behind them the next event of each station | touched [1 + n, 2] the stations that may
    have changed since their future was the same: how many, then the list, and beside it whether
    each is in it | frames [n, limit] rings | links | rates | table [rates, k]
    log(-log(chance that a bit has no error)) | setup [1] | outcomes, for more than 2 n |
    choices [n, n] how each sender sends to each receiver, or [0, 0]: each frame has its own rate |
    times [n, 10] the parts of frames' time (``kernels.times``), or [0, 10]: nobody asks |
    packets [n, limit] the states of the packets in each queue, a ring (``kernels.aggregates``), or
    [0, limit]: nobody aggregates
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
    times: np.ndarray
    packets: np.ndarray


_i8, _f8 = int64, float64
a_station, a_setup = from_dtype(STATION), from_dtype(SETUP)
_rate, _frame = from_dtype(RATE), from_dtype(FRAME)
all_due, all_touched, all_rates, a_table = _i8[::1], _i8[:, ::1], _rate[::1], _f8[:, ::1]
all_stations = a_station[::1]
a_dcf = types.NamedTuple((all_stations, all_due, all_touched, _frame[:, ::1],
                         from_dtype(LINK)[::1], all_rates, a_table, a_setup[::1],
                         from_dtype(OUTCOME)[::1], int16[:, ::1], _i8[:, ::1],
                         types.uint16[:, ::1]), Dcf)


@kernel(a_dcf(_i8[:, ::1]), inner=True)
def arrays_at(rows):
    """The state whose addresses are in ``rows``, those of one of ``Addresses.states``."""
    return Dcf(carray(pointer(rows[0, 0]), (rows[0, 1],), STATION),
               carray(pointer(rows[1, 0]), (rows[1, 1],), np.int64),
               carray(pointer(rows[2, 0]), (rows[2, 1], rows[2, 2]), np.int64),
               carray(pointer(rows[3, 0]), (rows[3, 1], rows[3, 2]), FRAME),
               carray(pointer(rows[4, 0]), (rows[4, 1],), LINK),
               carray(pointer(rows[5, 0]), (rows[5, 1],), RATE),
               carray(pointer(rows[6, 0]), (rows[6, 1], rows[6, 2]), np.float64),
               carray(pointer(rows[7, 0]), (rows[7, 1],), SETUP),
               carray(pointer(rows[8, 0]), (rows[8, 1],), OUTCOME),
               carray(pointer(rows[9, 0]), (rows[9, 1], rows[9, 2]), np.int16),
               carray(pointer(rows[10, 0]), (rows[10, 1], rows[10, 2]), np.int64),
               carray(pointer(rows[11, 0]), (rows[11, 1], rows[11, 2]), np.uint16))


@inner(_i8(_rate, _i8))
def airtime_ns(how, size_bytes):
    """The same as ``Standard.airtime_ns``. OFDM: whole symbols; DSSS: whole us."""
    if how.symbol_ns > 0:
        symbols = -(-(16 + 8 * size_bytes + 6) // how.bits_per_symbol)
        return how.payload_ns + symbols * how.symbol_ns + how.extension_ns
    return how.payload_ns - 1000 * (-8 * size_bytes * 1_000_000 // np.int64(how.bps))


@inner(void(all_rates, _frame, _i8, _i8))
def set_rate(rates, frame, rate, rts):
    """Set a frame's rate and airtimes; with ``rts`` 1 an RTS goes first. Control frames that begin
    an exchange go at the lowest rate of the modulation."""
    how = rates[rate]
    frame.rate, frame.rts_rate = rate, how.header_rate
    frame.air_ns = airtime_ns(how, frame.size_bytes)
    frame.last_ns = airtime_ns(how, frame.last_bytes)
    frame.ack_ns, frame.ack_rate = (how.ack_ns, how.reply_rate) if frame.dest >= 0 else (0, 0)
    frame.rts_ns = how.rts_ns if rts == 1 else 0


@inner(void(all_touched, a_station))
def mark_changed(touched, s):
    """Remember that station s may have changed."""
    if touched[1 + s.index, 1] == 0:
        touched[1 + s.index, 1] = 1
        touched[0, 0] += 1
        touched[touched[0, 0], 0] = s.index


@inner(void(a_dcf, a_station))
def mark_packets_changed(d, s):
    """Remember that the states of station s's packets may have changed, too."""
    mark_changed(d.touched, s)
    d.touched[1 + s.index, 1] = 2


@inner(_i8(a_setup, a_station))
def aifs_ns(setup, s):
    """The time for which the medium is idle before station s counts slots: AIFS, without QoS DIFS.
    """
    return setup.sifs_ns + s.aifsn * setup.slot_ns


@inner(void(a_station))
def reset_window(s):
    """Station s's contention window is the least again."""
    s.window = (1 << np.int64(s.least_bits)) - 1


@inner(void(all_due, a_station))
def schedule(due, s):
    """Enter the next event of station s, which has changed, among those of its block."""
    b, place = s.index // BLOCK, due.size // (1 + BLOCK) + s.index
    before, after = due[place], min(s.air_due, min(s.contention_due, s.answer_due))
    due[place] = after
    if after < due[b]:
        due[b] = after
    elif before == due[b]:
        due[b] = -1


@inner(_i8(all_due))
def first_block(due):
    """The block of stations with the first event."""
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


@inner(_i8(all_due, _i8))
def station_due(due, b):
    """The station of block b with the first event. Of several in one instant it is the first or the
    last one, by chance, so that no station always goes first."""
    what, i, step = due[b], b * BLOCK, 1
    if uniform_half_open(np.uint64(0), np.uint64(what)) < 0.5:
        i, step = i + BLOCK - 1, -1
    while due[due.size // (1 + BLOCK) + i] != what:
        i += step
    return i

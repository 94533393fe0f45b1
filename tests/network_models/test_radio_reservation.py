"""Stations that leave the medium to others, and for how long: NAV, EIFS, the wait for a reply.

802.11-2016, 10.3.2.3.7, 10.3.2.4, 10.3.2.9, against timelines worked out by hand. Each has a twin
in which one thing is different, and the time with it.

802.11a, and no backoff at all: SIFS 16 us, slot 9, DIFS 34, EIFS 16 + 44 + 34 = 94. At 54 Mb/s
1064 B take 180 us, 28 B 28 us; the acknowledgement at 24 Mb/s takes 28 us; RTS and CTS at 6 Mb/s
52 and 44 us.
"""

from dataclasses import replace

import numpy as np
import pytest
from stations import air

from netmodels.radio.dcf.stations import DONE, DROPPED, NEVER, RECEIVED, Reception
from netmodels.radio.standards import A

STANDARD = replace(A, cw_min=0, cw_max=0)
BY_THE_STANDARD = Reception()
BROKEN, UNNOTICED, WELL = -80.0, -85.0, -50.0  # dBm of a frame at 54 Mb/s: 14 dB above the noise


def scene(tries=1, reception=BY_THE_STANDARD, **heard_dbm):
    """Stations that hear each other as ``_0_2=-50`` says: 0's signal comes to 2 with -50 dBm."""
    power_mw = np.zeros((6, 6))
    for pair, dbm in heard_dbm.items():
        source, hearer = map(int, pair[1:].split("_"))
        power_mw[source, hearer] = 10 ** (dbm / 10)
    return air(STANDARD, power_mw, tries=tries, reception=reception)


def sends(stations, at_us, source, dest=-1, size_bytes=1064, mbps=54, rts=False):
    """Whatever was decided before is of no interest."""
    while stations.next_ns < at_us * 1000:
        stations.advance(stations.next_ns)
    stations.enqueue(at_us * 1000, source, dest, size_bytes, A.rate(mbps), rts=rts)


def when(stations, source, what=DONE):
    """The first time in us."""
    log = []
    while stations.next_ns < NEVER:
        log += stations.advance(stations.next_ns)
    return min(time_ns for time_ns, *rest in log if rest[:2] == [what, source]) / 1000


def bystander_begins(stations):
    """Station 2 has a packet of 28 us to send, to nobody in particular."""
    return when(stations, 2) - 28


@pytest.mark.parametrize(("data_dbm", "begins_us"), [
    (WELL, 180 + 16 + 28 + 34), (BROKEN, 180 + 94), (UNNOTICED, 10)])
def test_who_hears_data_but_not_the_acknowledgement(data_dbm, begins_us):
    """A station that can read it leaves the medium as long as it says; one that cannot, for
    EIFS."""
    stations = scene(_0_1=WELL, _1_0=WELL, _0_2=data_dbm)
    sends(stations, 0, 0, 1)
    sends(stations, 10, 2, size_bytes=28)
    assert bystander_begins(stations) == begins_us


@pytest.mark.parametrize(("reply_dbm", "begins_us"), [(WELL, 224 + 34), (UNNOTICED, 180 + 94)])
def test_what_can_be_read_ends_eifs(reply_dbm, begins_us):
    stations = scene(_0_1=WELL, _1_0=WELL, _0_2=BROKEN, _1_2=reply_dbm)
    sends(stations, 0, 0, 1)
    sends(stations, 10, 2, size_bytes=28)
    assert bystander_begins(stations) == begins_us


@pytest.mark.parametrize(("in_ns3", "begins_us"), [(False, 280 + 94), (True, 280 + 34)])
def test_eifs_begins_on_an_idle_medium_but_in_ns3(in_ns3, begins_us):
    """A second frame makes the first one unreadable and lasts 100 us longer. In ns-3 EIFS has begun
    with the end of the first one and is over by then."""
    stations = scene(_0_2=BROKEN, _3_2=-60.0, reception=Reception(eifs_at_end=in_ns3))
    sends(stations, 0, 0)
    sends(stations, 10, 2, size_bytes=28)
    sends(stations, 100, 3)
    assert bystander_begins(stations) == begins_us


@pytest.mark.parametrize(("reply_dbm", "begins_us"), [(UNNOTICED, 308 + 94), (WELL, 352 + 34)])
def test_eifs_does_not_wait_for_the_end_of_a_reservation(reply_dbm, begins_us):
    """RTS to 52, CTS 68 to 112, data 128 to 308, acknowledgement 324 to 352, where the reservation
    ends. The bystander can read control frames, but not the data."""
    stations = scene(_0_1=WELL, _1_0=WELL, _0_2=BROKEN, _1_2=reply_dbm)
    sends(stations, 0, 0, 1, rts=True)
    sends(stations, 10, 2, size_bytes=28)
    assert bystander_begins(stations) == begins_us


@pytest.mark.parametrize(("data_dbm", "begins_us"), [(BROKEN, 180 + 94), (UNNOTICED, 228 + 34)])
def test_eifs_is_not_cut_short_by_mere_energy(data_dbm, begins_us):
    """3 and 4 begin together at 200 us: to the bystander that is noise, until 228."""
    stations = scene(_0_2=data_dbm, _3_2=WELL, _4_2=WELL)
    sends(stations, 0, 0)
    for source in 3, 4:
        sends(stations, 200, source, size_bytes=28)
    sends(stations, 205, 2, size_bytes=28)
    assert bystander_begins(stations) == begins_us


@pytest.mark.parametrize(("data_dbm", "begins_us"), [(BROKEN, 476 + 94), (UNNOTICED, 476 + 34)])
def test_eifs_begins_when_the_medium_is_idle(data_dbm, begins_us):
    """The noise lasts from 100 to 476 us, and the frame that it covers ends at 180."""
    stations = scene(_0_2=data_dbm, _3_2=WELL, _4_2=WELL)
    sends(stations, 0, 0)
    for source in 3, 4:
        sends(stations, 100, source, mbps=24)
    sends(stations, 205, 2, size_bytes=28)
    assert bystander_begins(stations) == begins_us


@pytest.mark.parametrize(("other_us", "begins_us"), [
    (None, 166 + 34), (146, 352 + 34), (147, 175 + 34)])
def test_what_an_rts_reserves_is_given_up_if_nothing_follows(other_us, begins_us):
    """RTS to 52 us; 2 SIFS, 2 slots, CTS and 20 us of a header later, at 166 us, the bystander must
    have read the header of something: here of a frame that has nothing to do with it."""
    stations = scene(_0_2=WELL, _3_2=WELL)
    sends(stations, 0, 0, 1, rts=True)
    sends(stations, 10, 2, size_bytes=28)
    if other_us is not None:
        sends(stations, other_us, 3, size_bytes=28)
    assert bystander_begins(stations) == begins_us


@pytest.mark.parametrize(("rts_us", "what", "us"), [
    (1446, DROPPED, 1498 + 16 + 9 + 20), (1460, RECEIVED, 1512 + 16 + 44 + 16 + 1444)])
def test_who_leaves_the_medium_to_others_does_not_answer_an_rts(rts_us, what, us):
    """0's data for somebody else end at 1444 us, its acknowledgement (44 us) would at 1504. The RTS
    of 2, whom 0 does not reach, is over 52 us after its beginning."""
    stations = scene(_0_1=WELL, _2_1=WELL, _1_2=WELL)
    sends(stations, 0, 0, 5, mbps=6)
    sends(stations, rts_us, 2, 1, mbps=6, rts=True)
    assert when(stations, 2, what) == us


@pytest.mark.parametrize(("other_us", "failed_us"), [
    (None, 225), (182, 210), (205, 233), (206, 225)])
def test_who_hears_something_else_than_the_reply_has_failed(other_us, failed_us):
    """Data to 180 us; 16 + 9 + 20 us later the header of the reply must have been read. A frame of
    28 us whose header is read in time, but is not the reply, ends the wait with its own end."""
    stations = scene(_2_0=WELL)
    sends(stations, 0, 0, 1)
    if other_us is not None:
        sends(stations, other_us, 2, size_bytes=28)
    assert when(stations, 0, DROPPED) == failed_us


def test_a_sender_tries_again_a_difs_after_it_knows_that_it_has_failed():
    stations = scene(tries=2, _2_0=WELL)
    sends(stations, 0, 0, 1)
    sends(stations, 182, 2, size_bytes=28)
    assert when(stations, 0, DROPPED) == 210 + 34 + 180 + 45


@pytest.mark.parametrize(("gives_up", "begins_us"), [(False, 186 + 94), (True, 20 + 34)])
def test_a_receiver_of_ns3_gives_up_a_frame_whose_header_it_cannot_read(gives_up, begins_us):
    """Another frame begins 6 us after the first one, too late to be found. In ns-3 the medium is
    idle from the end of the broken header on, though both are on the air."""
    stations = scene(_0_2=BROKEN, _3_2=-60.0,
                     reception=Reception(energy_dbm=-82.0, gives_up=gives_up))
    sends(stations, 0, 0)
    sends(stations, 6, 3)
    sends(stations, 12, 2, size_bytes=28)
    assert bystander_begins(stations) == begins_us

"""The time at which a packet goes that comes while the medium is idle.

802.11-2016, 10.3.4.2: without a backoff if "the medium is idle when a frame is queued for
transmission, and remains idle for a period of a DIFS, or an EIFS from the end of the immediately
preceding medium-busy event"; ns-3 as traced there.

802.11a: DIFS 34 us, slot 9; 264 B take 376 us at 6 Mb/s. Station 0 is on the air until 1000 us.
"""

import pytest
from stations import air, same_power

from netmodels.radio.dcf.stations import DONE, NEVER, Reception
from netmodels.radio.standards import A

FRAME_US, DIFS_US, SLOT_US = 376, 34, 9
SEEDS = range(200)  # a slot that is never drawn: one in 25,000


def begins_us(queued_us, in_ns3=False, other_us=None, seed=1):
    """The time at which station 1's frame goes on the air, which is queued at ``queued_us``. It
    hears the two others, who do not hear each other; station 2's frame goes at ``other_us``."""
    power_mw = same_power(3)
    power_mw[0, 2] = power_mw[2, 0] = 0.0
    stations = air(A, power_mw, seed, reception=Reception(), difs_first=in_ns3)
    earlier_us = DIFS_US if in_ns3 else 0
    frames = [(1000 - FRAME_US - earlier_us, 0), (queued_us, 1)]
    if other_us is not None:
        frames.append((other_us - earlier_us, 2))
    log = []
    for time_us, source in sorted(frames):
        while stations.next_ns < time_us * 1000:
            log += stations.advance(stations.next_ns)
        stations.enqueue(time_us * 1000, source, -1, 264, A.rate(6))
    while stations.next_ns < NEVER:
        log += stations.advance(stations.next_ns)
    (ends_ns,) = (time_ns for time_ns, what, source, *_ in log if (what, source) == (DONE, 1))
    return ends_ns / 1000 - FRAME_US


@pytest.mark.parametrize(("in_ns3", "waits_us"), [(False, 0), (True, DIFS_US)])
def test_on_a_medium_that_has_been_idle_for_long(in_ns3, waits_us):
    assert begins_us(2000, in_ns3) == 2000 + waits_us


@pytest.mark.parametrize(("in_ns3", "counted_from_us"), [(False, 1000), (True, 1010)])
def test_less_than_difs_after_a_busy_medium_that_stays_idle(in_ns3, counted_from_us):
    """In ns-3 DIFS is counted from when the frame comes: 454 us if it comes at 420, 10 us after the
    end of another one."""
    assert begins_us(1010, in_ns3) == counted_from_us + DIFS_US


@pytest.mark.parametrize("in_ns3", [False, True])
def test_who_finds_the_medium_busy_needs_a_backoff(in_ns3):
    begun = {begins_us(900, in_ns3, seed=seed) for seed in SEEDS}
    assert begun == {1000 + DIFS_US + SLOT_US * slots for slots in range(16)}


@pytest.mark.parametrize(("in_ns3", "slots"), [(False, range(16)), (True, [0])])
def test_who_finds_it_busy_before_difs_is_over_needs_one_too_but_in_ns3(in_ns3, slots):
    """Traced in ns-3: what is queued 24 us before another frame begins, which ends at 410 us, goes
    at 444, with any seed."""
    begun = {begins_us(1010, in_ns3, other_us=1020, seed=seed) for seed in SEEDS}
    assert begun == {1020 + FRAME_US + DIFS_US + SLOT_US * k for k in slots}

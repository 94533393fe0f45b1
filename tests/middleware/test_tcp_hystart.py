"""Slow start ends before a loss, as Linux 6.1 ends it on the same network in simulated time."""

import pytest

from desim.middleware.headers import MSS_BYTES
from desim.middleware.tcp.hystart import HyStart
from desim.validation.tcp import EMULATOR_MS, Socket

MS = 10**6


def threshold():
    """The slow start threshold in segments after two seconds of a busy connection: 10 Mb/s, 20 ms,
    no loss."""
    socket = Socket(10, 20 - EMULATOR_MS, 0.0, 0)
    socket.goodput_mbps(160_000, 2)
    return socket.sender.ssthresh / MSS_BYTES


def test_the_queue_ends_it():
    """Linux: 59 segments. The path holds 35."""
    assert 50 <= threshold() <= 75


def test_without_it_the_window_grows_on(monkeypatch):
    """A twin."""
    monkeypatch.setattr(HyStart, "ends", lambda *_: False)
    assert threshold() > 1000


def rounds(rtts_ms, gap_ms=3.0, least_ms=40.0):
    """The number of the acknowledgement of one round that ends slow start, None: none does."""
    hystart = HyStart()
    for number, rtt_ms in enumerate(rtts_ms):
        if hystart.ends(number + 1, 1, 10**9, int(rtt_ms * MS), int(least_ms * MS),
                        int(number * gap_ms * MS)):
            return number
    return None


@pytest.mark.parametrize(("rtts_ms", "ends"), [
    ([46] * 20, 8),  # an eighth more, in eight samples
    ([44] * 20, None),
    ([46] * 5 + [44] + [60] * 20, None),  # the least of the round counts
])
def test_a_longer_round_trip_ends_it(rtts_ms, ends):
    assert rounds(rtts_ms) == ends


def test_a_long_train_ends_it():
    """Half of the least round trip, and a millisecond."""
    assert rounds([40] * 100, gap_ms=1.0) == 21
    assert rounds([40] * 100, gap_ms=2.1) is None

"""Settings that stand in no table: the radio against a Monte-Carlo of the rules.

These are the rules of the distributed coordination function as ns-3 has them. The Monte-Carlo knows
nothing of signals, queues or events.
"""

import random

import pytest

from desim.netcases.case import play
from netmodels.cases.saturation import Saturation
from netmodels.radio.standards import STANDARDS


def contend(standard, mbps, stations, payload_bytes, transmissions=40_000):
    """Mb/s of payload and the share of transmissions that fail. A station's next transmission is
    ``slots`` slots after ``ready_ns``; the slot in which somebody else begins is not counted. Who
    collided waits for the end of its acknowledgement timeout first; after 7 transmissions it gives
    up, after 8 failures in a row its window is the smallest again."""
    draw, rate = random.Random(3), standard.rate(mbps)
    data_ns = standard.airtime_ns(payload_bytes + 64, rate)
    reply_ns = standard.sifs_ns + standard.airtime_ns(14, standard.reply_rate(rate))
    timeout_ns = standard.sifs_ns + standard.slot_ns + 20_000
    window, failures = [standard.cw_min] * stations, [0] * stations
    ready_ns = [standard.difs_ns] * stations
    slots = [draw.randint(0, standard.cw_min) for _ in range(stations)]
    sent = failed = arrived = begin_ns = 0
    for _ in range(transmissions):
        times_ns = [ready + count * standard.slot_ns
                    for ready, count in zip(ready_ns, slots, strict=True)]
        begin_ns = min(times_ns)
        senders = [k for k, time_ns in enumerate(times_ns) if time_ns == begin_ns]
        alone = len(senders) == 1
        sent, arrived, failed = (sent + len(senders), arrived + alone,
                                 failed + (0 if alone else len(senders)))
        idle_ns = begin_ns + data_ns + standard.difs_ns + (reply_ns if alone else 0)
        for k in range(stations):
            slots[k] -= max(begin_ns - ready_ns[k], 0) // standard.slot_ns
            ready_ns[k] = idle_ns
        for k in senders:
            failures[k] = 0 if alone else (failures[k] + 1) % 8
            window[k] = (standard.cw_min if failures[k] == 0
                         else min(2 * window[k] + 1, standard.cw_max))
            slots[k] = draw.randint(0, window[k])
            ready_ns[k] += 0 if alone else timeout_ns
    return arrived * payload_bytes * 8e3 / begin_ns, failed / sent


@pytest.mark.parametrize(("standard", "mbps", "stations", "payload_bytes"), [
    ("11a", 54, 20, 200), ("11g", 6, 8, 500), ("11g", 24, 3, 700), *(
        pytest.param(*setting, marks=pytest.mark.validation)  # no other kinds of settings
        for setting in (("11a", 12, 15, 1500), ("11a", 36, 8, 1472)))])
def test_settings_that_stand_in_no_table(standard, mbps, stations, payload_bytes):
    """Within 1.5 %, and 0.015 of the failures."""
    found = play(Saturation(Saturation.Params(
        standard=standard, rate=f"{mbps} Mb/s", stations=stations,
        payload=f"{payload_bytes} B")).setup())
    goodput_mbps, failure_rate = contend(STANDARDS[standard], mbps, stations, payload_bytes)
    assert found["goodput_mbps"] == pytest.approx(goodput_mbps, rel=0.015)
    assert found["failure_rate"] == pytest.approx(failure_rate, abs=0.015)

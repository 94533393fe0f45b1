"""TCP against what can be computed without it. Each check has a twin: the same with one constant
5 to 10 % off, which it must refuse."""

from math import ceil, log2

import pytest
from graphs import MS, S
from tcphosts import Losing, Pair, link, partition

from netmodels.rules.loss import Loss

MSS, FRAME, ACK, SYN = 1448, 1518, 70, 78  # B


def bits_ns(size_bytes, rate_mbps):
    return size_bytes * 8 * 1000 // rate_mbps


# ------------------------------------------------------------------------------------- the checks


def handshake(latency_ms=20.0):
    """The client has waited for one round trip, SYN and SYN-ACK on the wire included."""
    pair = Pair(link(rate="10 Mb/s", latency=f"{latency_ms} ms"))
    pair.call()
    pair.run(S)
    return pair.log[0] == (2 * (20 * MS + bits_ns(SYN, 10)), "opened")


def slow_start(window=12):
    """``n`` segments take ceil(log2(n / 12 + 1)) flights, one a round trip, where the rate is no
    limit: the last one arrives after one round trip less and half a one."""
    for flights in 1, 2, 3, 4, 5, 6:
        most = 12 * (2**flights - 1)
        for n in (most * 2 // 3, most):
            pair = Pair(link(rate="100 Gb/s", latency="50 ms"),
                        params={"initial_window": window, "burst": "1 ms"})
            pair.call()
            pair.at(S, pair.say, 1, n * MSS).run(10 * S)
            expected_ms = (ceil(log2(n / 12 + 1)) - 0.5) * 100
            if abs((pair.heard()[0][0] - S) / MS - expected_ms) > 1:
                return False
    return True


def saturation(rate_mbps=10.0):
    """A long transfer uses the whole link: 1448 of 1518 B are payload."""
    size_bytes = 10**7
    pair = Pair(link(rate=f"{rate_mbps} Mb/s", latency="5 ms"))
    pair.call()
    pair.at(S, pair.say, 1, size_bytes).run(60 * S)
    goodput_mbps = size_bytes * 8000 / (pair.heard()[0][0] - S)
    return abs(goodput_mbps / (10 * MSS / FRAME) - 1) < 0.01


def retransmissions(loss=0.1):
    """A message and its acknowledgement get through with (1 - p)^2: one small message is sent
    1 / (1 - p)^2 times on average."""
    count = 6000
    pair = Pair(rules=[Loss(Loss.Params(probability=loss))])
    pair.call(keepalive=False)
    for k in range(count):
        pair.at((200 + 100 * k) * S, pair.say, k)
    pair.run((count + 20) * 100 * S)
    tries = len(pair.rows("frame")) / len(pair.heard())
    return len(pair.heard()) == count and abs(tries * (1 - 0.1)**2 - 1) < 0.015


def waking(rto_min_ms=200):
    """After an outage of T, the next timeout: the first of 0.2 s (2^k - 1) that is not in it."""
    for outage_s in 0.1, 0.5, 1, 3, 10, 60:
        pair = Pair(rules=[partition("100 s", f"{100 + outage_s} s")],
                    params={"rto_min": f"{rto_min_ms} ms"})
        pair.call()
        pair.at(100 * S, pair.say, 1).run(1000 * S)
        wakes_s = 0.2
        while wakes_s < outage_s:
            wakes_s = 2 * wakes_s + 0.2
        (heard_ns, _), = pair.heard()
        if abs(heard_ns / S - 100 - wakes_s) > 1e-6 or heard_ns / S - 100 > 2 * outage_s + 0.2:
            return False
    return True


def keepalive(interval_s=10.0):
    """A dead idle peer is found 60 + 9 * 10 s after its last sign of life."""
    pair = Pair(params={"keepalive_interval": f"{interval_s} s"})
    pair.call()
    pair.at(10 * S, pair.stop, 1).run(1000 * S)
    probes_s = [row[0] // S for row in pair.rows("control")][3:]
    return (pair.log[2:] == [(150 * S, "a closed", "timeout")]
            and probes_s == [*range(60, 150, 10), 150])


def calling(first_rto_s=1.0):
    """A SYN goes again after 1, 3, 7, 15, 31 and 63 s; after 127 s the caller gives up."""
    pair = Pair(params={"first_rto": f"{first_rto_s} s"})
    pair.stop(1)
    pair.call()
    pair.run(1000 * S)
    return ([row[0] // S for row in pair.rows("control")] == [0, 1, 3, 7, 15, 31, 63]
            and pair.log == [(127 * S, "a closed", "timeout")])


def giving_up(rto_max_s=120):
    """Fifteen retransmissions: 0.2 (2^10 - 1) + 6 * 120 = 924.6 s."""
    pair = Pair(params={"rto_max": f"{rto_max_s} s"})
    pair.call()
    pair.at(S, pair.stop, 1).at(2 * S, pair.say, 1).run(2000 * S)
    return (pair.log[2:] == [(926_600 * MS, "a closed", "timeout")]
            and len(pair.rows("frame")) == 16 and pair.at_rest())


def round_trip_times(latency_ms=150.0):
    """RFC 6298 on a path of 300 ms: the handshake gives SRTT = R, RTTVAR = R / 2; a message whose
    acknowledgement waits for 40 ms moves them by 1/8 and 1/4; the next timeout is SRTT + 4 RTTVAR
    after the message that is lost."""
    pair = Pair(link(rate="100 Gb/s", latency=f"{latency_ms} ms"), [Losing(4)])
    pair.call()
    pair.at(10 * S, pair.say, 1).at(20 * S, pair.say, 2).run(60 * S)
    srtt_ms, rttvar_ms = 300 + 40 / 8, 150 * 3 / 4 + 40 / 4
    sent_ns = [row[0] for row in pair.rows("frame")]
    return (len(sent_ns) == 3
            and abs((sent_ns[2] - sent_ns[1]) / MS - (srtt_ms + 4 * rttvar_ms)) < 1)


def avoidance(initial_window=40):
    """After a fast retransmission the window is half of what was on its way, then it grows by a
    segment each round trip: with 40 segments on their way, 20, 21, 22 ... of them a flight."""
    pair = Pair(link(rate="100 Gb/s", latency="50 ms"), [Losing(1, least_bytes=1000)],
                params={"initial_window": initial_window})
    pair.call()
    pair.at(S, pair.say, 1, 500 * MSS).run(10 * S)
    flights = {}
    for time_ns, *_, size_bytes in pair.rows("frame"):
        flight = (time_ns - S + MS) // (100 * MS)
        flights[flight] = flights.get(flight, 0) + size_bytes // FRAME
    sizes = list(flights.values())
    return all(abs(size - (20 + k)) <= 1 for k, size in enumerate(sizes[3:9]))


CHECKS = [(handshake, 21.0), (slow_start, 11), (saturation, 10.5), (retransmissions, 0.11),
          (waking, 210), (keepalive, 10.5), (calling, 1.1), (giving_up, 126),
          (round_trip_times, 160.0), (avoidance, 37)]


@pytest.mark.parametrize(("check", "twin"), CHECKS, ids=[check.__name__ for check, _ in CHECKS])
def test_check(check, twin):
    assert check()
    assert not check(twin)

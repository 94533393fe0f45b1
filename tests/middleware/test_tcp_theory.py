"""TCP against what can be computed without it.

Each check has a twin: the same with one constant 5 to 10 % off, which it must refuse.
"""

from math import ceil, log2

import pytest
from graphs import MS, S
from tcp_hosts import Losing, Pair, link, partition

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
    """After an outage of T, the next timeout: the first of 0.2 s 2^k, k >= 0, that is not in it (a
    probe after 0.2 s, the timeout 0.2 s later)."""
    for outage_s in 0.1, 0.5, 1, 3, 10, 60:
        pair = Pair(rules=[partition("100 s", f"{100 + outage_s} s")],
                    params={"rto_min": f"{rto_min_ms} ms", "tick": "0 ns"})
        pair.call()
        pair.at(100 * S, pair.say, 1).run(1000 * S)
        wakes_s = 0.2
        while wakes_s < outage_s:
            wakes_s *= 2
        (heard_ns, _), = pair.heard()
        if abs(heard_ns / S - 100 - wakes_s) > 1e-6 or heard_ns / S - 100 > 2 * outage_s + 0.2:
            return False
    return True


def keepalive(interval_s=10.0):
    """A dead idle peer is found 60 + 9 * 10 s after its last sign of life."""
    pair = Pair(params={"keepalive_interval": f"{interval_s} s", "tick": "0 ns"})
    pair.call()
    pair.at(10 * S, pair.stop, 1).run(1000 * S)
    probes_s = [row[0] // S for row in pair.rows("control")][3:]
    return (pair.log[2:] == [(150 * S, "a closed", "timeout")]
            and probes_s == [*range(60, 150, 10), 150])


def late_keepalive(interval_s=10.0):
    """Linux checks timers of 60 s every 512 ticks of 4 ms, those of 10 s every 64: the first of
    these instants after the 15,000 ticks and the 2500 ticks, 30 * 512 and 280 * 64."""
    pair = Pair(params={"keepalive_interval": f"{interval_s} s"})
    pair.call()
    pair.at(10 * MS, pair.stop, 1).run(72 * S)
    return [row[0] for row in pair.rows("control")[3:]] == [61_440 * MS, 71_680 * MS]


def calling(first_rto_s=1.0):
    """A SYN goes again after 1, 2, 3, 4, 5, 7, 11, 19, 35 and 67 s; after 131 s the caller gives
    up."""
    pair = Pair(params={"first_rto": f"{first_rto_s} s", "tick": "0 ns"})
    pair.stop(1)
    pair.call()
    pair.run(1000 * S)
    return ([row[0] // S for row in pair.rows("control")] == [
        0, 1, 2, 3, 4, 5, 7, 11, 19, 35, 67] and pair.log == [(131 * S, "a closed", "timeout")])


def giving_up(rto_max_s=120):
    """Fifteen retransmissions would take 0.2 (2^10 - 1) + 6 * 120 = 924.6 s, counted from the
    second one, after 0.4 s: so it is the timer after 1044.8 s that gives up, which goes off
    0.2 * 2^10 + 7 * 120 s after the message."""
    pair = Pair(params={"rto_max": f"{rto_max_s} s", "tick": "0 ns"})
    pair.call()
    pair.at(S, pair.stop, 1).at(2 * S, pair.say, 1).run(2000 * S)
    return (pair.log[2:] == [(2 * S + 1_044_800 * MS, "a closed", "timeout")]
            and len(pair.rows("frame")) == 18 and pair.at_rest())


def round_trip_times(latency_ms=150.0):
    """A path of 300 ms: the handshake gives SRTT = R and 4 RTTVAR = 2 R; each round trip as long
    takes a quarter of the deviation, and of the way of the variance to it (Linux
    tcp_rtt_estimator). A message that is lost goes again after SRTT + 4 RTTVAR, or two round trips
    and 200 ms, which may be less; and again after SRTT + 4 RTTVAR."""
    variance_ms = deviation_ms = 2 * 300.0
    for nth in range(1, 6):  # the message that is lost, behind SYN and ACK
        pair = Pair(link(rate="100 Gb/s", latency=f"{latency_ms} ms"), [Losing(nth + 2, nth + 3)],
                    params={"tick": "0 ns"})
        pair.call()
        for k in range(1, 6):
            pair.at(10 * k * S, pair.say, k)
        pair.run(60 * S)
        first_ns, *again_ns = [row[0] for row in pair.rows("frame") if row[4] == nth]
        timeout_ms = 300 + variance_ms
        for sent_ns, expected_ms in zip(again_ns, (min(timeout_ms, 800), timeout_ms), strict=True):
            if abs((sent_ns - first_ns) / MS - expected_ms) > 1:
                return False
            first_ns = sent_ns
        deviation_ms *= 3 / 4
        if nth > 1:  # the first round trip has the deviation of the handshake
            variance_ms -= (variance_ms - max(deviation_ms, 200)) / 4
    return True


def avoidance(initial_window=40):
    """After a fast retransmission the window is 0.7 of what it was, 40 segments, then it follows
    CUBIC's curve 40 + 0.4 (t - K)^3 with K = (12 / 0.4)^(1/3) s (RFC 9438), at which it aims a
    round trip ahead; Linux rounds it up to segments, half a one on average."""
    pair = Pair(link(rate="100 Gb/s", latency="50 ms"), [Losing(1, least_bytes=1000)],
                params={"initial_window": initial_window})
    pair.call()
    pair.at(S, pair.say, 1, 900 * MSS).run(10 * S)
    flights = {}
    for time_ns, *_, size_bytes in pair.rows("frame"):
        flight = (time_ns - S + MS) // (100 * MS)
        flights[flight] = flights.get(flight, 0) + size_bytes // FRAME
    sizes = list(flights.values())
    return sizes[1] == 28 and all(
        abs(size - (40.5 + 0.4 * (0.1 * k - 30**(1 / 3))**3)) <= 1.4
        for k, size in enumerate(sizes[3:14], 1))


CHECKS = [(handshake, 21.0), (slow_start, 11), (saturation, 10.5), (retransmissions, 0.11),
          (waking, 210), (keepalive, 10.5), (late_keepalive, 10.5), (calling, 1.1),
          (giving_up, 126),
          (round_trip_times, 160.0), (avoidance, 37)]


@pytest.mark.parametrize(("check", "twin"), CHECKS, ids=[check.__name__ for check, _ in CHECKS])
def test_check(check, twin):
    assert check()
    assert not check(twin)

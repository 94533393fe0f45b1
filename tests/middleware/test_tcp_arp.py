"""Addresses on a subnet: asked for, confirmed, lost, and what TCP makes of it."""

from itertools import pairwise
from statistics import median

import pytest
from graphs import MS, Net, S, listener, silent, talker
from tcp_hosts import Pair, link, partition

from desim.middleware import arp
from desim.middleware.ros1.ros1 import Ros1
from desim.middleware.tcp.retransmission import RetransmissionTimer
from desim.validation import tcp

NATURAL = {"arp": "natural", "tick": "0 ns"}


def wire():
    return link(rate="1 Gb/s", latency="1 ms")


def questions(pair, who="a"):
    """The times at which a host asked or answered, in s."""
    return [round(row[0] / S, 3) for row in pair.rows("control") if row[2] == who
            and row[4] == "arp"]


def test_hello():
    """a asks all where b is, and b then knows where a is: 64 B each, a round trip before the SYN.
    The first measured round trip is two."""
    pair = Pair(wire(), params=NATURAL)
    pair.call()
    pair.run(S)
    assert sorted(pair.rows()) == [
        (0, "control", "a", "b", "arp", 64), (0, "control", "a", "b", "talk", 78),
        (1_000_512, "control", "b", "a", "arp", 64), (3_001_648, "control", "b", "a", "talk", 78),
        (4_002_272, "control", "a", "b", "talk", 70)]
    assert pair.connection.sender(0).srtt_ns == 4_002_272


def unreachable_s(**params):
    pair = Pair(params={**NATURAL, **params})
    pair.stop(1)
    pair.call()
    pair.run(200 * S)
    return pair.log, questions(pair)


def test_who_calls_a_host_that_is_not_there_hears_it_after_three_seconds(monkeypatch):
    """Linux: connect() fails with EHOSTUNREACH. Where the address is known, it takes 131 s."""
    assert unreachable_s() == ([(3 * S, "a closed", "unreachable")], [0, 1, 2])
    assert unreachable_s(arp="static") == ([(131 * S, "a closed", "timeout")], [])
    monkeypatch.setattr(arp, "RETRANS_NS", 1_060 * MS)
    assert unreachable_s() != ([(3 * S, "a closed", "unreachable")], [0, 1, 2])


def test_a_host_that_is_asked_for_again_is_there_within_a_second():
    """It starts after 2.5 s; the questions go on with the next SYN's."""
    pair = Pair(params=NATURAL)
    pair.stop(1)
    pair.at(2500 * MS, pair.start, 1)
    pair.at(2500 * MS, lambda: pair.tcp.listen(1, "talk", pair._accept))
    pair.call()
    pair.at(3500 * MS, pair.call)
    pair.run(10 * S)
    assert (3 * S, "a closed", "unreachable") in pair.log
    assert (3500 * MS, "opened") in pair.log


def chatter(rounds_s, seconds, params=NATURAL):
    """One speaks every ``rounds_s``, the other only listens. When who asks and answers."""
    pair = Pair(params=params)
    pair.call()
    for k in range(int(seconds / rounds_s)):
        pair.at(round(k * rounds_s * S) + S, pair.say, k)
    pair.run(seconds * S)
    return questions(pair, "a"), questions(pair, "b")


def test_acknowledgements_confirm_an_address_and_who_has_none_asks_by_unicast():
    """b, which only listens, knows a from its question, and asks after 5 s; then each 15 to 45 s,
    drawn for b, and 5 s. a's acknowledgements confirm b, and it never asks again."""
    of_a, of_b = chatter(0.1, 250)
    asked = of_b[1:]  # the first is its answer
    assert of_a == [0, *asked], "a's are its first question, and answers"
    assert asked[0] == pytest.approx(5, abs=0.1)
    gaps = [after - before for before, after in pairwise(asked)]
    assert len(gaps) >= 4 and all(20 <= gap <= 50.2 for gap in gaps)


def woken_s(cut_s, seed, **params):
    """The time after a cut until messages, ten a second, are heard again."""
    pair = Pair(wire(), [partition("20 s", f"{20 + cut_s} s")], seed=seed,
                params={"arp": "natural", **params})
    pair.call()
    for k in range(10 * (cut_s + 10)):
        pair.at(10 * S + k * 100 * MS + seed * 10 * MS, pair.say, k, 1000)
    pair.run((20 + 3 * cut_s) * S)
    return next(time_ns for time_ns, _ in pair.heard() if time_ns > (20 + cut_s) * S) / S - (
        20 + cut_s)


@pytest.mark.parametrize(("cut_s", "static_s", "natural_s"), [(30, 24.2, 24.2), (60, 47.5, 20.4),
                                                              (120, 94.0, 13.6)])
def test_a_cut_is_felt_for_less_where_addresses_get_lost(monkeypatch, cut_s, static_s, natural_s):
    """Real Linux 6.18: 23.1, 48.3, 93.0 s with static addresses; with ARP 24.0 to 25.0, 19.8 to
    20.7 (or 47.3, where the address was good for long), 13.1 to 14.1 (or 39.5). The twin knows
    nothing of RFC 6069."""
    def median_s(**params):
        return median(woken_s(cut_s, seed, **params) for seed in range(5))
    assert median_s(arp="static") == pytest.approx(static_s, rel=0.05)
    assert median_s() == pytest.approx(natural_s, rel=0.06)
    monkeypatch.setattr(RetransmissionTimer, "unresolved", lambda retransmission, start: None)
    assert median_s() == pytest.approx(static_s, rel=0.05)


def heard_after_s():
    """The time at which b hears a again, which speaks each 10 ms and hangs on no access point
    from 2 s on for 11 ms (as it roams)."""
    pair = Pair(wire(), [partition("2 s", "2.011 s")], params=NATURAL)
    context, medium = pair.net.graph.context, pair.net.graph.media[0]
    pair.at(2 * S, context.hangs_on, medium, 0, None)
    pair.at(2011 * MS, context.hangs_on, medium, 0, "ap_1")
    pair.call()
    for k in range(400):
        pair.at(10 * MS + k * 10 * MS, pair.say, k)
    pair.run(5 * S)
    return next(time_ns for time_ns, _ in pair.heard() if time_ns > 2002 * MS) / S


def test_a_host_without_carrier_forgets_addresses_and_its_question_is_lost(monkeypatch):
    """Linux on simulated radios: what goes upwards waits 1.05 to 1.10 s after each change of the
    access point (arp_evict_nocarrier). The twin keeps its addresses."""
    assert heard_after_s() == pytest.approx(3.005, abs=0.02)
    monkeypatch.setattr(arp.Neighbours, "lose_carrier", lambda *_: None)
    assert heard_after_s() < 2.5


def test_datagrams_keep_no_address_alive_and_lose_it_sooner():
    """Datagrams that both send beside twice a second need the same address, and nothing confirms
    it. So after a cut of 60 s none of nine links sleeps for 47 s, where its address had been good
    for long, as some do that are alone (real: 19.8 and 20.7 s; alone 19.8 to 48.2 s)."""
    row = next(row for row in tcp.CUTS if row.beside and row.cut_s == 60)
    alone = row._replace(beside=False)
    assert max(tcp._woken_s(row, seed) for seed in range(9)) < 23
    assert max(tcp._woken_s(alone, seed) for seed in range(9)) > 40


def test_datagrams_to_a_host_that_is_gone_are_lost_for_want_of_an_address():
    """While the address is taken for good, 15 to 45 s, and 8 s more they go, to nobody. Then each
    waits for an answer that does not come, and has a fate."""
    net = Net({"a": talker([(k * S, str(k)) for k in range(2, 90)], transport="datagram"),
               "b": listener([]), "m": silent}, wire(), middleware=Ros1(Ros1.Params(master="m")))
    net.at(20 * S + MS, net.graph.host("b").stop)
    net.run(100 * S)
    reasons = [fate[3] for fate in net.fates]
    assert reasons[:18] == ["delivered"] * 18
    gone = reasons.index("no_neighbour")
    assert set(reasons[18:gone]) == {"host_down"} and set(reasons[gone:]) == {"no_neighbour"}
    assert 15 + 8 - 20 <= gone - 18 <= 45 + 8 + 1

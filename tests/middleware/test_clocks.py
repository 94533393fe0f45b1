"""Clocks of hosts that are wrong, and NTP clients that correct them."""

from itertools import cycle

import pytest
from graphs import MS, Net, S, silent
from hypothesis import given
from hypothesis import strategies as st

from desim.middleware import clocks, ntp
from desim.middleware.clocks import HostClock
from desim.middleware.ntp import NTP_BYTES, NtpClient
from desim.ports import Deliver
from desim.scenario.load import from_mapping
from desim.simulation.simulation import Simulation

PPM = 1000  # ppb
TIMES = st.integers(0, 10**15)


@given(st.integers(-10**12, 10**12), st.integers(-10**6, 10**6), TIMES)
def test_a_clock_is_ahead_by_its_start_and_its_rate(ahead_ns, drift_ppb, time_ns):
    assert HostClock(ahead_ns, drift_ppb).read(time_ns) == (
        time_ns + ahead_ns + time_ns * drift_ppb // 10**9)


@given(st.lists(st.tuples(st.integers(0, 10**12), st.integers(-10**9, 10**9)), max_size=6))
def test_a_slewed_clock_never_goes_back_and_answers_for_the_past(slews):
    clock, now_ns, shown = HostClock(0, 20 * PPM), 0, {}
    for wait_ns, by_ns in slews:
        now_ns += wait_ns
        shown[now_ns] = clock.read(now_ns)
        clock.slew(now_ns, by_ns)
        assert clock.read(now_ns) == shown[now_ns]
    assert [clock.read(time_ns) for time_ns in shown] == list(shown.values())
    assert list(shown.values()) == sorted(shown.values())


def test_a_slew_takes_its_time():
    clock = HostClock(0, 0)
    clock.slew(10 * S, 50 * MS)  # 500 us a second
    assert [clock.ahead_ns(s * S) for s in (0, 10, 11, 110, 200)] == [
        0, 0, MS // 2, 50 * MS, 50 * MS]
    clock.slew(200 * S, -50 * MS)
    clock.slew(250 * S, 25 * MS)  # just what was left of it
    assert [clock.ahead_ns(s * S) for s in (250, 300)] == [25 * MS, 25 * MS]


def test_a_second_slew_adds_to_what_is_left_of_the_first():
    clock = HostClock(0, 0)
    clock.slew(0, 50 * MS)
    clock.slew(40 * S, -10 * MS)
    assert [clock.ahead_ns(s * S) for s in (40, 60, 80, 90)] == [
        20 * MS, 30 * MS, 40 * MS, 40 * MS]
    assert [clock.unslewed_ns(s * S) for s in (40, 60, 80, 90)] == [20 * MS, 10 * MS, 0, 0]
    clock.slew(100 * S, -30 * MS)
    clock.step(120 * S, 70 * MS)  # which makes the rest of the slew void
    assert [clock.ahead_ns(s * S) for s in (120, 200)] == [100 * MS, 100 * MS]
    assert clock.unslewed_ns(120 * S) == 0


def days_of_slewing_600_s():
    clock = HostClock(0, 0)
    clock.slew(0, 600 * S)
    return next(h for h in range(10**4) if not clock.unslewed_ns(h * 3600 * S)) / 24


def test_a_slew_takes_as_long_as_the_manual_of_ntpd_says(monkeypatch):
    """ntpd(8) of ntp 4.2.8, option -x: 2000 s for each second, "almost 14 days" for 600 s."""
    clock = HostClock(0, 0)
    clock.slew(0, S)
    assert [clock.ahead_ns(s * S) for s in (1999, 2000)] == [S - MS // 2, S]
    assert 13.8 < days_of_slewing_600_s() < 14
    monkeypatch.setattr(clocks, "SLEW_PPB", 525_000)  # the twin
    assert days_of_slewing_600_s() < 13.8


def network(ahead_ns, drift_ppb, there_ms=1, back_ms=1, poll_s=64):
    """Host a follows the true clock of host b; the ways there and back take so long, or what
    ``back_ms()`` says. Returns the network and the clock of a."""
    def ways(frame, receivers):
        if frame.source == 0:
            return [Deliver(there_ms * MS)]
        return [Deliver((back_ms() if callable(back_ms) else back_ms) * MS)]
    net = Net({"a": silent, "b": silent}, rules=[ways])
    a, b = net.graph.hosts
    a.clock = HostClock(ahead_ns, drift_ppb)
    NtpClient(net.graph, a.index, a.clock, b.index, poll_s * S)._switched(a.index, True)
    return net, a.clock


@pytest.mark.parametrize(("ahead_ns", "within_ns"), [
    (0, 20_000), (300 * MS, 20_000), (-5 * S, 20_000), (40 * MS, 20_000)])
def test_a_client_comes_to_the_time_of_its_server(ahead_ns, within_ns):
    """A drift of 20 ppm is 1.3 ms in a polling interval, of which the correction of the rate leaves
    less with each."""
    net, clock = network(ahead_ns, 20 * PPM)
    net.run(3600 * S)
    assert abs(clock.ahead_ns(3600 * S)) < within_ns


def offsets(net):
    """By how much the client was behind at each answer, ns."""
    return [by_ns for _, _, _, by_ns, *_ in net.rows("clock_set")]


def test_an_offset_that_is_still_to_be_slewed_is_no_error_of_the_rate(monkeypatch):
    """100 ms at 500 ppm: 200 s after the first answer it is gone, and nothing comes after it."""
    def of_100_ms():
        net, clock = network(-100 * MS, 0)
        net.run(1200 * S)
        return offsets(net), clock.ahead_ns(1200 * S)
    seen, left_ns = of_100_ms()
    assert seen == [*(ms * MS for ms in (100, 99, 98, 97, 96, 95, 94, 93, 61, 29)), *[0] * 16]
    assert left_ns == 0
    monkeypatch.setattr(HostClock, "unslewed_ns", lambda self, now_ns: 0)  # the twin
    seen, _ = of_100_ms()
    assert min(seen) < -5 * MS


def differs_from_the_loop(drift_ppb, poll_s, gain=0.25):
    """By which part the offsets at 20 answers after the first differ from those of the loop: the
    rate's error times the time since the answer before, of which the loop corrects ``gain``, and
    less in the burst, where answers are closer than a polling interval."""
    net, _ = network(0, drift_ppb, poll_s=poll_s)
    net.run((20 + 20 * poll_s) * S)
    rate, expected = drift_ppb, []
    for interval_s in (*[2] * 7, *[poll_s] * 13):
        expected.append(-rate * interval_s)
        rate *= 1 - gain * interval_s / max(interval_s, poll_s)
    return max(abs(was - would) / abs(would)
               for was, would in zip(offsets(net)[1:21], expected, strict=True))


@pytest.mark.parametrize("poll_s", [4, 8, 16, 17, 64, 1024])
@pytest.mark.parametrize("drift", [20, -150])  # with polls of 1024 s it is stepped
def test_an_answer_corrects_a_quarter_of_the_rates_error(poll_s, drift, monkeypatch):
    """The closed form of the frequency-lock loop: each polling interval leaves 3/4."""
    assert differs_from_the_loop(drift * PPM, poll_s) < 1e-2
    assert differs_from_the_loop(drift * PPM, poll_s, gain=0.275) > 0.1
    monkeypatch.setattr(ntp, "_AVERAGED", 5)  # the twin
    assert differs_from_the_loop(drift * PPM, poll_s) > 0.1


# What is left of the error of the rate after 0, 1, ... updates: the model of ntpd 4.2.8 in ntpstats
# 3.8.0 (PyPI; T. de Freitas), ntpd_discipline(poll=11, initial_frequency=0.0, popcorn=False), of a
# clock with 10 ppm and an answer each 2048 s, from which on ntpd has this loop.
NTPD = [1, 0.7498, 0.5619, 0.4209, 0.3151, 0.2357, 0.1761, 0.1314]


def differs_from_ntpd():
    """By which part the errors of the rate that are left differ from those of ntpd's model."""
    net, clock = network(0, 10 * PPM, poll_s=2048)
    net.run((8 * 2048) * S)
    gained_ns = [clock.ahead_ns(s * S) - clock.ahead_ns((s - 1000) * S)
                 for s in range(2048, 8 * 2048 + 1, 2048)]  # in which no slew goes on
    return max(abs(ns / 1e7 / left - 1) for ns, left in zip(gained_ns, NTPD, strict=True))


def test_long_polling_intervals_leave_what_ntpd_leaves(monkeypatch):
    assert differs_from_ntpd() < 0.02
    monkeypatch.setattr(ntp, "_AVERAGED", 5)  # the twin
    assert differs_from_ntpd() > 0.05


def test_an_offset_and_a_drift_together_do_not_disturb_each_other():
    """The loop is linear: whatever is to be slewed, the rate's error is that of the drift alone."""
    rates = []
    for ahead_ns in (0, 50 * MS):
        net, clock = network(ahead_ns, -100 * PPM, poll_s=16)
        net.run(200 * S)
        rates.append(clock.ahead_ns(200 * S) - clock.ahead_ns(199 * S))
    assert abs(rates[0] - rates[1]) <= 2
    net.run(1200 * S)
    assert abs(clock.ahead_ns(1200 * S)) < 100


def test_a_server_that_sets_its_clock_does_not_change_the_clients_rate():
    """300 ms in 64 s would be 4700 ppm, and no clock errs by more than 500 (RFC 5905, MAXFREQ)."""
    net, clock = network(0, 0)
    net.run(300 * S)
    net.graph.hosts[1].clock = HostClock(300 * MS, 0)
    net.run(1000 * S)
    assert [by_ns for by_ns in offsets(net) if by_ns] == [300 * MS]
    assert [clock.ahead_ns(s * S) for s in (400, 1000)] == [300 * MS] * 2


def test_answers_under_way_when_the_clock_is_set_count_by_the_new_time():
    """The way there and back takes 3 s, so the second request is of the time before the step."""
    net, clock = network(-5 * S, 0, there_ms=1500, back_ms=1500)
    net.run(60 * S)
    assert offsets(net) == [5 * S, *[0] * 7]
    assert clock.ahead_ns(60 * S) == 0


def test_an_answer_that_is_used_late_counts_without_what_was_corrected_since():
    """The ninth answer, 3.5 ms wrong by the half of the difference of its ways, is used when the
    eighth is forgotten, at the sixteenth. The tenth, 5.5 ms wrong, is used when the ninth is
    forgotten, 4 s later: it says 2 ms more, and 1.5 ms of the 3.5 ms are still to be slewed."""
    ways = iter([*[1] * 8, 8, 12, *[60] * 7])
    net, _ = network(0, 0, back_ms=lambda: next(ways), poll_s=4)
    net.run(53 * S)
    assert offsets(net) == [*[0] * 8, -3.5 * MS, -(2 + 1.5) * MS]


def test_the_error_is_half_of_the_difference_of_the_ways():
    """RFC 5905, section 8: the offset that a client computes is wrong by half of the asymmetry."""
    net, clock = network(0, 0, there_ms=21)
    net.run(600 * S)
    assert abs(clock.ahead_ns(600 * S) - 10 * MS) < 10_000


def test_the_shortest_way_is_trusted(monkeypatch):
    """Three answers of four are late by 200 ms. A client that keeps one answer only goes wrong by
    up to the half of it."""
    def worst_ms():
        delays = cycle([1, 201, 201, 201])
        net, clock = network(0, 0, back_ms=lambda: next(delays))
        net.run(2000 * S)
        return max(abs(clock.ahead_ns(s * S)) for s in range(2000)) / MS
    assert worst_ms() < 0.1
    monkeypatch.setattr(ntp, "_ANSWERS", 1)
    assert worst_ms() > 50


def test_a_burst_then_a_request_in_each_polling_interval():
    net, _ = network(0, 0)
    net.run(150 * S)
    asked = [row for row in net.rows("control") if row[2] == "a"]
    assert [row[-1] for row in asked] == [NTP_BYTES] * 10
    gaps = [b[0] - a[0] for a, b in zip(asked, asked[1:], strict=False)]
    assert gaps == [2 * S] * 7 + [64 * S] * 2


def test_a_clock_far_off_is_set_and_one_near_is_slewed():
    far, _ = network(ntp.STEP_NS + 1, 0)
    near, clock = network(-ntp.STEP_NS, 0)
    for net in (far, near):
        net.run(5 * S)
    (_, _, _, by_ns, *_), *_ = far.rows("clock_set")
    assert by_ns == -ntp.STEP_NS - 1
    assert abs(clock.ahead_ns(5 * S) + ntp.STEP_NS) < 3 * MS


BEHIND = {"name": "clocks", "fleet": {"size": 2}, "deployment": "testbed",
          "stop": {"elapsed": "10 s"}, "environment": {"terrain": "maze"}}


def metres(**testbed):
    """The way of two robots in 10 s."""
    simulation = Simulation(from_mapping(BEHIND | {"testbed": testbed}).scenario)
    simulation.run()
    return float(simulation.world.travelled_m().sum())


def test_robots_stand_where_the_workstations_stamps_are_older_than_the_tolerance():
    """costmap_2d refuses a pose that is stamped 0.3 s ago: poses are some 50 ms old in the mean."""
    assert metres(clock={"behind": "150 ms"}) > 5
    assert metres(clock={"behind": "300 ms"}) == 0.0
    assert metres(clock={"ahead": "10 s"}) > 5  # nobody asks whether a stamp is yet to come
    assert metres(clock={"behind": "300 ms", "ntp": {"server": "robot_0"}}) > 1


def test_a_server_behind_a_host_that_forwards_is_reached():
    simulation = Simulation(from_mapping({
        "name": "behind", "fleet": {"size": 2}, "deployment": "field", "stop": {"elapsed": "5 s"},
        "environment": {"terrain": "maze"}, "robot": {"clock": {
            "behind": "5 ms", "ntp": {"server": "office"}}},
        "hosts": {"base": {"forwards": ["air", "lan"]}, "office": {}},
        "network": {"media": {
            "air": {"model": "ideal", "hosts": ["robot_0", "robot_1", "base"]},
            "lan": {"model": "ideal", "hosts": ["base", "office"]}}}}).scenario)
    simulation.run()
    for name in ("robot_0", "robot_1"):
        assert simulation.graph.host(name).clock.unslewed_ns(5 * S) > 2 * MS

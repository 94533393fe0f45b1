"""Clocks of hosts that are wrong, and NTP clients that correct them."""

from itertools import cycle

import pytest
from graphs import MS, Net, S, silent
from hypothesis import given
from hypothesis import strategies as st

from desim.middleware import ntp
from desim.middleware.clocks import SLEW_PPB, HostClock
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
    assert SLEW_PPB == 500 * PPM
    clock.slew(200 * S, -50 * MS)
    clock.slew(250 * S, 0)  # what was left of it is void
    assert [clock.ahead_ns(s * S) for s in (250, 300)] == [25 * MS, 25 * MS]


def network(ahead_ns, drift_ppb, there_ms=1, back_ms=1):
    """Host a follows the true clock of host b; the ways there and back take so long, or what
    ``back_ms()`` says. Returns the network and the clock of a."""
    def ways(frame, receivers):
        if frame.source == 0:
            return [Deliver(there_ms * MS)]
        return [Deliver((back_ms() if callable(back_ms) else back_ms) * MS)]
    net = Net({"a": silent, "b": silent}, rules=[ways])
    a, b = net.graph.hosts
    a.clock = HostClock(ahead_ns, drift_ppb)
    NtpClient(net.graph, a.index, a.clock, b.index, 64 * S)._switched(a.index, True)
    return net, a.clock


@pytest.mark.parametrize(("ahead_ns", "within_ns"), [
    (0, 20_000), (300 * MS, 20_000), (-5 * S, 20_000), (40 * MS, 20_000)])
def test_a_client_comes_to_the_time_of_its_server(ahead_ns, within_ns):
    """A drift of 20 ppm is 1.3 ms in a polling interval, of which the correction of the rate leaves
    less with each."""
    net, clock = network(ahead_ns, 20 * PPM)
    net.run(3600 * S)
    assert abs(clock.ahead_ns(3600 * S)) < within_ns


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

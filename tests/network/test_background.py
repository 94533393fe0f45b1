"""Background traffic: the times of its packets, its account, and the waits that it causes."""

from itertools import islice

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from desim.engine.kernel import Kernel, Phase
from desim.engine.streams import Streams
from desim.engine.trace import Names, Trace
from desim.network.background import BackgroundFlow, Spells, on_off, periodic, poisson, trains
from desim.network.carrier import Carrier
from desim.network.medium import Medium
from desim.units import NS_PER_S
from netmodels.access_link import AccessLink
from netmodels.bus import Bus
from netmodels.rules.loss import Loss

S, MS = NS_PER_S, 10**6
SPELLS = Spells(300 * MS, 700 * MS)


def stream(seed=0):
    return Streams(seed)("background", "lan", "a", "b", 0)


def times_of(arrays, until_ns):
    """All times before ``until_ns``."""
    out = []
    for array in arrays:
        out.append(array[array < until_ns])
        if array[-1] >= until_ns:
            break
    return np.concatenate(out)


# ------------------------------------------------------------------------------------ times


@settings(deadline=None)
@given(st.integers(64, 1518), st.integers(1, 10**10), st.integers(0, 9))
def test_periodic_packets_never_drift(bytes_, rate_bps, seed):
    """The k-th comes k * 8 * bytes / rate after the first, rounded down, also after many."""
    arrays = list(islice(periodic(bytes_, rate_bps, stream(seed)), 3))
    times = np.concatenate(arrays).tolist()
    first_ns = times[0]
    assert 0 <= first_ns <= 8 * bytes_ * S // rate_bps
    assert times == [first_ns + k * 8 * bytes_ * S // rate_bps for k in range(len(times))]


@pytest.mark.parametrize("make", [
    periodic, poisson, lambda *args: on_off(*args, SPELLS)], ids=["periodic", "poisson", "on_off"])
def test_the_mean_rate_is_that_of_the_scenario(make):
    """8 Mb/s of 1000 B are 1000 packets a second: within 5 standard errors in 2000 s."""
    times = times_of(make(1000, 8_000_000, stream()), 2000 * S)
    # Of on_off the time that is on varies: 2000 cycles, each with a deviation of that of its spell.
    deviation = {"periodic": 1, "poisson": (2000 * 1000) ** 0.5}.get(
        make.__name__, 2_000_000 * (2 * 0.7**2 / 2000) ** 0.5)
    assert abs(len(times) - 2_000_000) <= 5 * deviation
    assert (np.diff(times) >= 0).all()


def test_times_between_poisson_packets_are_exponential():
    gaps = np.diff(times_of(poisson(1000, 8_000_000, stream()), 100 * S)) / 1e6
    assert (gaps.mean(), gaps.std()) == (pytest.approx(1.0, rel=0.02),) * 2
    assert (gaps > 2.0).mean() == pytest.approx(np.exp(-2.0), rel=0.05)


def test_spells_have_their_means_and_are_full_while_they_last():
    """Of 1 s, 0.3 s are on, at 1 / 0.3 of the mean rate."""
    gaps = np.diff(times_of(on_off(1000, 8_000_000, stream(), SPELLS), 1000 * S))
    between = np.abs(gaps - 0.3 * MS) > 1
    assert between.sum() == pytest.approx(1000, rel=0.15)
    assert gaps[between].mean() == pytest.approx(0.7 * S, rel=0.15)


def test_a_source_of_spells_is_on_at_the_beginning_for_its_share():
    """0.3 of the time, and a packet then comes within a period of 0.3 ms; within 4 deviations."""
    first_ns = [next(on_off(1000, 8_000_000, stream(seed), SPELLS))[0] for seed in range(1000)]
    assert np.mean(np.array(first_ns) <= 0.3 * MS) == pytest.approx(0.3, abs=0.058)


@given(st.lists(st.integers(0, 1000), min_size=1, max_size=40), st.integers(0, 300))
def test_trains_take_all_packets_along_and_none_late(gaps, grain_ns):
    times = np.cumsum(gaps)
    arrays = iter([*np.array_split(times, 1 + len(times) // 7), np.array([10**9, 2 * 10**9])])
    begun = []
    for begin_ns, count in trains(arrays, grain_ns):
        if begin_ns >= 10**9:
            break
        begun.append((begin_ns, count))
    due = times.tolist()
    for begin_ns, count in begun:
        members, due = due[:count], due[count:]
        assert members[0] == begin_ns
        assert max(members) < begin_ns + max(grain_ns, 1)
    assert not due
    assert grain_ns > 0 or all(count == 1 or gap == 0 for count, gap in [(c, 1) for _, c in begun])


# ------------------------------------------------------------------------------------ account


class Air:
    """A medium with hosts a and b of others beside one of the fleet's."""

    def __init__(self, model, rules=(), seed=0):
        self.kernel, self.names, self.rows = Kernel(), Names(), []
        self.trace = Trace(self.names, lambda batch: self.rows.extend(batch.tolist()))
        self.medium = Medium("lan", model, rules, kernel=self.kernel, names=self.names, own=1,
                             streams=Streams(seed), hosts=["robot_0", "a", "b"])

    def flow(self, times, bytes_=1000, source=1, receiver=2):
        """A flow of trains at these times."""
        def endless():
            yield from times
            while True:
                yield 10**18, 1
        return BackgroundFlow(self.medium, source, receiver, ("a", "b"), bytes_, endless(),
                              self.kernel, self.trace)


def test_the_whole_log_of_two_trains():
    """3000 B take 2.4 ms at 10 Mb/s, and then 1000 B 0.8 ms."""
    air = Air(AccessLink(AccessLink.Params(rate="10 Mb/s")))
    flow = air.flow([(S, 3), (2 * S, 1)])
    air.kernel.run(3 * S)
    air.trace.flush()
    names = air.names
    assert [(t, names[kind], names[entity], names[a], names[b], c)
            for t, kind, entity, a, b, c in air.rows] == [
        (S, "background", "medium/lan", "a", "b", 3),
        (2 * S, "background", "medium/lan", "a", "b", 1)]
    assert (flow.sent, flow.delivered, flow.in_flight, dict(flow.dropped)) == (4, 4, 0, {})
    assert (air.medium.tx_bytes, list(air.medium.rx_bytes)) == ([0, 4000, 0], [0, 0, 4000])
    assert (air.medium.bytes_on_air, air.medium.background_bytes) == (0, 4000)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 1000), st.lists(st.tuples(st.integers(1, 10**7), st.integers(1, 30)),
                                      min_size=1, max_size=60))
def test_packets_are_conserved(seed, steps):
    """On a bus with short queues and a rule that loses a fifth, also in the middle of a run."""
    air = Air(Bus(Bus.Params(queue_packets=5)), [Loss(Loss.Params(probability="20 %"))], seed)
    times, now_ns = [], 0
    for gap_ns, packets in steps:
        times.append((now_ns := now_ns + gap_ns, packets))
    flow = air.flow(times)
    for part in (2, 1):
        air.kernel.run(now_ns // part)
        medium = air.medium
        assert medium.packets_intended == flow.sent
        assert flow.in_flight >= 0
        if not medium.in_flight():
            assert flow.in_flight == 0
            assert (medium.packets_delivered, medium.packets_dropped) == (
                flow.delivered, dict(flow.dropped))
    air.kernel.run(now_ns + 100 * S)
    assert flow.sent == flow.delivered + sum(flow.dropped.values()) == sum(
        packets for _, packets in steps)
    assert air.medium.refused_bytes == air.medium.bytes_on_air == 0
    # What was neither lost in front nor refused was on the air.
    assert air.medium.background_bytes == 1000 * (
        flow.sent - flow.dropped["random_loss"] - flow.dropped["queue_full"])


# ------------------------------------------------------------------------------------ waiting


class Probe(Carrier[int]):
    """A packet of 64 B of the fleet's, every so often: the time that it waits."""

    def __init__(self, air, every_ns):
        self.waits, self._air, self._every_ns = [], air, every_ns
        air.kernel.at(0, Phase.NETWORK, 0, self._send)

    def _send(self, _=None):
        medium, kernel = self._air.medium, self._air.kernel
        medium.transmit(0, (2,), 64, 1, False, self, kernel.now_ns)
        kernel.after(self._every_ns, Phase.NETWORK, 0, self._send)

    def arrived(self, sent_ns, receiver):
        self.waits.append(self._air.kernel.now_ns - sent_ns)

    def mean_ns(self):
        waits = np.array(self.waits)
        return waits.mean() - waits.min()  # the shortest is without any wait


PACKET_NS = 8 * (1518 + 8 + 12) * S // 10_000_000  # on a cable of 10 Mb/s, with preamble and gap


def poisson_trains(load, grain_ns):
    """Trains of packets of 1518 B that take so much of the cable."""
    return trains(poisson(1518, round(1518 * 8 * load / PACKET_NS * S), stream()), grain_ns)


def test_single_packets_make_others_wait_as_in_m_d_1():
    """rho / (2 (1 - rho)) service times (Pollaczek-Khinchine), on one cable, in order of sending;
    the probes themselves, of 64 B, take less than a hundredth of it."""
    load = 0.5
    air = Air(Bus(Bus.Params(arbitration="fifo", propagation="0 ns", queue_packets=10**6)))
    BackgroundFlow(air.medium, 1, 2, ("a", "b"), 1518, poisson_trains(load, 0), air.kernel,
                   air.trace)
    probe = Probe(air, round(7.13 * PACKET_NS))
    air.kernel.run(60 * S)
    assert probe.mean_ns() / PACKET_NS == pytest.approx(load / (2 * (1 - load)), rel=0.1)


def mean_work(load, grain_ns, count=40_000):
    """The mean work that waits in front of the cable, in packets, over all time."""
    waiting_ns = area = last_ns = 0
    for begin_ns, packets in islice(poisson_trains(load, grain_ns), count):
        span_ns = begin_ns - last_ns
        served_ns = min(span_ns, waiting_ns)
        area += served_ns * (waiting_ns - served_ns / 2)
        waiting_ns += packets * PACKET_NS - served_ns
        last_ns = begin_ns
    return area / last_ns / PACKET_NS


@pytest.mark.parametrize("due", [0.5, 2.0, 8.0])
def test_trains_make_others_wait_longer_as_the_page_says(due):
    """At a load of 2 %, with so many packets due in a grain: rho / 2 (1 + 3 x + x^2) / (1 + x)."""
    load = 0.02
    measured = mean_work(load, round(due * PACKET_NS / load))
    assert measured == pytest.approx(load / 2 * (1 + 3 * due + due**2) / (1 + due), rel=0.08)
    # The twins: as if each packet went on its own; as if the grain were a quarter longer.
    assert measured > 1.3 * mean_work(load, 0) == pytest.approx(1.3 * load / 2, rel=0.1)
    longer = 1.25 * due
    assert measured != pytest.approx(load / 2 * (1 + 3 * longer + longer**2) / (1 + longer),
                                     rel=0.08)


def test_it_is_repeatable_and_its_own():
    """The same numbers for the same names, and no others' moved."""
    first, again, other = (list(islice(trains(poisson(1000, 10**6, stream(seed)), MS), 50))
                           for seed in (1, 1, 2))
    assert first == again != other


def overfull():
    """20 ms after 10 packets of 1000 B were sent over 1 Mb/s, each on its own."""
    air = Air(AccessLink(AccessLink.Params(rate="1 Mb/s")))
    flow = air.flow([(S - 20 * MS + k, 1) for k in range(10)])
    air.kernel.run(S)
    return flow, air.medium


def test_packets_are_delivered_when_they_arrive():
    """Each takes 8 ms."""
    flow, medium = overfull()
    assert (flow.sent, flow.delivered, flow.in_flight) == (10, 2, 8)
    assert (medium.packets_delivered, medium.in_flight(), medium.rx_bytes[2]) == (2, 8, 2000)


def test_the_twin_that_counts_them_when_they_are_sent_is_caught(monkeypatch):
    transmit = Medium.transmit
    monkeypatch.setattr(Medium, "transmit", lambda *frame: transmit(*frame, True))
    _, medium = overfull()
    assert (medium.packets_delivered, medium.in_flight(), medium.rx_bytes[2]) == (10, 0, 10_000)

"""The shared bus: whole small logs, nothing lost on the way, and ns-3's CSMA."""

import csv
import random
from statistics import mean

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from desim.errors import InputError
from desim.netcases.case import play
from desim.ports.cases import NOWHERE, Flow, Setup
from desim.testing import Bench, check_network
from netmodels import bus
from netmodels.bus import ARBITRATIONS, Bus, CollisionDetection

MODES = ["csma", "csma_cd", "fifo"]
MB = 10**6
PACKET_NS = 1_214_400  # 1518 B at 10 Mb/s
GAP_NS = 9600
CABLE_NS = 1000
LONG = pytest.mark.validation  # rows that `desim validate` compares, too
NS3 = {"arbitration": "csma", "preamble": "0 B"}


def bench_of(places=4, **params):
    return Bench(Bus(Bus.Params(**({"preamble": "0 B"} | params))), places)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("params", [{}, {"rate": "1 Mb/s", "queue_packets": 3}])
def test_the_bus_keeps_the_contract(mode, params):
    check_network(Bus, arbitration=mode, **params)


@pytest.mark.parametrize("mode", MODES)
def test_a_lone_broadcast_is_one_transmission_heard_by_all_at_once(mode):
    bench = bench_of(arbitration=mode)
    bench.send(0, "host_1", ["host_2", "host_3", "host_4"], 1518, label="a", broadcast=True)
    bench.send(0, "host_1", "host_4", 1518, label="b")
    first_ns = PACKET_NS + CABLE_NS
    # With CSMA/CD the gap begins when the signal has passed everybody.
    second_ns = first_ns + GAP_NS + PACKET_NS + CABLE_NS * (mode == "csma_cd")
    assert bench.run() == [(first_ns, "a", "host_1", "host_2", "arrived"),
                           (first_ns, "a", "host_1", "host_3", "arrived"),
                           (first_ns, "a", "host_1", "host_4", "arrived"),
                           (second_ns, "b", "host_1", "host_4", "arrived")]


def test_the_preamble_takes_time():
    bench = bench_of(arbitration="csma", preamble="8 B")
    bench.send(0, "host_1", "host_2", 1518)
    assert bench.run()[0][0] == PACKET_NS + 6400 + CABLE_NS


def test_short_packets_are_padded():
    bench = bench_of(arbitration="csma")
    bench.send(0, "host_1", "host_2", 20)
    assert bench.run()[0][0] == 64 * 800 + CABLE_NS


def test_fifo_serves_in_order_and_a_train_in_one_go():
    bench = bench_of(arbitration="fifo")
    bench.send(0, "host_1", "host_4", 3 * 1518, 3, label="train")
    bench.send(1, "host_2", "host_4", 1518, label="packet")
    train_ns = 3 * PACKET_NS + 2 * GAP_NS + CABLE_NS
    assert bench.run() == [(train_ns, "train", "host_1", "host_4", "arrived"),
                           (train_ns + GAP_NS + PACKET_NS, "packet", "host_2", "host_4", "arrived")]


def test_a_packet_comes_between_those_of_a_train():
    bench = bench_of(arbitration="csma")
    bench.send(0, "host_1", "host_4", 100 * 1518, 100, label="train")
    bench.send(500, "host_2", "host_4", 1518, label="packet")
    assert [label for _, label, *_ in bench.run()] == ["packet", "train"]


def test_collisions_cost_a_jam_and_a_random_number_of_slots():
    """Both begin at 0, hear each other at 1 us, and jam until 4.2 us. Both draw no slot, collide
    again at 5.2 us, when the bus is idle, and stop at 9.4 us. One draws one slot, 51.2 us, and
    the other one more, so that it waits until the first one is through."""
    bench = bench_of(arbitration="csma_cd", gap="0 B")
    bench.send(0, "host_1", "host_3", 1518, label="a")
    bench.send(0, "host_2", "host_3", 1518, label="b")
    one_ns = PACKET_NS + CABLE_NS
    assert [(time_ns, fate) for time_ns, *_, fate in bench.run()] == [
        (9400 + 51_200 + one_ns, "arrived"), (9400 + 51_200 + 2 * one_ns, "arrived")]


@pytest.mark.parametrize(("mode", "attempts"), [("csma", (3, 0)), ("fifo", (3, 0)),
                                                ("csma_cd", (7, 4))])
def test_attempts_are_counted(mode, attempts):
    """Two who begin together: with collisions they do so twice (see above). And a third packet."""
    bench = bench_of(arbitration=mode, gap="0 B")
    for host in ("host_1", "host_2"):
        bench.send(0, host, "host_3", 1518)
    bench.send(100 * MB, "host_1", "host_3", 1518)
    bench.run()
    assert bench.medium.model.attempts() == attempts


def test_who_has_won_wins_again():
    """The capture effect (Molle 1994): the winner counts its collisions from 0 again, the loser
    goes on counting, up to 16. A train that wins once keeps the bus for most of its packets, and
    the other one gives up packet after packet."""
    bench = bench_of(arbitration="csma_cd", queue_packets=1000)
    for host in ("host_1", "host_2"):
        bench.send(0, host, "host_4", 1000 * 1518, 1000, label=host)
    (_, _, _, _, first), (time_ns, _, _, _, last) = bench.run()
    assert (first, last) == ("arrived in part", "arrived in part")
    assert time_ns > 1000 * (PACKET_NS + GAP_NS)
    assert bench.medium.packets_dropped == {
        "excessive_collisions": sum(len(lost) for *_, lost in bench.parts)}


def test_the_backoff_of_csma_counts_in_microseconds():
    """The first draw is of one slot only: who asks 300 ns before the bus is free begins 700 ns
    after it."""
    bench = bench_of(arbitration="csma", gap="0 B")
    bench.send(0, "host_1", "host_3", 1518, label="a")
    bench.send(PACKET_NS + CABLE_NS - 300, "host_2", "host_3", 1518, label="b")
    assert [time_ns for time_ns, *_ in bench.run()] == [
        PACKET_NS + CABLE_NS, 2 * (PACKET_NS + CABLE_NS) + 700]


def contend(hosts, packets):
    """Binary exponential backoff of saturated hosts by IEEE 802.3, 4.2.3: share of packets given up
    after 16 collisions, and of the time in which packets are carried. All that want to begin while
    the bus is busy begin together when it is not. A packet has 1518 B, there are no gaps."""
    draw, slot_ns, jam_ns = random.Random(5), 51_200, 3_200
    wants_ns, failed = [0] * hosts, [0] * hosts
    free_ns = given_up = carried = 0
    while carried + given_up < packets:
        begins_ns = [max(time_ns, free_ns) for time_ns in wants_ns]
        first_ns, *later_ns = sorted(begins_ns)
        senders = [k for k, time_ns in enumerate(begins_ns) if time_ns <= first_ns + CABLE_NS]
        if len(senders) == 1:
            wants_ns[senders[0]], failed[senders[0]] = first_ns + PACKET_NS, 0
            free_ns = first_ns + PACKET_NS + CABLE_NS
            carried += 1
            continue
        stopped_ns = later_ns[0] + CABLE_NS + jam_ns
        free_ns = stopped_ns + CABLE_NS
        first = begins_ns.index(first_ns)
        for k in senders:
            failed[k] += 1
            wants_ns[k] = stopped_ns if k == first else first_ns + CABLE_NS + jam_ns
            if failed[k] == 16:
                failed[k] = 0
                given_up += 1
            else:
                wants_ns[k] += slot_ns * draw.randrange(2 ** min(failed[k], 10))
    return given_up / packets, carried * PACKET_NS / free_ns


def saturated(hosts, packets):
    """The same of ours."""
    senders = tuple(f"host_{k}" for k in range(1, hosts + 1))
    model = Bus(Bus.Params(arbitration="csma_cd", gap="0 B", preamble="0 B"))
    found = play(Setup(model, dict.fromkeys((*senders, "sink"), NOWHERE),
                       [Flow(sender, ("sink",), 1518, 1500) for sender in senders],
                       packets * PACKET_NS))
    return found["loss"], found["throughput_mbps"] / 10


@pytest.mark.parametrize("hosts", [10, pytest.param(30, marks=LONG)])
def test_exponential_backoff_of_ethernet(hosts):
    """Packets given up within 10 % (chance makes 3 %), time in use within 0.005."""
    lost, used = contend(hosts, 20_000)
    found_lost, found_used = saturated(hosts, 20_000)
    assert found_lost == pytest.approx(lost, rel=0.1)
    assert found_used == pytest.approx(used, abs=0.005)


def test_twin_that_doubles_nine_times_gives_up_more(monkeypatch):
    lost, _ = contend(10, 20_000)
    monkeypatch.setattr(bus, "_CEILING", 9)
    assert saturated(10, 20_000)[0] > 1.3 * lost


def test_hosts_that_hear_each_other_do_not_collide():
    """The second one begins after the first one's signal is there: it waits for the gap."""
    bench = bench_of(arbitration="csma_cd")
    bench.send(0, "host_1", "host_3", 1518, label="a")
    bench.send(CABLE_NS + 1, "host_2", "host_3", 1518, label="b")
    one_ns = PACKET_NS + CABLE_NS
    assert bench.run() == [(one_ns, "a", "host_1", "host_3", "arrived"),
                           (2 * one_ns + GAP_NS, "b", "host_2", "host_3", "arrived")]


@pytest.mark.parametrize("mode", MODES)
def test_a_full_queue_drops(mode):
    """One is being sent, three wait, two are too many."""
    bench = bench_of(arbitration=mode, queue_packets=3)
    for label in range(6):
        bench.send(0, "host_1", "host_2", 1518, label=label)
    fates = {label: fate for _, label, _, _, fate in bench.run()}
    assert fates == dict.fromkeys(range(4), "arrived") | dict.fromkeys((4, 5), "queue_full")


@pytest.mark.parametrize("mode", MODES)
def test_a_train_loses_what_finds_no_room(mode):
    """One is being sent, three wait: of six the last two are dropped, and the four arrive."""
    bench = bench_of(arbitration=mode, queue_packets=3)
    bench.send(0, "host_1", "host_2", 6 * 1518, 6, label="train")
    (_, label, _, _, fate), = bench.run()
    assert (label, fate) == ("train", "arrived in part")
    assert bench.parts == [("train", "host_2", {4: "queue_full", 5: "queue_full"})]


def test_collisions_that_could_go_unheard_are_refused():
    with pytest.raises(InputError, match=r"\.propagation"):
        bench_of(arbitration="csma_cd", propagation="30 us")
    bench_of(arbitration="csma", propagation="30 us")


@settings(max_examples=30)
@given(st.sampled_from(MODES), st.lists(st.tuples(
    st.integers(0, 5_000_000), st.integers(1, 4), st.integers(1, 5)), max_size=40))
def test_the_bus_carries_one_bit_at_a_time(mode, sent):
    """Every frame has one fate, and what arrived never took less time than its bits and gaps."""
    bench = bench_of(5, arbitration=mode, queue_packets=5)
    for label, (time_ns, host, segments) in enumerate(sent):
        bench.send(time_ns, f"host_{host}", "host_5", 1518 * segments, segments, label)
    log = bench.run()
    assert sorted(label for _, label, *_ in log) == list(range(len(sent)))
    arrived = [entry for entry in log if entry[4] == "arrived"]
    if arrived:
        carried = sum(sent[label][2] for _, label, *_ in arrived)
        begin_ns = min(time_ns for time_ns, *_ in sent)
        assert arrived[-1][0] - begin_ns >= carried * PACKET_NS + CABLE_NS


def loaded(senders, load, frames, **params):
    """Delivered Mb/s, share lost, mean delay in ms of periodic senders of 1518 B with random
    phases. Overloaded senders begin with full queues, so that the state is steady at once."""
    bench, draw = bench_of(senders + 1, **params), random.Random(3)
    period_ns = round(senders * PACKET_NS / load)
    for number in range(1, senders + 1):
        host, phase_ns = f"host_{number}", draw.randrange(period_ns)
        for _ in range(100 if load > 1 else 0):
            bench.send(0, host, f"host_{senders + 1}", 1518, label=-1)
        for count in range(frames // senders):
            time_ns = phase_ns + count * period_ns
            bench.send(time_ns, host, f"host_{senders + 1}", 1518, label=time_ns)
    until_ns = frames // senders * period_ns
    fates = [entry for entry in bench.run() if until_ns // 5 <= entry[0] < until_ns]
    delays_ns = [time_ns - label for time_ns, label, *_, fate in fates if fate == "arrived"]
    return (len(delays_ns) * 1518 * 8 / (until_ns * 0.8e-9) / MB,
            1 - len(delays_ns) / len(fates), mean(delays_ns) / MB)


def ns3(reference, senders, load, arrivals="periodic"):
    """The same of ns-3: the mean of its runs."""
    with open(reference / "ns3" / "s1_shared_bus_csma.csv", newline="") as file:
        rows = [row for row in csv.DictReader(file)
                if row["arrivals"] == arrivals and int(row["n_senders"]) == senders
                and float(row["offered_load"]) == load]
    return [mean(float(row[name]) for row in rows)
            for name in ("delivered_mbps_wire", "loss_ratio", "mean_owd_ms")]


@pytest.mark.parametrize(("load", "senders"), [(0.5, 5), (0.9, 30), (1.5, 5), *(
    pytest.param(*row, marks=LONG) for row in (
        (0.5, 1), (0.5, 30), (0.9, 1), (0.9, 5), (1.5, 1), (1.5, 30)))])
def test_csma_carries_what_ns3_does(reference, senders, load):
    """Throughput within 1 %, loss within 0.01."""
    mbps, lost, _ = loaded(senders, load, 9000, **NS3)
    expected_mbps, expected_lost, _ = ns3(reference, senders, load)
    assert mbps == pytest.approx(expected_mbps, rel=0.01)
    assert lost == pytest.approx(expected_lost, abs=0.01)


@pytest.mark.parametrize("senders", [5, *(pytest.param(n, marks=LONG) for n in (1, 30))])
def test_the_twin_with_a_tenth_less_rate_does_not(reference, senders):
    mbps, lost, _ = loaded(senders, 1.5, 9000, rate="9 Mb/s", **NS3)
    expected_mbps, expected_lost, _ = ns3(reference, senders, 1.5)
    assert abs(mbps / expected_mbps - 1) > 0.05
    assert abs(lost - expected_lost) > 0.03


def test_the_gap_shows_in_the_delay_of_one_overloaded_sender(reference):
    """101 packets and gaps: within 0.03 %, where a gap longer by a tenth makes 0.08 %."""
    expected_ms = ns3(reference, 1, 1.5)[2]

    def off(gap):
        return abs(loaded(1, 1.5, 4000, gap=gap, **NS3)[2] / expected_ms - 1)

    assert off("12 B") < 0.0003 < 0.0005 < off("13 B")


def test_the_backoff_delays_poisson_packets_as_in_ns3(reference):
    """30 senders at half load: within 3 %, where a queue in order makes 12 % less. The twin has a
    tenth less rate."""
    expected_ms = ns3(reference, 30, 0.5, "poisson")[2]

    def off(**params):
        bench, draw, time_ns = bench_of(31, **params), random.Random(3), 0.0
        for _ in range(20_000):
            time_ns += draw.expovariate(0.5 / PACKET_NS)
            bench.send(round(time_ns), f"host_{draw.randint(1, 30)}", "host_31", 1518,
                       label=round(time_ns))
        delay_ms = mean(arrived_ns - label for arrived_ns, label, *_ in bench.run()) / MB
        return abs(delay_ms / expected_ms - 1)

    assert off(**NS3) < 0.03 < off(rate="9 Mb/s", **NS3)
    assert off(arbitration="fifo") > 0.1


class Slotted(CollisionDetection):
    """The bus of Metcalfe and Boggs (1976): each of Q hosts begins in a slot with probability
    1/Q, instead of exponential backoff."""

    def _try(self, station):
        if self._context.now_ns < self.free_ns or station.random() < 1 / (len(self._stations) - 1):
            super()._try(station)
        else:
            self._context.at(self._context.now_ns + self._cable.slot_ns, self._try, station)

    def _collided(self, station, stop_ns):
        self._context.at(stop_ns, self._try, station)


@pytest.mark.parametrize(("senders", "size_bytes"), [(2, 64), (5, 512), *(
    pytest.param(*row, marks=LONG) for row in ((2, 512), (5, 64), (10, 64), (10, 512)))])
def test_collisions_cost_what_metcalfe_and_boggs_say(monkeypatch, senders, size_bytes):
    """E = P / (P + W T), W = (1 - A) / A, A = (1 - 1/Q)^(Q - 1), where P also has the time in which
    the last bit passes, 24 us. With it, twice, and the jam of 3.2 us a collision takes a slot. The
    number of slots W is geometric, with the relative standard error 1 / sqrt(packets (1 - A)); the
    tolerance is 4 of these. The twin: slots a tenth longer would be outside."""
    packets = 12_000
    monkeypatch.setitem(ARBITRATIONS, "csma_cd", Slotted)
    bench = bench_of(senders + 1, arbitration="csma_cd", propagation="24 us", gap="0 B",
                     queue_packets=packets)
    for number in range(1, senders + 1):
        for _ in range(packets // senders + 500):
            bench.send(0, f"host_{number}", f"host_{senders + 1}", size_bytes)
    end_ns = bench.run()[packets - 1][0]
    acquired = (1 - 1 / senders) ** (senders - 1)
    slots = (end_ns / packets - (size_bytes * 800 + CABLE_NS * 24)) / 51_200
    expected = (1 - acquired) / acquired
    tolerance = 4 / (packets * (1 - acquired)) ** 0.5
    assert abs(slots / expected - 1) < tolerance < abs(1.1 * slots / expected - 1)

"""The busy time that media report, against what can be counted by hand.

Twins have a constant that is wrong by 5 to 10 %, and are caught.
"""

import random
from itertools import pairwise

import pytest
from packet_by_packet import PacketByPacket

from desim.engine.kernel import Phase
from desim.monitor.utilisation import utilisation
from desim.netcases.case import play
from desim.ports.cases import NOWHERE, Flow, Setup
from desim.testing import Bench
from netmodels.access_link import AccessLink
from netmodels.bus import Bus
from netmodels.cases.load import Bottleneck
from netmodels.cases.saturation import Saturation
from netmodels.disk import Disk
from netmodels.multihop import Multihop
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.standards import ACK_BYTES, G, psdu_bytes
from netmodels.switch import Switch

US, MS, S = 10**3, 10**6, 10**9
DETECTION_NS = 4 * US  # until somebody else's frame is noticed


def agrees(measured, expected, share):
    return abs(measured / expected - 1) <= share


# ------------------------------------------------------------------------------------------ wires


@pytest.mark.parametrize("load", [0.05, 0.3, 0.8])
def test_a_line_is_as_busy_as_it_is_loaded(load):
    """125 B at 1 Mb/s take 1 ms; a is one of two hosts."""
    def busy(rate):
        flow = Flow("a", ("b",), 125, 100, "periodic", round(MS / load))
        return play(Setup(AccessLink(AccessLink.Params(rate=rate)), {"a": NOWHERE, "b": NOWHERE},
                          [flow], 100 * S, warm_up_ns=S))["utilisation"]

    found = busy("1 Mb/s")
    assert agrees(found["max"], load, 1e-3)
    assert found["mean"] == pytest.approx(found["max"] / 2)
    assert not agrees(busy("0.92 Mb/s")["max"], load, 1e-3), "the twin"


def test_a_narrow_line_is_as_busy_as_it_is_loaded():
    """Poisson arrivals: the standard error of 25 000 of them is 0.6 %."""
    found = play(Bottleneck(Bottleneck.Params(load=0.6, duration="50 s")).setup())["utilisation"]
    assert agrees(found["max"], 0.6, 0.02)


def test_what_is_booked_is_not_yet_sent():
    """Ten frames of 1 ms at once."""
    bench = Bench(AccessLink(AccessLink.Params(rate="1 Mb/s")), 2)
    for _ in range(10):
        bench.send(0, "host_1", "host_2", 125)
    bench.run(4 * MS)
    assert bench.medium.model.busy_ns((0, 1)) == [4 * MS, 0]


def switched(*sent, model=Switch):
    bench = Bench(model(Switch.Params(rate="10 Mb/s", propagation="0 ns")), 3)
    for time_ns, source, receiver, size_bytes, segments in sent:
        bench.send(time_ns, source, receiver, size_bytes, segments)
    bench.run(100 * MS)
    return bench.medium.model.busy_ns((0, 1, 2))


@pytest.mark.parametrize("model", [Switch, PacketByPacket])
def test_both_directions_of_a_switch(model):
    """A packet of 980 B and one of 1480 B take 0.8 and 1.2 ms with preamble and gap, a train of two
    packets of 1480 B twice that."""
    into_1, into_2, into_3, *out = switched(
        (0, "host_1", "host_3", 980, 1), (0, "host_2", "host_3", 1480, 1),
        (20 * MS, "host_3", "host_1", 2960, 2), model=model)
    assert (into_1, into_2, into_3) == (800 * US, 1200 * US, 2400 * US)
    assert out == [2400 * US, 0, 2000 * US]


def test_an_overloaded_port_is_always_busy():
    sent = [(k * MS, f"host_{1 + k % 2}", "host_3", 1480, 1) for k in range(100)]
    busy_ns = switched(*sent)
    assert busy_ns[:2] == [60 * MS, 60 * MS - 200 * US], "the last packet is under way"
    assert agrees(busy_ns[5], 100 * MS - 1.2 * MS, 0.001), "from the first packet's arrival on"


@pytest.mark.parametrize("arbitration", ["fifo", "csma_cd"])
def test_a_bus_is_taken_until_the_gap_is_over(arbitration):
    """1238 B with preamble and 1 us of propagation and, but with fifo, the gap of 9.6 us behind."""
    bench = Bench(Bus(Bus.Params(arbitration=arbitration)), 3)
    for k in range(20):
        bench.send(2 * k * MS, f"host_{1 + k % 3}", f"host_{1 + (k + 1) % 3}", 1230)
    bench.run(100 * MS)
    busy_ns, = bench.medium.model.busy_ns((0, 1, 2))
    each_ns = 990_400 + 9_600 + (arbitration == "csma_cd") * US
    assert busy_ns == 20 * each_ns
    assert not agrees(busy_ns, 20 * (each_ns - 1238 * 800 * 0.05), 0.01), "the twin"


# ------------------------------------------------------------------------------------------ radio


def lone_sender(slot=None):
    """The time for which carrier sense should hear a sender of 1000 B at 54 Mb/s, and did."""
    found = play(Saturation(Saturation.Params(stations=1, slot=slot, duration="10 s")).setup())
    data_ns = G.airtime_ns(psdu_bytes(1046, 1), G.rate(54))
    ack_ns = G.airtime_ns(ACK_BYTES, G.reply_rate(G.rate(54)))
    backoff_ns = G.cw_min * G.slot_ns / 2
    cycle_ns = data_ns + G.sifs_ns + ack_ns + G.difs_ns + backoff_ns
    return (data_ns + ack_ns - DETECTION_NS) / cycle_ns, found["utilisation"]


def test_a_lone_saturated_sender():
    """Both stations are on the air or hear the other, who is noticed after 4 us. The mean of 25 000
    backoffs has a standard error of 0.13 % of the cycle."""
    expected, found = lone_sender()
    assert agrees(found["mean"], expected, 0.005) and agrees(found["max"], expected, 0.005)
    expected, found = lone_sender(slot="21.6 us")
    assert not agrees(found["mean"], expected, 0.005), "the twin"


def beacons(size_bytes):
    """A host of two pairs that are 10 km apart broadcasts every 10 ms, the other every 20 ms."""
    places = {"host_1": (0.0, 0.0), "host_2": (5.0, 0.0), "host_3": (10_000.0, 0.0),
              "host_4": (10_005.0, 0.0)}
    bench = Bench(DcfRadio(DcfRadio.Params()), places)
    for k in range(100):
        bench.send(10 * k * MS, "host_1", "host_2", size_bytes, broadcast=True)
        if k % 2:
            bench.send(10 * k * MS, "host_3", "host_4", size_bytes, broadcast=True)
    bench.run(S)
    return bench.medium.model.busy_ns(range(4))


def test_who_does_not_hear_the_other_sees_his_own_only():
    air_ns = G.airtime_ns(psdu_bytes(500, 1), G.rate(6))
    expected = [100 * air_ns, 100 * (air_ns - DETECTION_NS), 50 * air_ns,
                50 * (air_ns - DETECTION_NS)]
    assert beacons(500) == expected
    assert not agrees(beacons(475)[0], expected[0], 0.01), "the twin"


def test_several_hops_are_as_busy_as_their_radio():
    """Without routing messages a frame over one hop is the radio's own."""
    places = {"host_1": (0.0, 0.0), "host_2": (5.0, 0.0)}
    busy_ns = []
    for model in DcfRadio(DcfRadio.Params()), Multihop(Multihop.Params(routing="static")):
        bench = Bench(model, places)
        bench.send(MS, "host_1", "host_2", 1046)
        bench.run(10 * MS)
        busy_ns.append(model.busy_ns((0, 1)))
    assert busy_ns[0] == busy_ns[1] != [0, 0]


# ------------------------------------------------------------------------------------ the contract


@pytest.mark.parametrize("make", [
    lambda: DcfRadio(DcfRadio.Params()), lambda: AccessLink(AccessLink.Params(rate="5 Mb/s")),
    lambda: Switch(Switch.Params(rate="5 Mb/s")),
    lambda: Switch(Switch.Params(rate="5 Mb/s", buffer="10 kB")),
    *(lambda mode=mode: Bus(Bus.Params(arbitration=mode)) for mode in ("csma", "csma_cd", "fifo")),
], ids=["radio", "link", "switch", "short", "csma", "csma_cd", "fifo"])
def test_reading_changes_nothing_and_no_time_is_busy_twice(make):
    def played(instants_ns):
        model, draw = make(), random.Random(3)
        bench = Bench(model, {f"host_{k}": (4.0 * k, 0.0) for k in range(1, 6)})
        for _ in range(600):
            source, receiver = draw.sample(bench.hosts, 2)
            segments = draw.choice([1, 1, 1, 7])
            bench.send(draw.randrange(S), source, receiver, segments * draw.randint(64, 1518),
                       segments)
        seen = []
        for time_ns in instants_ns:
            bench.kernel.at(time_ns, Phase.WORLD, 0, lambda now: seen.append(
                (now, model.busy_ns(range(5)))), time_ns)
        return bench.run(2 * S), seen

    instants_ns = range(0, 2 * S, 7_654_321)
    log, seen = played(instants_ns)
    assert log == played(())[0]
    steps = [(now - before, new - old) for (before, olds), (now, news) in pairwise(seen)
             for old, new in zip(olds, news, strict=True)]
    assert all(-100 * US <= busy_ns <= elapsed_ns + 100 * US for elapsed_ns, busy_ns in steps)
    assert 0.1 < max(seen[-1][1]) / (2 * S) <= 1


def test_only_who_is_attached_counts():
    bench = Bench(AccessLink(AccessLink.Params(rate="1 Mb/s")), 4)
    bench.send(0, "host_1", "host_2", 125)
    bench.run(10 * MS)
    assert utilisation(bench.medium, 10 * MS) == {"mean": 0.025, "max": 0.1}
    bench.medium.attached = [0, 1]
    assert utilisation(bench.medium, 10 * MS) == {"mean": 0.05, "max": 0.1}
    assert utilisation(bench.medium, 0) is None


def test_a_model_need_not_say():
    assert utilisation(Bench(Disk(Disk.Params())).medium, S) is None

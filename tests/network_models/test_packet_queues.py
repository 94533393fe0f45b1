"""Queues count packets: a train takes as many places as it has packets, and what fits goes on."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from desim.testing import Bench
from netmodels.ideal_mac import IdealMac
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.radio import Radio
from netmodels.rules.bandwidth import Bandwidth
from netmodels.tdma import Tdma

MS = 1_000_000
UDP = 1064
LIMIT = 12


def uncontended(**params):
    return Radio.build(Radio.Params(fidelity="disk", **params))


QUEUES = {"dcf": lambda **params: DcfRadio(DcfRadio.Params(**params)), "disk": uncontended,
          "tdma": lambda **params: Tdma(Tdma.Params(**params)),
          "ideal_mac": lambda **params: IdealMac(IdealMac.Params(**params))}


def bench_of(name, **params):
    return Bench(QUEUES[name](queue=LIMIT, **params), {"a": (0, 0), "b": (5, 0), "c": (0, 5)})


@pytest.mark.parametrize("name", QUEUES)
@pytest.mark.parametrize("to", ["b", ["b", "c"]], ids=["unicast", "broadcast"])
def test_a_train_takes_the_places_that_are_left(name, to):
    """Trains of 5 packets: the third one loses the end of it, and the fourth all of it."""
    bench = bench_of(name)
    receivers = len(to) if isinstance(to, list) else 1
    for label in range(4):
        bench.send(0, "a", to, 5 * UDP, 5, label, broadcast=receivers > 1)
    bench.send(1000 * MS, "a", to, 5 * UDP, 5, "later", broadcast=receivers > 1)
    fates = {(label, fate) for _, label, _, _, fate in bench.run()}
    medium = bench.medium
    assert fates == {(0, "arrived"), (1, "arrived"), (2, "arrived in part"), (3, "queue_full"),
                     ("later", "arrived")}
    lost = dict.fromkeys((2, 3, 4), "queue_full")
    assert [packets for *_, packets in bench.parts] == [lost] * receivers
    assert medium.packets_dropped == {"queue_full": 8 * receivers}
    assert medium.packets_delivered == (LIMIT + 5) * receivers


@pytest.mark.parametrize("name", QUEUES)
@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 40), st.sampled_from("ab"), st.integers(1, 20),
                          st.booleans()), min_size=1, max_size=12))
def test_frames_and_packets_are_conserved(name, trains):
    """``trains``: at which ms, by whom, how many packets, whether by broadcast."""
    bench = bench_of(name)
    for label, (at_ms, sender, packets, broadcast) in enumerate(trains):
        other = "b" if sender == "a" else "a"
        bench.send(at_ms * MS, sender, [other, "c"] if broadcast else other, packets * UDP, packets,
                   label, broadcast=broadcast)
    log, medium = bench.run(), bench.medium
    assert medium.in_flight() == 0 and len(log) == medium.intended
    assert medium.intended == medium.delivered + sum(medium.dropped.values())
    assert medium.packets_intended == (medium.packets_delivered
                                       + sum(medium.packets_dropped.values()))


def test_what_the_model_refuses_costs_no_tokens():
    """Of 40 packets the radio takes 12; a 41st, when these are gone, waits for the 12 alone."""
    rule = Bandwidth(Bandwidth.Params(rate="1 Mb/s", burst="1 B"))
    bench = Bench(QUEUES["dcf"](queue=LIMIT), {"a": (0, 0), "b": (5, 0)}, rules=[rule])
    bench.send(0, "a", "b", 40 * UDP, 40)
    bench.send(50 * MS, "a", "b", UDP, label="later")
    bench.run()
    assert bench.medium.packets_dropped == {"queue_full": 28}
    assert rule.departure_ns(0) == (13 * UDP - 1) * 8 * 1000


def test_a_twin_that_takes_nothing_back_waits_for_all(monkeypatch):
    monkeypatch.setattr(Bandwidth, "refused", lambda self, host, size_bytes: None)
    with pytest.raises(AssertionError):
        test_what_the_model_refuses_costs_no_tokens()

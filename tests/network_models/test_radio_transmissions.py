"""Rules of loss and jamming on a radio act on each transmission.

The medium access repeats what they take. The twins are the rules behind it (``residual_loss``,
...), which it does not repeat.
"""

from collections import Counter

import numpy as np
import pytest

from desim import plugins
from desim.errors import ModelError
from desim.ports import Deliver, Drop
from desim.testing import Bench
from netmodels.epidemic import Epidemic
from netmodels.multihop import Multihop
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.dcf.stations import Stations
from netmodels.radio.radio import Radio
from netmodels.radio.standards import G

MS = 10**6
UDP = 1046  # B with Ethernet's headers: 1064 B on the air
DATA_NS, ACK_NS = G.airtime_ns(1064, G.rate(54)), G.airtime_ns(14, G.rate(24))
RADIO = {"path_loss": {"model": "fixed", "total": "60 dB"}}


def rule(name, **params):
    cls = plugins.load("rule", name)
    return cls(cls.Params(**params))


def bench_of(*rules, hosts=2, **params):
    return Bench(DcfRadio(DcfRadio.Params(**RADIO | params)), hosts, rules=rules)


def sent(bench, frames=2000, packets=1, **how):
    """One after another, each when the one before is over."""
    for label in range(frames):
        bench.send(label * 50 * MS, "host_1", "host_2", packets * UDP, packets, label, **how)
    bench.run()
    medium, model = bench.medium, bench.medium.model
    return (medium, medium.packets_delivered / medium.packets_intended,
            model.attempts()[0] if hasattr(model, "attempts") else None)


@pytest.mark.parametrize("p", [0.3, 0.7])
def test_a_packet_is_lost_when_all_its_transmissions_are(p):
    """1 - p^7 arrive, after (1 - p^7) / (1 - p) transmissions on the average; 3.3 standard errors
    of 2000 packets."""
    medium, share, transmissions = sent(bench_of(rule("loss", probability=p)))
    assert share == pytest.approx(1 - p**7, abs=3.3 * (p**7 * (1 - p**7) / 2000) ** 0.5)
    assert set(medium.dropped) <= {"retry_limit"}
    mean = (1 - p**7) / (1 - p)
    tries = np.arange(1, 8)
    chances = p ** (tries - 1) * np.where(tries == 7, 1, 1 - p)
    deviation = (chances @ (tries - mean) ** 2) ** 0.5
    assert transmissions / 2000 == pytest.approx(mean, abs=3.3 * deviation / 2000**0.5)


@pytest.mark.parametrize("p", [0.3, 0.7])
def test_the_twin_behind_the_medium_access_is_not_repeated(p):
    medium, share, transmissions = sent(bench_of(rule("residual_loss", probability=p)))
    assert share == pytest.approx(1 - p, abs=3.3 * (p * (1 - p) / 2000) ** 0.5)
    assert set(medium.dropped) == {"random_loss"}
    assert transmissions == medium.delivered, "what is lost is not even transmitted"


def test_the_air_is_busy_for_each_transmission_and_each_acknowledgement():
    """At the sender, who notices an acknowledgement 4 us after its beginning."""
    bench = bench_of(rule("loss", probability=0.5))
    medium, _, transmissions = sent(bench, 300)
    assert medium.model.busy_ns([0]) == [transmissions * DATA_NS
                                         + medium.delivered * (ACK_NS - 4000)]
    assert transmissions > 1.8 * 300


def test_every_other_transmission_is_lost():
    """A bad state that lasts for one packet and comes after each good one: the state changes with
    transmissions. A sender that finds the good one first goes on with it after each success."""
    bench = bench_of(rule("gilbert_elliott", p=1, r=1))
    medium, share, transmissions = sent(bench, 100)
    assert share == 1 and transmissions in (199, 200)
    medium, share, _ = sent(bench_of(rule("residual_gilbert_elliott", p=1, r=1)), 100)
    assert share == 0.5


def test_a_jammed_sender_tries_seven_times():
    """From 1 s until 2 s: 20 of 100 frames."""
    places = {"host_1": (0, 0), "host_2": (5, 0)}
    for name, reason, transmissions in (("jamming", "retry_limit", 80 + 20 * 7),
                                        ("residual_jamming", "jammed", 80)):
        jams = rule(name, at=("0 m", "0 m"), radius="3 m", until="2 s", **{"from": "1 s"})
        bench = Bench(DcfRadio(DcfRadio.Params()), places, rules=[jams])
        medium, _, found = sent(bench, 100)
        assert (medium.dropped, found) == ({reason: 20}, transmissions)


def test_a_broadcast_is_not_repeated_and_says_why_it_is_lost():
    """It is lost at each receiver by itself: of a train of ten packets, rarely all or none."""
    bench = bench_of(rule("loss", probability=0.3), hosts=3)
    for label in range(200):
        bench.send(label * 50 * MS, "host_1", ["host_2", "host_3"], 10 * UDP, 10, label,
                   broadcast=True)
    fates = Counter(fate for *_, fate in bench.run())
    medium = bench.medium
    assert medium.model.attempts()[0] == 2000 and set(medium.packets_dropped) == {"random_loss"}
    assert medium.packets_dropped["random_loss"] / 4000 == pytest.approx(0.3, abs=0.024)
    assert fates["arrived in part"] > 380


def test_a_train_is_repaired_packet_by_packet():
    bench = bench_of(rule("loss", probability=0.7), queue=2000)
    medium, share, transmissions = sent(bench, 100, 20)
    assert share == pytest.approx(1 - 0.7**7, abs=0.02)
    assert medium.delivered == 100 and transmissions > 2.8 * 2000


def test_what_a_rule_takes_is_like_what_has_errors():
    """The receiver of a broadcast that is lost leaves the medium for EIFS."""
    begins = []
    for rules in (), (rule("loss", probability=1),):
        bench = bench_of(*rules)
        bench.send(0, "host_1", ["host_2"], UDP, broadcast=True)
        bench.send(10_000, "host_2", ["host_1"], UDP, broadcast=True)
        bench.run()
        begins.append(bench.log[-1][0])
    assert begins[1] - begins[0] == G.eifs_ns - G.difs_ns


@pytest.mark.parametrize("fidelity", ["disk", "walls"])
def test_the_rungs_without_contention_repeat_as_often(fidelity):
    """Each transmission takes as long as one with the mean backoff."""
    model = Radio.build(Radio.Params(fidelity=fidelity))
    bench = Bench(model, {"host_1": (0, 0), "host_2": (5, 0)}, rules=[rule("loss",
                                                                           probability=0.5)])
    medium, share, _ = sent(bench, 1000, 5)
    assert share == pytest.approx(1 - 0.5**7, abs=3.3 * (0.5**7 / 5000) ** 0.5)
    assert set(medium.packets_dropped) == {"retry_limit"}
    (alone_ns, *_), = sent_alone(fidelity)
    delays_ns = [time_ns - label * 50 * MS for time_ns, label, *_ in bench.log]
    cycle_ns = DATA_NS + G.sifs_ns + ACK_NS + G.difs_ns + G.cw_min * G.slot_ns // 2
    repeated = 5 * ((1 - 0.5**7) / 0.5 - 1)
    assert min(delays_ns) == alone_ns
    assert np.mean(delays_ns) - alone_ns == pytest.approx(repeated * cycle_ns, rel=0.05)


def sent_alone(fidelity):
    bench = Bench(Radio.build(Radio.Params(fidelity=fidelity)),
                  {"host_1": (0, 0), "host_2": (5, 0)})
    bench.send(0, "host_1", "host_2", 5 * UDP, 5)
    return bench.run()


def test_without_such_a_rule_nobody_is_asked(monkeypatch):
    def asked(*_):
        raise AssertionError

    monkeypatch.setattr(Stations, "judge", asked)
    monkeypatch.setattr(Stations, "miss", asked)
    for rules in (), (rule("residual_loss", probability=0.5),), (rule("latency", delay="1 ms"),):
        bench = bench_of(*rules)
        assert bench.medium.judge_transmission is None
        sent(bench, 5)


@pytest.mark.parametrize("cls", [Multihop, Epidemic])
def test_rules_act_on_each_hop(cls):
    """On the way from host_1 to host_3, whom host_2 alone hears: never between those two."""
    own = {"routing": "static"} if cls is Multihop else {"interval": "100 ms"}
    model = cls(cls.Params(hop="radio", radio={"rate": "6 Mb/s", "preset": "ns3_3_44"}, **own))
    seen = []
    loss = rule("loss", probability=0.2)
    judge = loss.judge
    loss.judge = lambda frame, receivers: seen.append((frame.source, *receivers)) or judge(
        frame, receivers)
    bench = Bench(model, {"host_1": (0, 0), "host_2": (40, 0), "host_3": (80, 0)}, rules=[loss])
    for label in range(20):
        bench.send(label * 1000 * MS, "host_1", "host_3", UDP, label=label)
    log = bench.run()
    assert len(log) == 20 and not bench.medium.in_flight()
    assert (0, 1) in seen and (1, 2) in seen and (0, 2) not in seen


def test_a_rule_that_acts_on_transmissions_drops_or_passes():
    class Late:
        reasons = ("late",)
        per_transmission = True
        verdict = Deliver(5)

        def start(self, context, hosts):
            pass

        def judge(self, frame, receivers):
            return [self.verdict]

    for verdict, says in ((Deliver(5), "wanted: Drop or Pass"), (Drop("?"), "does not declare")):
        late = Late()
        late.verdict = verdict
        bench = bench_of(late)
        bench.send(0, "host_1", "host_2", UDP)
        with pytest.raises(ModelError, match=says):
            bench.run()

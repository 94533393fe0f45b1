"""``cellular`` and the rule ``stall`` against measured round trips and the laws of their parts."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from round_trips import BACK_MS, MEASURED_MS

from desim.errors import InputError
from desim.testing import Bench
from desim.units import NS_PER_S
from netmodels import cellular
from netmodels.cellular import Cellular, Gaps
from netmodels.ideal import Ideal
from netmodels.rules.stalls import Stall
from netmodels.stalls import StallLaw, Stalls

MS = 10**6
FRAMES = 20_000


def model(**params):
    return Cellular(Cellular.Params(**{"gaps": None, "wired": ["host_2"], **params}))


def delays_ms(**params):
    """Of frames from a modem to a wired host, each alone."""
    bench = Bench(model(**params), 2)
    for k in range(FRAMES):
        bench.send(k * NS_PER_S, "host_1", "host_2", 1066, label=k)
    return [time_ns / MS - 1000 * label for time_ns, label, *_ in bench.run(10**20)]


def assert_as_measured(found_ms):
    for share, measured_ms in MEASURED_MS.items():
        tenth = 0.1 * (1 - share)  # three standard errors at p99.9, more elsewhere
        low, high = np.quantile(found_ms, [share - tenth if share > 0.5 else share,
                                           min(share + tenth, 1.0)]) + BACK_MS
        assert low - 1.0 <= measured_ms <= high + 1.0, share


def test_round_trips_are_as_measured():
    assert_as_measured(delays_ms())


def test_other_grants_would_be_seen(monkeypatch):
    monkeypatch.setattr(cellular, "_UPLINK_MS", tuple(np.linspace(5.5, 118.5, 17)))
    with pytest.raises(AssertionError):
        assert_as_measured(delays_ms())


@given(st.lists(st.tuples(st.integers(0, 500), st.integers(1, 1500)), min_size=2, max_size=20))
def test_frames_of_a_modem_stay_in_order(sent):
    bench = Bench(model(gaps=Gaps(every="1 s")), 2)
    for label, (at_ms, size_bytes) in enumerate(sorted(sent, key=lambda one: one[0])):
        bench.send(at_ms * MS, "host_1", "host_2", size_bytes, label=label)
    assert [row[1] for row in bench.run(10**20)] == list(range(len(sent)))


def test_to_a_modem_it_takes_the_core_the_downlink_and_its_radio():
    bench = Bench(model(down="8 Mb/s"), 3)
    bench.send(0, "host_2", "host_1", 1000, label="one")
    bench.send(0, "host_2", "host_1", 1000, label="behind it")
    assert [(row[0], row[1]) for row in bench.run(10**20)] == [
        (37 * MS + MS + 7_500_000, "one"), (37 * MS + 2 * MS + 7_500_000, "behind it")]


def test_between_wired_hosts_it_takes_the_core_alone():
    bench = Bench(model(wired=["host_*"]), 2)
    bench.send(0, "host_1", "host_2", 10**6)
    assert bench.run(10**20)[0][0] == 37 * MS


def test_each_link_keeps_what_fits_its_queue():
    """At 8 Mb/s a packet of 1000 B takes 1 ms; of ten at once the first is being sent, and two
    wait."""
    for where in ("up", "down"):
        source, receiver = ("host_1", "host_2") if where == "up" else ("host_2", "host_1")
        bench = Bench(model(queue="3 kB", **{where: "8 Mb/s"}), 2)
        bench.send(0, source, receiver, 10_000, 10, label="train")
        (row,) = bench.run(10**20)
        assert row[4] == "arrived in part"
        assert bench.parts == [("train", receiver, dict.fromkeys(range(3, 10), "queue_full"))]


def test_nobody_has_multicast():
    bench = Bench(model(), 3)
    bench.send(0, "host_1", ["host_2", "host_3"], 100, broadcast=True)
    assert {row[4] for row in bench.run()} == {"no_multicast"}


def test_what_is_sent_in_a_gap_waits_for_its_end():
    """A gap begins at once, and lasts 10 s: no uplink is as slow as that."""
    gaps = Gaps(every="1 ms", least="10 s", scale="1 ms", shape=0.0)
    bench = Bench(model(gaps=gaps), 2)
    bench.send(NS_PER_S, "host_1", "host_2", 100)
    arrived_ns = bench.run(10**20)[0][0]
    assert 10 * NS_PER_S < arrived_ns < 10.3 * NS_PER_S


def test_a_wired_host_must_be_there():
    with pytest.raises(InputError) as refused:
        Bench(model(wired=["base"]), 2)
    assert str(refused.value) == (".wired.0: 'base' names no host; hosts are host_1, host_2")


@pytest.mark.parametrize("law", [StallLaw(), Gaps(), StallLaw(shape=0.0)])
def test_stalls_follow_their_law(law):
    """The lengths by the inverse of their distribution, and the mean time between them: within 3.3
    standard errors."""
    stalls = Stalls(np.random.default_rng(1), law)
    lengths_ns, betweens_ns, end_ns = [], [], 0
    for _ in range(FRAMES):
        begin_ns, before_ns = stalls._begin_ns, end_ns
        end_ns = stalls.over_ns(begin_ns)
        lengths_ns.append(end_ns - begin_ns)
        betweens_ns.append(begin_ns - before_ns)
        assert stalls.over_ns(end_ns - 1) == end_ns
        stalls.over_ns(end_ns)
    for share in (0.1, 0.5, 0.9, 0.99):
        tail = -np.log1p(-share)
        tail = tail if law.shape == 0 else np.expm1(law.shape * tail) / law.shape
        below = np.mean(np.array(lengths_ns) <= law.least_ns + law.scale_ns * tail)
        assert abs(below - share) <= 3.3 * np.sqrt(share * (1 - share) / FRAMES)
    assert abs(np.mean(betweens_ns) / law.every_ns - 1) <= 3.3 / np.sqrt(FRAMES)


def test_the_rule_holds_back_what_its_hosts_send_and_are_sent():
    law = {"every": "1 ms", "least": "10 s", "scale": "1 ms", "shape": 0.0}
    bench = Bench(Ideal(Ideal.Params()), 3, rules=[Stall(Stall.Params(hosts=["host_1"], **law))])
    for label, (source, receiver) in enumerate([("host_1", "host_2"), ("host_2", "host_1"),
                                                ("host_2", "host_3")]):
        bench.send(NS_PER_S, source, receiver, 100, label=label)
    arrived = {row[1]: row[0] / NS_PER_S for row in bench.run(10**20)}
    assert arrived[0] == arrived[1] == pytest.approx(10.0, abs=0.1)
    assert arrived[2] == pytest.approx(1.0, abs=1e-3)

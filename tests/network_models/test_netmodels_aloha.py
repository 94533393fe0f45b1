"""``aloha``: small whole logs. What it carries is compared in ``desim validate``."""

import pytest

from desim.testing import Bench, check_network
from netmodels.aloha import Aloha

MS = 10**6


def bench_of(**params):
    return Bench(Aloha(Aloha.Params(rate="1 Mb/s", **params)))  # 125 B last 1 ms


@pytest.mark.parametrize("params", [{}, {"slot": "2 ms"}])
def test_it_keeps_the_contract(params):
    check_network(Aloha, **params)


def test_frames_that_overlap_are_lost_and_those_that_touch_are_not():
    bench = bench_of()
    for label, time_ns in enumerate([0, 1 * MS, 3 * MS, 3 * MS + 999_999, 4 * MS + 999_998]):
        bench.send(time_ns, f"host_{label % 3 + 1}", "host_4", 125, label=label)
    bench.send(9 * MS, "host_1", ["host_2", "host_3"], 125, label="to all", broadcast=True)
    assert {(label, fate) for _, label, _, _, fate in bench.run()} == {
        (0, "arrived"), (1, "arrived"), (2, "collision"), (3, "collision"), (4, "collision"),
        ("to all", "arrived")}


def test_in_slots_only_those_of_one_slot_overlap():
    bench = bench_of(slot="1 ms")
    for label, time_ns in enumerate([1, MS, MS + 1, 2 * MS - 1, 2 * MS + 1]):
        bench.send(time_ns, f"host_{label % 3 + 1}", "host_4", 125, label=label)
    assert [(time_ns, label, fate) for time_ns, label, _, _, fate in bench.run()] == [
        (2 * MS, 0, "collision"), (2 * MS, 1, "collision"), (3 * MS, 2, "collision"),
        (3 * MS, 3, "collision"), (4 * MS, 4, "arrived")]


def test_who_talks_across_its_own_words_is_not_understood():
    """The packet from 1 to 2 ms, and what the train has at that time."""
    bench = bench_of()
    bench.send(0, "host_1", "host_2", 1250, 10, label="train")
    bench.send(MS, "host_1", "host_2", 125, label="packet")
    assert [(label, fate) for _, label, *_, fate in bench.run()] == [
        ("packet", "collision"), ("train", "arrived in part")]
    assert bench.parts == [("train", "host_2", {1: "collision"})]


@pytest.mark.parametrize(("begin_ns", "corrupted"), [
    (MS - 1, {0: "collision", 1: "collision"}), (MS + 1, {1: "collision", 2: "collision"}),
    (-2 * MS, {}), (10 * MS, {})])
def test_a_train_loses_the_packets_that_others_overlap(begin_ns, corrupted):
    bench = bench_of()
    bench.send(2 * MS, "host_1", "host_2", 1250, 10, label="train")
    bench.send(2 * MS + begin_ns, "host_3", "host_4", 125, label="packet")
    bench.run()
    assert dict(bench.parts[0][2] if bench.parts else {}) == corrupted

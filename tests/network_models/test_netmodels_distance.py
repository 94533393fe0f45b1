"""``distance``: the table is the law, also where others send."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim.testing import Bench
from netmodels.disk import Disk
from netmodels.distance import Distance

MS = 10**6

TABLE = [("10 m", 0.9), ("20 m", 0.5), ("40 m", "20 %")]


def make(delivery=TABLE, **params):
    return Distance(Distance.Params(delivery=delivery, **params))


def delivered(model, distance_m, frames=4000, segments=1):
    """The share of so many frames that arrive so far away."""
    bench = Bench(model, {"a": (0.0, 0.0), "b": (distance_m, 0.0)})
    for label in range(frames):
        bench.send(label * MS, "a", "b", 100 * segments, segments, label=label)
    return sum(fate == "arrived" for *_, fate in bench.run()) / frames


LAW = [(0.0, 1, 0.9), (10.0, 1, 0.9), (15.0, 1, 0.7), (20.0, 1, 0.5), (30.0, 1, 0.35),
       (40.0, 1, 0.2), (15.0, 3, 0.343)]


def follows(model):
    """Within 3.3 standard errors, at every distance."""
    return all(abs(delivered(model, distance_m, segments=segments) - chance)
               < 3.3 * math.sqrt(chance * (1 - chance) / 4000)
               for distance_m, segments, chance in LAW)


def test_delivery_is_linear_between_the_rows_and_a_trains_that_of_all_its_packets():
    assert follows(make())


def test_the_twin_a_tenth_less_at_20_m_shows():
    assert not follows(make([TABLE[0], ("20 m", 0.45), TABLE[2]]))


def test_nothing_gets_beyond_the_last_row():
    places = {"a": (0, 0), "edge": (50, 0), "beyond": (50.001, 0), "none": (math.nan, 0)}
    bench = Bench(make([("50 m", 1)], rate="1 Mb/s", latency="5 ms"), places)
    bench.send(0, "a", "beyond", 125, label="unicast")
    bench.send(0, "a", ("edge", "beyond", "none"), 125, label="broadcast", broadcast=True)
    assert sorted(bench.run()) == [
        (0, "broadcast", "a", "beyond", "out_of_reach"),
        (0, "unicast", "a", "beyond", "out_of_range"),
        (7 * MS, "broadcast", "a", "edge", "arrived"),
        (7 * MS, "broadcast", "a", "none", "arrived")]


def test_a_chance_of_one_is_a_disk():
    def log(model):
        bench = Bench(model, {"a": (0, 0), "b": (60, 0), "c": (120, 0)})
        for label in range(30):
            bench.send(label * 50_000, "abc"[label % 3], "bca"[label % 3], 1500, label=label)
        return bench.run()

    assert log(make([("100 m", 1)])) == log(Disk(Disk.Params(range="100 m")))


@given(st.lists(st.tuples(st.floats(0, 1), st.floats(0, 1)), min_size=3, max_size=3))
def test_with_higher_chances_more_arrives_frame_by_frame(chances):
    """The luck of a link does not depend on its chances, nor on what other links carry."""
    def arrived(pick, others):
        rows = [(f"{10 * k} m", pick(*pair)) for k, pair in enumerate(chances)]
        bench = Bench(make(rows), {"a": (0, 0), "b": (13, 0), "c": (0, 5)})
        for label in range(40):
            bench.send(label * MS, "a", "b", 100, label=label)
            if others:
                bench.send(label * MS, "c", "b", 100)
        return {label for _, label, source, _, fate in bench.run()
                if (source, fate) == ("a", "arrived")}

    assert arrived(min, False) <= arrived(max, False)
    assert arrived(min, True) == arrived(min, False)


@pytest.mark.parametrize(("delivery", "says"), [
    ([], "at least 1 item"),
    ([("10 m", 1), ("10 m", 0)], "distances must ascend, got 10 m after 10 m"),
    ([("10 m", 1.2)], "must lie between 0 and 1"),
    ([(10, 1)], "10 has no unit"),
])
def test_tables_that_make_no_sense_are_refused(delivery, says):
    with pytest.raises(ValueError, match=says):
        make(delivery)

"""``gz_rfcomms`` and ``subt``: the fates of messages.

Their formulas are compared in ``desim validate``.
"""

import math

import numpy as np
import pytest

from desim.ports import Obstacles
from desim.testing import Bench
from desim.world.scenery import crossing
from netmodels.compatible.gz_rfcomms import CapacityWindow, GzRfComms, RfParams, delivery
from netmodels.compatible.subt import Subt
from netmodels.validation.rfcomms import DELIVERY, WORLDS

MS, S = 10**6, 10**9

def played(model, frames=4000, distance_m=300.0, every_ns=20 * MS, **options):
    """The fates of messages of 1500 B."""
    bench = Bench(model, {"a": (0.0, 0.0), "b": (distance_m, 0.0)}, **options)
    for label in range(frames):
        bench.send(label * every_ns, "a", "b", 1500, label=label)
    return [fate for *_, fate in bench.run()]


def near(fates, chance):
    share = fates.count("arrived") / len(fates)
    return abs(share - chance) < 3.3 * math.sqrt(chance * (1 - chance) / len(fates))


(_, _), (AS_SUBT, _), (AS_GAZEBO, WITH_BITS) = DELIVERY[300]


@pytest.mark.parametrize(("params", "chance"), [
    ({}, AS_GAZEBO), ({"errors": "bits"}, WITH_BITS), ({"sigma_is": "variance"}, AS_SUBT)])
def test_messages_meet_the_chances_that_the_formulas_give(params, chance):
    model = GzRfComms(GzRfComms.Params(**WORLDS, **params))
    assert near(played(model), chance)
    assert not near(played(GzRfComms(GzRfComms.Params(**WORLDS, **params, exponent=2.625))), chance)


def test_subt_is_the_older_gazebo_with_the_challenges_settings():
    assert near(played(Subt(Subt.Params())), AS_SUBT)


def across(walls):
    """So many walls across the x axis, from 10 m on."""
    x_m, far = 10.0 + np.arange(walls) * 0.5, np.full(walls, 9.0)
    return Obstacles(np.stack([x_m, -far, x_m, far], axis=1), np.zeros(walls, np.int64),
                     np.full(walls, 0.1), far, ("stone",), 0, crossing)


def test_walls_make_subts_exponent_grow_until_nothing_gets_through():
    """100 m: -70 dBm in the open; each wall takes 10 * 0.2 * log10(100) = 4 dB. -82 dBm is a ratio
    of 8 dB to the noise."""
    def share(walls, **params):
        bench = Bench(Subt(Subt.Params(sigma="0 dB", **params)), {"a": (0, 0), "b": (100, 0)})
        bench.medium._place.obstacles = across(walls)
        for label in range(400):
            bench.send(label * 20 * MS, "a", "b", 1500, label=label)
        return [fate for *_, fate in bench.run()]

    params = RfParams(**WORLDS)
    assert share(2) == ["arrived"] * 400
    assert near(share(3), float(delivery(params, -82.0, 1500)))
    assert not near(share(3, exponent_per_cost=0.22), float(delivery(params, -82.0, 1500)))
    assert share(10) == ["channel_error"] * 400
    assert share(11) == ["out_of_range"] * 400
    assert share(6, wall_cost=2) == ["out_of_range"] * 400


def test_the_capacity_is_of_bits_in_the_last_epoch():
    """1 Mb/s: 83 messages of 1500 B in a second, 996 kb; a second and a bit after the first there
    is room for one more."""
    bench = Bench(Subt(Subt.Params()), {"a": (0, 0), "b": (10, 0), "c": (0, 10)})
    for label in range(85):
        bench.send(label * MS, "a", "b", 1500, label=label)
    bench.send(S + 1, "a", "b", 1500, label="later")
    bench.send(S + 2, "a", "b", 1500, label="too early")
    fates = {label: fate for _, label, _, _, fate in bench.run()}
    assert [fates.pop(label) for label in (83, 84, "too early")] == ["rate_limited"] * 3
    assert set(fates.values()) == {"arrived"}


def test_a_broadcast_counts_for_each_receiver_and_a_receiver_has_a_capacity_too():
    bench = Bench(Subt(Subt.Params(capacity="12 kb/s")), {"a": (0, 0), "b": (9, 0), "c": (0, 9)})
    bench.send(0, "a", ("b", "c"), 1000, label="broadcast", broadcast=True)
    bench.send(MS, "b", "a", 1000, label="first")
    bench.send(MS, "c", "a", 1000, label="second")
    assert sorted(log[1:] for log in bench.run()) == [
        ("broadcast", "a", "b", "arrived"), ("broadcast", "a", "c", "rate_limited"),
        ("first", "b", "a", "arrived"), ("second", "c", "a", "receiver_limited")]


def test_the_window_forgets_what_is_older_than_an_epoch():
    window = CapacityWindow(8000, S)
    assert [window.take(time_ns, 500) for time_ns in (0, 5, 6, S, S + 1, S + 5, S + 6)] == [
        True, True, False, False, True, False, True]


def test_what_arrives_does_so_at_the_end_of_a_step_and_nothing_beyond_the_range():
    places = {"a": (0, 0), "edge": (50, 0), "beyond": (50.01, 0), "none": (math.nan, 0)}
    bench = Bench(GzRfComms(GzRfComms.Params(sigma="0 dB")), places)
    for receiver in ("edge", "beyond", "none"):
        bench.send(300_000, "a", receiver, 100, label="unicast")
    bench.send(2 * MS, "a", ("edge", "beyond", "none"), 100, label="broadcast", broadcast=True)
    assert sorted((time_ns, label, to, fate) for time_ns, label, _, to, fate in bench.run()) == [
        (300_000, "unicast", "beyond", "out_of_range"),
        (300_000, "unicast", "none", "out_of_range"),
        (MS, "unicast", "edge", "arrived"), (2 * MS, "broadcast", "beyond", "out_of_reach"),
        (2 * MS, "broadcast", "none", "out_of_reach"), (3 * MS, "broadcast", "edge", "arrived")]

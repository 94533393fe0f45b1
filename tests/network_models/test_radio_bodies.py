"""People between antennas: what they take of a radio wave, and when a radio notices them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import fresnel
from test_radio_budget import as_pairs, budget
from test_radio_pathloss import room

from desim.testing.medium_bench import Bench
from netmodels.compatible.obstruction import unobstructed
from netmodels.lora import CARRIER_HZ, Lora
from netmodels.lora_modem import SENSITIVITY_DBM
from netmodels.radio.body_loss import BodyLoss
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.uncontended import Uncontended

LIGHT_MPS, RADIUS_M, HEIGHT_M = 299_792_458.0, 0.25, 1.7
LINKS = [(5.0, 2.5), (5.0, 1.0), (10.0, 5.0), (30.0, 3.0), (30.0, 15.0)]  # m: long; to the person
CARRIERS_HZ = [1.7e9, 2.437e9, 5.18e9]


def loss_db(carrier_hz, long_m, *bodies, heights_m=(0.5, 0.5), radius_m=RADIUS_M):
    """The loss on a line along x by people at ``bodies`` x, y."""
    people = np.array([(x, y, radius_m, HEIGHT_M) for x, y in bodies]).reshape(-1, 4)
    return float(BodyLoss(LIGHT_MPS / carrier_hz).loss_db(
        people, np.array([[0.0, 0.0, long_m, 0.0]]), np.array([heights_m]))[0])


def strip_db(carrier_hz, long_m, at_m):
    """The loss behind a strip in the middle of the line: what is left is all but the wave through
    it, by Babinet's principle and Fresnel's integrals (ITU-R P.526, 4.1 and 5.2)."""
    v = RADIUS_M * np.sqrt(2 * long_m / (LIGHT_MPS / carrier_hz * at_m * (long_m - at_m)))
    s, c = fresnel(v)
    return -20 * np.log10(abs(1 - (1 + 1j) * (c - 1j * s)))


@pytest.mark.parametrize("carrier_hz", CARRIERS_HZ)
@pytest.mark.parametrize(("long_m", "at_m"), LINKS)
def test_a_body_in_the_middle_of_the_line_is_fresnels_strip(carrier_hz, long_m, at_m):
    """2.6 to 11.6 dB."""
    assert loss_db(carrier_hz, long_m, (at_m, 0.0)) == pytest.approx(
        strip_db(carrier_hz, long_m, at_m), abs=0.25)


def test_a_body_a_tenth_too_broad_or_a_longer_wave_is_not():
    """Twin."""
    def worst_db(scale_hz, radius_m):
        return max(abs(loss_db(scale_hz * carrier_hz, long_m, (at_m, 0.0), radius_m=radius_m)
                       - strip_db(carrier_hz, long_m, at_m))
                   for carrier_hz in CARRIERS_HZ for long_m, at_m in LINKS)

    assert worst_db(1.0, RADIUS_M) < 0.25
    assert worst_db(1.0, 1.1 * RADIUS_M) > 0.25
    assert worst_db(0.9, RADIUS_M) > 0.25


@pytest.mark.parametrize("at_m", [1.0, 2.0, 2.5, 4.0])
def test_one_person_costs_what_is_measured(at_m):
    """6 to 8 dB at 1.7 GHz in rooms (ITU-R P.1238, movement of objects in the room)."""
    assert 6.0 <= loss_db(1.7e9, 5.0, (at_m, 0.0)) <= 8.0


@given(st.lists(st.tuples(st.floats(0.5, 9.5), st.floats(-0.24, 0.24)), max_size=8),
       st.sampled_from(CARRIERS_HZ))
def test_bodies_on_the_line_add_up(bodies, carrier_hz):
    alone_db = [loss_db(carrier_hz, 10.0, body) for body in bodies]
    assert all(alone > 2.0 for alone in alone_db)
    assert loss_db(carrier_hz, 10.0, *bodies) == pytest.approx(sum(alone_db))


@pytest.mark.parametrize(("body", "heights_m"), [
    ((5.0, 0.26), (0.5, 0.5)),  # beside the line
    ((-0.1, 0.0), (0.5, 0.5)),  # behind an antenna
    ((10.1, 0.0), (0.5, 0.5)),
    ((5.0, 0.0), (1.8, 1.8)),  # below the line
    ((8.0, 0.0), (0.5, 2.5)),
])
def test_who_does_not_stand_in_between_costs_nothing(body, heights_m):
    assert loss_db(2.437e9, 10.0, body, heights_m=heights_m) == 0.0


def test_under_a_slanting_line():
    """It is at 1.7 m at 6 m of 10 m."""
    heights_m = (0.5, 2.5)
    assert loss_db(2.437e9, 10.0, (5.9, 0.0), heights_m=heights_m) > 2.0
    assert loss_db(2.437e9, 10.0, (6.1, 0.0), heights_m=heights_m) == 0.0


def with_people(*places):
    obstacles = room()
    object.__setattr__(obstacles, "people", np.array(
        [(x, y, RADIUS_M, HEIGHT_M) for x, y in places]).reshape(-1, 4))
    return obstacles


def test_links_and_predicted_power_lose_the_same():
    found = budget(3)
    object.__setattr__(found, "bodies", BodyLoss(LIGHT_MPS / 5.18e9))
    at, one = np.array([[0.0, 0.0], [10.0, 0.0], [0.0, 10.0]]), with_people((5.0, 0.0))
    free, _ = as_pairs(found.links(at, room()))
    taken, _ = as_pairs(found.links(at, one))
    lost_db = {pair: 10 * np.log10(free[pair] / taken[pair]) for pair in free}
    assert lost_db[0, 1] == pytest.approx(loss_db(5.18e9, 10.0, (5.0, 0.0)))
    assert lost_db[1, 0] == lost_db[0, 1]
    assert lost_db[0, 2] == lost_db[1, 2] == 0.0
    assert (found.received_dbm(at[0], at[1:], room()) - found.received_dbm(at[0], at[1:], one)
            ).tolist() == pytest.approx([lost_db[0, 1], 0.0])


@pytest.mark.parametrize("kind", [DcfRadio, Uncontended])
@pytest.mark.parametrize("people", [True, False])
def test_a_person_who_steps_in_between_is_noticed(kind, people):
    """The hosts stand, 3 dB above what the rate needs; the person comes at 0.5 s, and is seen at
    the next update of places."""
    params = DcfRadio.Params(standard="11a", rate="54 Mb/s", path_loss={
        "model": "fixed", "total": "82 dB"}, people=people)
    bench = Bench(DcfRadio(params) if kind is DcfRadio else Uncontended(params, False),
                  {"a": (0.0, 0.0), "b": (10.0, 0.0)})
    bench.medium._place.obstacles = with_people((5.0, 3.0))
    for step in range(10):
        bench.send(step * 10 ** 8, "a", "b", 1500, label=step)
    bench.kernel.run(until_ns=5 * 10 ** 8 - 1)
    bench.medium._place.obstacles = with_people((5.0, 0.0))
    bench.kernel.run(until_ns=10 ** 10)
    fates = {label: fate == "arrived" for _, label, _, _, fate in bench.log}
    assert fates == {step: step < 5 or not people for step in range(10)}


def lora_that_fades(body, *, seconds=3):
    """Of uplinks, a second apart over 10 m and 4 dB above what is heard, whether each arrives: from
    the second one on somebody stands at ``body``."""
    least_dbm = SENSITIVITY_DBM[125][0]
    params = Lora.Params(gateway="b", duty_cycle=1.0, lifetime="20 s", path_loss={
        "model": "fixed", "total": f"{14 - least_dbm - 4} dB"})
    bench = Bench(Lora(params), {"a": (0.0, 0.0), "b": (10.0, 0.0)})
    bench.medium._place.obstacles = room()
    for step in range(seconds):
        bench.send(step * 3 * 10 ** 9, "a", "b", 60, label=step)
    bench.kernel.run(until_ns=10 ** 9)
    bench.medium._place.obstacles = with_people(body)
    bench.kernel.run(until_ns=10 ** 11)
    return [fate for *_, fate in bench.log]


def test_lora_loses_what_the_radio_loses():
    """At 868 MHz a person by an antenna takes more than 4 dB, one in the middle of 10 m
    less than that, one beside the line nothing."""
    near_db, middle_db = (loss_db(CARRIER_HZ, 10.0, (at_m, 0.0), heights_m=(0.5, 0.5))
                          for at_m in (0.5, 5.0))
    assert near_db > 4.0 > middle_db > 1.0
    assert lora_that_fades((0.5, 0.0)) == ["arrived", "out_of_range", "out_of_range"]
    assert lora_that_fades((5.0, 0.0)) == lora_that_fades((5.0, 3.0)) == ["arrived"] * 3


def test_lora_that_sees_nobody_hears_all(monkeypatch):
    """The twin."""
    monkeypatch.setattr(BodyLoss, "loss_db", lambda *args: np.zeros(1))
    assert lora_that_fades((0.5, 0.0)) == ["arrived"] * 3


@pytest.mark.parametrize(("body", "seen"), [
    ((1.0, 0.0), [False, True, True]), ((1.0, 0.24), [False, True, True]),
    ((1.0, 0.26), [True, True, True]), ((0.0, 1.0), [True, False, True])])
def test_people_obstruct(body, seen):
    to_m = np.array([[2.0, 0.0], [0.0, 2.0], [np.nan, np.nan]])
    assert unobstructed(with_people(body), np.zeros(2), to_m).tolist() == seen


def test_with_the_fidelity_of_a_disk_nobody_is_in_the_way():
    params = DcfRadio.Params(standard="11a", rate="54 Mb/s", path_loss={
        "model": "fixed", "total": "82 dB"})
    bench = Bench(Uncontended(params, True), {"a": (0.0, 0.0), "b": (10.0, 0.0)})
    bench.medium._place.obstacles = with_people((5.0, 0.0))
    bench.send(0, "a", "b", 1500)
    bench.kernel.run(until_ns=10 ** 9)
    assert [fate for *_, fate in bench.log] == ["arrived"]


@given(st.lists(st.tuples(st.floats(-1.0, 11.0), st.floats(-0.5, 0.5)), min_size=1, max_size=8),
       st.floats(0.0, 3.0), st.floats(0.0, 3.0))
def test_obstacles_count_those_who_cost_something(bodies, low_m, high_m):
    """``desim why`` counts people by the port, the radio's loss by its kernel."""
    heights_m, line = np.array([[low_m, high_m]]), np.array([[0.0, 0.0, 10.0, 0.0]])
    cost = sum(loss_db(2.437e9, 10.0, body, heights_m=heights_m[0]) > 0.0 for body in bodies)
    assert with_people(*bodies).people_on(line, heights_m).tolist() == [cost]

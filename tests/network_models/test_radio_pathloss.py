"""Path loss against ns-3's table, to its printed digits, and walls one by one."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from stations import rows

from desim.errors import InputError
from desim.ports import Obstacles
from desim.ports.materials import NAMES
from desim.world.scenery import crossing
from netmodels.radio.path_loss import (
    Fixed,
    FreeSpace,
    Indoor,
    LogDistance,
    PathLossParams,
    TwoRay,
    reach_m,
)
from netmodels.radio.walls import CROSSING_DB, Walls

POWER_DBM = 16.0206


def free_space(mhz):
    return FreeSpace(mhz * 1e6)


MODELS = {"rx_dbm_logdist": LogDistance(), "rx_dbm_friis_5180MHz": free_space(5180),
          "rx_dbm_friis_2412MHz": free_space(2412)}


def as_printed(reference, column, model) -> bool:
    table = rows(reference / "ns3" / "s6_rx_power_logdistance.csv")
    received_dbm = POWER_DBM - model.loss_db(np.array([float(row["distance_m"]) for row in table]))
    return [f"{dbm:.6g}" for dbm in received_dbm] == [row[column] for row in table]


@pytest.mark.parametrize("column", MODELS)
def test_received_power(reference, column):
    assert as_printed(reference, column, MODELS[column])


@pytest.mark.parametrize(("column", "wrong"), [
    ("rx_dbm_logdist", LogDistance(exponent=3.15)),
    ("rx_dbm_logdist", LogDistance(reference_db=44.0)),
    ("rx_dbm_friis_5180MHz", free_space(5439)), ("rx_dbm_friis_2412MHz", free_space(2533)),
], ids=["exponent", "reference", "5 GHz", "2.4 GHz"])
def test_received_power_with_a_wrong_constant(reference, column, wrong):
    assert not as_printed(reference, column, wrong)


OFFICE_DB = {1: "39.60", 5: "60.57", 10: "69.60", 30: "83.92", 50: "90.57"}


def as_itu(model):
    """The recommendation's formula at 2400 MHz, to the printed digits."""
    return {d: f"{float(model.loss_db(float(d))):.2f}" for d in OFFICE_DB} == OFFICE_DB


def test_indoor_is_itu_p1238():
    assert as_itu(Indoor(2400e6))


@pytest.mark.parametrize("wrong", [Indoor(2520e6), Indoor(2400e6, "residential"),
                                   Indoor(2400e6, floors=1)], ids=["frequency", "N", "floors"])
def test_indoor_with_a_wrong_constant(wrong):
    assert not as_itu(wrong)


def test_two_floors_of_a_residential_building_are_those_of_ns3s_own_test():
    """buildings-pathloss-test, case 6: (-5, 0, 1) m to (-5, 30, 10) m at 2114 MHz."""
    def loss(mhz):
        return f"{float(Indoor(mhz * 1e6, 'residential', 2).loss_db(math.hypot(30, 9))):.4f}"

    assert loss(2114) == "88.3855" != loss(2220)
    by_floors = [float(Indoor(2e9, "commercial", n).loss_db(7.0)) for n in range(4)]
    assert np.diff(by_floors) == pytest.approx([6, 3, 3])


def test_two_rays_are_free_space_up_to_where_both_agree_and_40_db_a_decade_beyond():
    two, free = TwoRay(2412e6, 1.5), free_space(2412)
    meet_m = 4 * math.pi * 1.5 ** 2 * 2412e6 / 299_792_458
    near_m = np.array([1.0, 10.0, meet_m * (1 - 1e-9)])
    assert two.loss_db(near_m).tolist() == free.loss_db(near_m).tolist()
    assert two.loss_db(meet_m * 1.000001) == pytest.approx(free.loss_db(meet_m), abs=1e-4)
    assert two.loss_db(1000.0) == pytest.approx(40 * math.log10(1000 / 1.5))


def test_nobody_gains_and_the_unknown_stays_unknown():
    distances_m = np.array([0.0, 1e-3, np.nan])
    for model in (*MODELS.values(), TwoRay(5180e6), Indoor(2412e6)):
        loss_db = model.loss_db(distances_m)
        assert (loss_db[:2] >= 0).all() and np.isnan(loss_db[2])
    assert Fixed(70.0).loss_db(distances_m).tolist() == [70.0] * 3


@given(st.floats(40, 150))
def test_reach_is_where_the_budget_ends(budget_db):
    for model in (free_space(2412), LogDistance()):
        far_m = reach_m(model, budget_db)
        if budget_db > float(model.loss_db(1.0)):
            assert float(model.loss_db(far_m)) == pytest.approx(budget_db, abs=1e-6)
    assert reach_m(Fixed(90.0), budget_db) == (
        math.inf if budget_db >= 90 else pytest.approx(1e-3))


def test_a_block_names_its_model():
    block = PathLossParams(model="two_ray", frequency="2.4 GHz")
    assert block.chosen() == TwoRay(2.4e9)
    assert PathLossParams(**block.model_dump(by_alias=True)).chosen() == TwoRay(2.4e9)
    assert PathLossParams().chosen() == LogDistance()
    indoor = PathLossParams(model="itu_p1238", frequency="2.4 GHz", building="commercial", floors=1)
    assert indoor.chosen() == Indoor(2.4e9, "commercial", 1)


@pytest.mark.parametrize(("block", "says"), [
    ({"model": "free_space"}, "free_space needs frequency"),
    ({"model": "fixed", "exponent": 2}, "fixed has no exponent; it has total"),
    ({"height": "1 m"}, "log_distance has no height; it has exponent, reference"),
])
def test_parameters_of_another_model_are_refused(block, says):
    with pytest.raises(ValueError, match=says):
        PathLossParams(**block)


def room(*materials):
    """Walls across the x axis at x = 1, 2, 3, ..., 0.1 m thick."""
    names = tuple(CROSSING_DB)
    n = len(materials)
    x = np.arange(1.0, n + 1)

    def crossing(segments, lines):
        return np.array([(k, j) for k, (x1, _, x2, _) in enumerate(lines.tolist())
                         for j, at in enumerate(segments[:, 0].tolist())
                         if min(x1, x2) < at < max(x1, x2)], np.int64).reshape(-1, 2)

    return Obstacles(np.stack([x, -9 + 0 * x, x, 9 + 0 * x], axis=1),
                     np.array([names.index(name) for name in materials], np.int64),
                     np.full(n, 0.1), np.full(n, 2.0), names, 0, crossing)


LINES = np.array([[0.0, 0, 0.5, 0], [0, 0, 1.5, 0], [2.5, 0, 0, 0], [0, 0, 9, 0]])


def test_each_crossed_wall_costs():
    walls = room("brick", "wood", "brick")
    assert Walls().loss_db(walls, LINES).tolist() == [0, 9, 13, 22]
    own = Walls(crossing={"wood": "5 dB"}, per_metre={"brick": "10 dB"})
    assert own.loss_db(walls, LINES) == pytest.approx([0, 10, 15, 25])
    assert Walls().loss_db(room(), LINES).tolist() == [0] * 4


def test_ten_metres_of_building_cost_22_db_as_in_veins():
    """Two cuts of 9 dB and 0.4 dB a metre in between, here as two walls of 5 m."""
    walls = room("stone", "stone")
    walls.thickness_m[:] = 5.0
    veins = Walls(crossing={"stone": "9 dB"}, per_metre={"stone": "0.4 dB"})
    assert veins.loss_db(walls, LINES)[3] == pytest.approx(22.0)


def block_between(x1, x2, material="stone"):
    """A block across the x axis, of which there are the four faces."""
    faces = np.array([(x1, -5, x1, 5), (x2, -5, x2, 5), (x1, -5, x2, -5), (x1, 5, x2, 5)], float)
    names = tuple(CROSSING_DB)
    return Obstacles(faces, np.full(4, names.index(material)), np.full(4, 0.2), np.full(4, 2.0),
                     names, 0, crossing)


@pytest.mark.parametrize(("line", "loss_db"), [
    ((0, 0, 30, 0), 22),  # two cuts through ten metres: Sommer et al. 2011, equation 3
    ((30, 0, 0, 0), 22),
    ((0, 0, 9, 0), 0),
    ((0, -4, 30, 4), 18 + 0.4 * 10 * math.hypot(30, 8) / 30),
    ((0, 0, 15, 0), 9),  # an antenna inside has the cut, and no way in between
    ((12, 0, 15, 0), 0),
    ((15, -30, 15, 30), 22),
])
def test_veins_walls(line, loss_db):
    lines = np.array([line, (0, 9, 30, 9)], float)
    veins = Walls(crossing={"stone": "9 dB"}, inside={"stone": "0.4 dB"})
    found = veins.loss_db(block_between(10.0, 20.0), lines)
    assert found == pytest.approx([loss_db, 0])
    more = Walls(crossing={"stone": "9 dB"}, inside={"stone": "0.42 dB"})
    assert (more.loss_db(block_between(10.0, 20.0), lines) == found).all() == (loss_db in (0, 9))
    assert veins.loss_db(block_between(10.0, 20.0, "wood"), lines)[0] in (0, 4, 8)


def test_every_material_has_a_loss():
    assert set(CROSSING_DB) == set(NAMES)


def test_unknown_materials_are_refused():
    with pytest.raises(InputError, match=r"\.walls\.per_metre: unknown material 'wod'.*wood"):
        Walls(per_metre={"wod": "3 dB"}).check(tuple(CROSSING_DB))

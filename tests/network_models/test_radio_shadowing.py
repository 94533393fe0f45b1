"""Shadowing is normal in dB, correlated by exp(-distance / 8.3 m) at either end.

It is a property of places alone. Tolerances are four standard errors of that many links.
"""

import numpy as np
import pytest
import stations
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import j0
from test_radio_pathloss import room

from desim.engine.streams import Streams
from desim.ports import Antennas
from desim.testing import Bench, check_network
from netmodels.radio.budget import Budget
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.path_loss import LogDistance
from netmodels.radio.shadowing import Shadowing, Shadows

LINKS, SEEDS = 2000, 6
ONE = np.arange(LINKS)
SIGMA_DB, CORRELATION_M = 4.3, 8.3
WAVE_M = 299_792_458 / 2.412e9
LONG = pytest.mark.validation  # other ways are played with the others


def shadows(hosts, stream=None, **params):
    return Shadows(Shadowing(**params), tuple(f"robot_{i}" for i in range(hosts)),
                   stream or Streams(0), WAVE_M)


def moved(near_m, far_m=0.0, apart_m=None, seeds=SEEDS, **params):
    """[seeds, 2, links] dB of links and of others, whose ends are so far from theirs in some
    direction. Ends are far apart, or ``apart_m``."""
    out = []
    for seed in range(seeds):
        draw = np.random.default_rng(1000 + seed)
        links = shadows(2 * LINKS, Streams(seed), **params)
        places = draw.uniform(-5000, 5000, (2 * LINKS, 2))
        if apart_m is not None:
            places[LINKS:] = places[:LINKS] + apart_m * some_direction(draw, LINKS)
        step = np.repeat([near_m, far_m], LINKS)[:, None]
        after = places + step * some_direction(draw, 2 * LINKS)
        out.append([links.loss_db(where, ONE, ONE + LINKS) for where in (places, after)])
    return np.array(out)


def some_direction(draw, count):
    angle = draw.uniform(0, 2 * np.pi, count)
    return np.column_stack([np.cos(angle), np.sin(angle)])


def as_normal(loss_db):
    """Cut off at three sigma, which takes 0.15 % from the standard deviation."""
    count = loss_db.size
    return (abs(loss_db.mean()) < 4 * SIGMA_DB / np.sqrt(count)
            and abs(loss_db.std() / (0.9985 * SIGMA_DB) - 1) < 4 / np.sqrt(2 * count)
            and abs(np.mean(np.abs(loss_db) < SIGMA_DB) - 0.6827) < 4 * 0.465 / np.sqrt(count)
            and np.abs(loss_db).max() <= 3 * SIGMA_DB)


@pytest.mark.parametrize("apart_m", [None, pytest.param(8.0, marks=LONG), 1.0])
def test_it_is_normal_in_db(apart_m):
    """However far apart the ends are: near each other, both directions have much in common."""
    loss_db = moved(0.0, apart_m=apart_m, seeds=5)[:, 0]
    assert as_normal(loss_db) and not as_normal(4.1 / 4.3 * loss_db)


def correlated(near_m, far_m=0.0, **params):
    """Whether the correlation is that of the theory."""
    before, after = np.moveaxis(moved(near_m, far_m, **params), 1, 0)
    expected = np.exp(-(near_m + far_m) / CORRELATION_M)
    tolerance = 4 * (1 - expected ** 2) / np.sqrt(before.size)
    return abs(np.corrcoef(before.ravel(), after.ravel())[0, 1] - expected) < tolerance


@pytest.mark.parametrize(("near_m", "far_m"), [
    (4.0, 0.0), (0.0, 8.3), *(pytest.param(*ends, marks=LONG) for ends in (
        (4.0, 4.0), (1.0, 0.0), (8.3, 0.0), (20.0, 0.0), (100.0, 100.0)))])
def test_it_is_correlated_along_the_way(near_m, far_m):
    assert correlated(near_m, far_m)


@pytest.mark.parametrize("wrong", [pytest.param("7.4 m", marks=LONG), "9.3 m"])
def test_with_a_wrong_correlation_distance(wrong):
    assert not correlated(8.3, 0.0, correlation=wrong)


def test_neighbours_hear_a_third_alike():
    """Two robots 2 m from each other and one far away: 79 % in common, for any three; where they
    had nothing in common, there would be a wall between any two. 100 m from each other: nothing."""
    for apart_m, expected in (2.0, np.exp(-2 / CORRELATION_M)), (100.0, 0.0):
        one, other = [], []
        for seed in range(SEEDS // 2):
            draw = np.random.default_rng(seed)
            sender, near = draw.uniform(-5000, 5000, (2, LINKS, 2))
            beside = near + apart_m * some_direction(draw, LINKS)
            links = shadows(3 * LINKS, Streams(seed))
            places = np.concatenate([sender, near, beside])
            one.append(links.loss_db(places, ONE, ONE + LINKS))
            other.append(links.loss_db(places, ONE, ONE + 2 * LINKS))
        found = np.corrcoef(np.ravel(one), np.ravel(other))[0, 1]
        assert abs(found - expected) < 4 * (1 - expected ** 2) / np.sqrt(LINKS * SEEDS // 2)


def echoes_db(way_m, far_m=0.0, wave_m=WAVE_M):
    """[2, links] dB of echoes, and of those whose ends are so far from theirs."""
    links = Shadows(Shadowing(sigma="0 dB", echoes="3 dB"), ("a", "b") * LINKS, Streams(1), wave_m)
    draw = np.random.default_rng(5)
    places = draw.uniform(-5000, 5000, (2 * LINKS, 2))
    after = places + np.repeat([way_m, far_m], LINKS)[:, None] * some_direction(draw, 2 * LINKS)
    return np.array([links.loss_db(where, ONE, ONE + LINKS) for where in (places, after)])


def echoes_fade(waves, far_waves=0.0, **params):
    """Whether the correlation over so many wavelengths is J0^2, the product of both ends'."""
    expected = (j0(2 * np.pi * waves) * j0(2 * np.pi * far_waves)) ** 2
    found = np.corrcoef(echoes_db(waves * WAVE_M, far_waves * WAVE_M, **params))[0, 1]
    return abs(found - expected) < 4 * (1 - expected ** 2) / np.sqrt(LINKS)


@pytest.mark.parametrize(("waves", "far_waves"), [
    (0.05, 0.0), (0.2, 0.0), (0.1, 0.1), (0.5, 0.0), (0.0, 3.0)])
def test_echoes_are_others_half_a_wavelength_away(waves, far_waves):
    assert echoes_fade(waves, far_waves)


def test_with_a_wavelength_a_fifth_longer():
    assert not echoes_fade(0.2, wave_m=1.2 * WAVE_M)


def test_a_place_keeps_its_echoes():
    """Nine places half a wavelength apart, and the first one again."""
    model = DcfRadio(DcfRadio.Params(preset="indoor"))
    Bench(model, {"a": (0.0, 0.0), "b": (9.0, 2.0)})
    away = [(9.0 + k * WAVE_M / 2, 2.0) for k in (0, 1, 2, 3, 4, 5, 6, 7, 8, 0)]
    mw = [model.budget.links(np.array([(0.0, 0.0), place]), room()).mw[0] for place in away]
    assert mw[0] == mw[-1] and np.abs(np.diff(10 * np.log10(mw[:-1]))).max() > 2.0


def test_stations_receive_what_coverage_predicts():
    """Broadcasts at 6 Mb/s arrive wherever they are found, 39 dB above the noise."""
    model = DcfRadio(DcfRadio.Params(preset="indoor", reception={"preamble": "-55 dBm"}))
    places = np.random.default_rng(4).uniform(-70, 70, (200, 2))
    names = [f"robot_{k:03}" for k in range(200)]
    bench = Bench(model, {"a": (0.0, 0.0), **dict(zip(names, places, strict=True))})
    bench.send(0, "a", names, 100, broadcast=True)
    arrived = sorted(receiver for *_, receiver, fate in bench.run() if fate == "arrived")
    power_dbm = model.signal(np.zeros(2), places).power_dbm
    assert arrived == [name for name, dbm in zip(names, power_dbm, strict=True) if dbm >= -55]
    assert 60 < len(arrived) < 140


place = st.tuples(st.floats(-100, 100), st.floats(-100, 100))


@given(place, place)
def test_either_direction_is_the_same_and_so_is_whoever_stands_there(here, there):
    first, second = shadows(2), shadows(5)
    one, other = np.array([0]), np.array([1])
    loss_db = first.loss_db(np.array([here, there]), one, other)
    assert loss_db == first.loss_db(np.array([there, here]), one, other)
    places = np.array([(3.0, 3.0), there, (9.0, 1.0), here, (0.0, 0.0)])
    assert loss_db == second.loss_db(places, np.array([3]), np.array([1]))
    assert loss_db == pytest.approx(second.between_db(np.array(here), np.array([there])))


def test_a_place_that_nobody_knows_is_another_one_for_each():
    """Hosts without a place, over a path loss that needs none."""
    one, other = np.triu_indices(60, 1)
    loss_db = shadows(60).loss_db(np.full((60, 2), np.nan), one, other)
    assert abs(loss_db.std() / SIGMA_DB - 1) < 0.15 and np.unique(loss_db).size > 1700


def test_neither_the_order_nor_the_others_matter():
    draw = np.random.default_rng(1)
    places = draw.uniform(-50, 50, (40, 2))
    one, other = np.triu_indices(40, 1)
    all_db = shadows(40).loss_db(places, one, other)
    few = np.flatnonzero(other < 7)
    assert shadows(7).loss_db(places[:7], one[few], other[few]).tolist() == (
        all_db[few].tolist())
    order = draw.permutation(len(one))
    assert shadows(40).loss_db(places, one[order], other[order]).tolist() == (
        all_db[order].tolist())
    others = draw.permutation(40)  # the same places, declared in another order
    again = shadows(40).loss_db(places[others], *(np.argsort(others)[those]
                                                  for those in (one, other)))
    assert again.tolist() == all_db.tolist()


@pytest.mark.parametrize("shadowing", [
    {"sigma": "6 dB"}, {"sigma": "0 dB", "echoes": "6 dB"}, {"sigma": "4 dB", "echoes": "4.5 dB"}])
def test_coverage_knows_of_it(shadowing):
    model = DcfRadio(DcfRadio.Params(shadowing=shadowing))
    Bench(model, {"a": (0.0, 0.0), "b": (20.0, 5.0)})
    plain = DcfRadio(DcfRadio.Params())
    Bench(plain, 1)
    to_m = np.random.default_rng(3).uniform(-80, 80, (5000, 2))
    found = (model.signal(np.zeros(2), to_m).power_dbm - plain.signal(np.zeros(2), to_m).power_dbm)
    assert 4.5 < found.std() < 7.5
    links = model.budget.links(np.array([(0.0, 0.0), (20.0, 5.0)]), room())
    assert 10 * np.log10(links.mw) == pytest.approx(
        model.signal(np.zeros(2), np.array([[20.0, 5.0]])).power_dbm[0])


def test_a_link_is_as_good_in_either_direction():
    links = Budget(16.0206, LogDistance(), None, shadows(30), -101.0, -82.0, np.ones(30),
                   Antennas.plain(30)).links(
        np.random.default_rng(2).uniform(0, 100, (30, 2)), None)
    mw = np.zeros((30, 30))
    mw[np.repeat(np.arange(30), np.diff(links.first)), links.hearer] = links.mw
    assert np.array_equal(mw, mw.T) and np.count_nonzero(mw) > 800


def test_at_the_edge_half_of_the_links_are_there():
    """P(link) = Q((threshold - mean) / sigma): 0.5 where the mean is the threshold, 0.841 a sigma
    nearer, whatever sigma is."""
    def share(distance_m, sigma):
        received = 0
        for seed in range(20):
            places = {f"robot_{i:02}": (1e4 * (i // 2) + i % 2 * distance_m, 0.0)
                      for i in range(40)}
            model = DcfRadio(DcfRadio.Params(shadowing={"sigma": sigma}, walls=None,
                                             **stations.LINKS))
            bench = Bench(model, places, seed=seed)
            for i in range(0, 40, 2):
                bench.send(0, f"robot_{i:02}", [f"robot_{i + 1:02}"], 100, broadcast=True)
            received += sum(fate == "arrived" for *_, fate in bench.run())
        return received / 400

    edge_m = 51.46
    assert share(edge_m, "4.3 dB") == pytest.approx(0.5, abs=4 * 0.5 / 20)
    assert share(edge_m * 10 ** (-4.3 / 30), "4.3 dB") == pytest.approx(0.841, abs=4 * 0.366 / 20)


def test_it_keeps_the_contract():
    check_network(DcfRadio, shadowing={"sigma": "6 dB", "correlation": "10 m"})

"""Shadowing against what it shall be: normal in dB, correlated by exp(-distance / 8.3 m) at either
end, and a property of places and names. Tolerances are four standard errors of that many links."""

import numpy as np
import pytest

from desim.streams import Streams
from desim.testing import Bench, check_network
from netmodels.radio import Radio
from netmodels.radio.budget import Budget
from netmodels.radio.pathloss import LogDistance
from netmodels.radio.shadowing import Shadowing, Shadows

LINKS, SEEDS = 2000, 10
ONE = np.arange(LINKS)
SIGMA_DB, CORRELATION_M = 4.3, 8.3


def shadows(hosts, stream=None, **params):
    return Shadows(Shadowing(**params), tuple(f"robot_{i}" for i in range(hosts)),
                   stream or Streams(0))


def moved(near_m, far_m=0.0, **params):
    """[seeds, 2, links] dB of links whose ends are far apart, before and after both have moved so
    far in some direction."""
    out = []
    for seed in range(SEEDS):
        draw = np.random.default_rng(seed)
        links = shadows(2 * LINKS, lambda *name, draw=draw: draw, **params)
        places = draw.uniform(-5000, 5000, (2 * LINKS, 2))
        direction = draw.uniform(0, 2 * np.pi, 2 * LINKS)
        step = np.repeat([near_m, far_m], LINKS)
        after = places + step[:, None] * np.column_stack([np.cos(direction), np.sin(direction)])
        out.append([links.loss_db(where, ONE, ONE + LINKS) for where in (places, after)])
    return np.array(out)


def as_normal(loss_db):
    """Cut off at three sigma, which takes 0.15 % from the standard deviation."""
    count = loss_db.size
    return (abs(loss_db.mean()) < 4 * SIGMA_DB / np.sqrt(count)
            and abs(loss_db.std() / (0.9985 * SIGMA_DB) - 1) < 4 / np.sqrt(2 * count)
            and abs(np.mean(np.abs(loss_db) < SIGMA_DB) - 0.6827) < 4 * 0.465 / np.sqrt(count)
            and np.abs(loss_db).max() <= 3 * SIGMA_DB)


def test_it_is_normal_in_db():
    assert as_normal(moved(0.0)[:, 0])
    assert not as_normal(moved(0.0, sigma="4.1 dB")[:, 0])


def correlated(near_m, far_m=0.0, **params):
    """Whether the correlation is that of the theory."""
    before, after = np.moveaxis(moved(near_m, far_m, **params), 1, 0)
    expected = np.exp(-(near_m + far_m) / CORRELATION_M)
    tolerance = 4 * (1 - expected ** 2) / np.sqrt(before.size)
    return abs(np.corrcoef(before.ravel(), after.ravel())[0, 1] - expected) < tolerance


@pytest.mark.parametrize(("near_m", "far_m"), [(1.0, 0.0), (4.0, 0.0), (8.3, 0.0), (0.0, 8.3),
                                               (4.0, 4.0), (20.0, 0.0), (100.0, 100.0)])
def test_it_is_correlated_along_the_way(near_m, far_m):
    assert correlated(near_m, far_m)


@pytest.mark.parametrize("wrong", ["7.6 m", "9.1 m"])
def test_with_a_wrong_correlation_distance(wrong):
    assert not correlated(8.3, 0.0, correlation=wrong)


def test_links_of_one_robot_have_nothing_in_common():
    """One end is the same, the other ends are at one place: still other robots."""
    links, places = shadows(LINKS + 1), np.zeros((LINKS + 1, 2))
    loss_db = links.loss_db(places, np.zeros(LINKS, np.int64), ONE + 1)
    assert abs(np.corrcoef(loss_db[:-1], loss_db[1:])[0, 1]) < 4 / np.sqrt(LINKS)
    assert abs(loss_db.mean()) < 4 * SIGMA_DB / np.sqrt(LINKS)


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
    assert [shadows(40).loss_db(places, one[k:k + 1], other[k:k + 1])[0]
            for k in range(9)] == all_db[:9].tolist()


def test_a_link_is_as_good_in_either_direction():
    links = Budget(16.0206, LogDistance(), None, shadows(30), -101.0, -82.0, np.ones(30)).links(
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
            bench = Bench(Radio(Radio.Params(shadowing={"sigma": sigma}, walls=None)), places,
                          seed=seed)
            for i in range(0, 40, 2):
                bench.send(0, f"robot_{i:02}", [f"robot_{i + 1:02}"], 100, broadcast=True)
            received += sum(fate == "arrived" for *_, fate in bench.run())
        return received / 400

    edge_m = 51.46
    assert share(edge_m, "4.3 dB") == pytest.approx(0.5, abs=4 * 0.5 / 20)
    assert share(edge_m * 10 ** (-4.3 / 30), "4.3 dB") == pytest.approx(0.841, abs=4 * 0.366 / 20)


def test_it_keeps_the_contract():
    check_network(Radio, shadowing={"sigma": "6 dB", "correlation": "10 m"})

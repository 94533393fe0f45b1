"""Audibility: who hears whom?

The same as if everybody were compared with everybody, at the price of those who are near.
"""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from stations import air, by_distance
from test_radio_pathloss import room

from desim.ports import Antennas
from netmodels.radio.budget import Budget
from netmodels.radio.path_loss import Fixed, LogDistance
from netmodels.radio.standards import A
from netmodels.radio.walls import Walls

POWER_DBM, HEARD_DBM, FOUND_DBM = 16.0206, -101.0, -82.0


def budget(hosts, path_loss=None, channels=None, walls=None, antennas=None):
    return Budget(POWER_DBM, path_loss or LogDistance(), walls, None, HEARD_DBM, FOUND_DBM,
                  np.ones(hosts) if channels is None else np.array(channels),
                  antennas or Antennas.plain(hosts))


def as_pairs(links):
    """{(source, hearer): mW}, and the pairs that find each other's frames."""
    hosts = len(links.first) - 1
    source = np.repeat(np.arange(hosts), np.diff(links.first)).tolist()
    heard = dict(zip(zip(source, links.hearer.tolist(), strict=True), links.mw.tolist(),
                     strict=True))
    return heard, {(i, k) for i in range(hosts) for k in links.finders(i)}


places = st.lists(st.tuples(*[st.one_of(st.floats(-400, 400), st.just(np.nan))] * 2), max_size=30)


@given(places, st.integers(1, 3))
def test_neighbours_are_those_of_a_comparison_with_all(places, channels):
    at = np.array(places, dtype=float).reshape(-1, 2)
    channel = [i % channels for i in range(len(at))]
    heard, found = as_pairs(budget(len(at), channels=channel).links(at, None))
    distance_m = np.linalg.norm(at[:, None] - at[None], axis=2)
    dbm = POWER_DBM - LogDistance().loss_db(distance_m)
    wanted = {(i, k): dbm[i, k] for i in range(len(at)) for k in range(len(at))
              if i != k and channel[i] == channel[k]}
    assert set(heard) == {pair for pair, level in wanted.items() if level > HEARD_DBM}
    assert found == {pair for pair, level in wanted.items() if level >= FOUND_DBM}
    assert all(np.isclose(mw, 10 ** (wanted[pair] / 10)) for pair, mw in heard.items())


@given(places, st.integers(1, 3))
def test_powers_are_those_of_links_and_know_no_channels(places, channels):
    at = np.array(places, dtype=float).reshape(-1, 2)
    apart = budget(len(at), channels=[i % channels for i in range(len(at))])
    power_dbm = apart.powers_dbm(apart.losses(at, None))
    together, _ = as_pairs(budget(len(at)).links(at, None))
    assert set(together) == set(zip(*np.nonzero(power_dbm > HEARD_DBM), strict=True))
    assert all(np.isclose(mw, 10 ** (power_dbm[pair] / 10)) for pair, mw in together.items())


def test_signals_travel_at_the_speed_of_light():
    """300 m take 1000.7 ns; where a host has no place, nothing."""
    at = np.array([[0.0, 0.0, 9.0], [180.0, 240.0, 0.0], [np.nan, np.nan, 0.0]])
    links = budget(3, Fixed(60.0)).links(at[:, :2], None)
    delays_ns = dict(zip(as_pairs(links)[0], links.delays_ns(at).tolist(), strict=True))
    assert delays_ns == {(0, 1): 1001, (1, 0): 1001, **dict.fromkeys(
        [(0, 2), (1, 2), (2, 0), (2, 1)], 0)}


def test_where_places_do_not_matter_all_hear_all():
    heard, found = as_pairs(budget(3, Fixed(60.0)).links(np.full((3, 2), np.nan), None))
    assert len(heard) == len(found) == 6


def test_a_wall_is_in_the_way_in_both_directions():
    at = np.array([[0.0, 0.0], [30.0, 0.0], [np.nan, np.nan]])
    free, _ = as_pairs(budget(3, walls=Walls()).links(at, room()))
    behind, _ = as_pairs(budget(3, walls=Walls()).links(at, room("brick")))
    for pair in (0, 1), (1, 0):
        assert np.isclose(10 * np.log10(free[pair] / behind[pair]), 9.0)
    assert len(behind) == 2


def test_a_frame_touches_no_more_stations_in_a_larger_fleet():
    """All stand 400 m apart in a row, and whatever is above -130 dBm is heard: 5 on either side."""
    def touched(hosts):
        stations = air(A, by_distance(*((400.0 * k, 0.0) for k in range(hosts))))
        assert stations.next_ns > 0
        stations.enqueue(0, hosts // 2, -1, 264, A.rate(6))
        stations.advance(stations.next_ns)
        return int(stations._arrays.states[0].touched[0, 0])

    assert touched(20) == touched(400) == 11

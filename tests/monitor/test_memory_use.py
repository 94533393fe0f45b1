"""Memory in use: means, peaks, shares of limits and processes that were killed."""

from types import SimpleNamespace

import numpy as np

from desim.monitor.meters.memory_use import MemoryUse

MB = 10**6


def host(name, used_mb, limit_mb=None, kills=()):
    """A host that uses the numbers of ``used_mb`` one after the other, at each question."""
    return SimpleNamespace(name=name, computer="one", memory=SimpleNamespace(
        limit_bytes=limit_mb and limit_mb * MB, kills=list(kills),
        used_bytes=(used * MB for used in used_mb).__next__))


def use(*used_mb):
    """Two robots, of which one has a limit, and a base that is not measured."""
    robots = [host("a", used_mb, 400, ["slam", "map", "slam"]),
              host("b", [3 * used for used in used_mb])]
    return MemoryUse(SimpleNamespace(loaded=robots, robots=("a", "b"),
                                     stationary=[SimpleNamespace(name="base", memory=None)]))


def test_a_sample_is_the_mean_over_robots_and_of_shares_over_those_with_a_limit():
    assert use(100).sample(0, None) == {"ram_mb": 200.0, "ram_percent": 25.0}
    assert use(100).quantities(0) == {"ram_mb": 200.0, "memory_kills": 3}


def test_nothing_is_measured_where_computers_are_ideal():
    nobody = MemoryUse(SimpleNamespace(loaded=[], robots=(), stationary=[]))
    assert nobody.sample(0, None) == nobody.quantities(0) == nobody.track(None) == {}


def test_hosts_have_means_and_peaks_over_the_seconds():
    measured = use(100, 300, 200)
    for _ in range(3):
        measured.each_second(None)
    assert measured.by_host(0) == {
        "a": {"ram_mb": 200.0, "ram_percent": 50.0, "peak_ram_mb": 300.0,
              "killed": {"map": 1, "slam": 2}},
        "b": {"ram_mb": 600.0, "ram_percent": None, "peak_ram_mb": 900.0, "killed": {}},
        "base": {"ram_mb": None, "ram_percent": None, "peak_ram_mb": None, "killed": {}}}
    assert measured.summary(0) == {"mean_ram_mb": 400.0, "mean_ram_percent": 50.0,
                                   "memory_kills": 3}


def test_a_track_has_a_column_for_each_quantity():
    columns = use(100).track(None)
    assert columns["ram_mb"].tolist() == [100.0, 300.0]
    np.testing.assert_equal(columns["ram_percent"], [25.0, np.nan])
    assert columns["memory_kills"] == [3, 0]

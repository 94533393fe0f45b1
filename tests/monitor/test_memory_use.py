"""Memory in use: means, peaks, shares of limits and processes that were killed."""

from types import SimpleNamespace

import numpy as np

from desim.middleware.busy.host import BusyHost
from desim.monitor.memory_use import NOT_MEASURED, MemoryUse, fleet_summary

MB = 10**6


def host(name, used_mb, limit_mb=None, kills=()):
    """A host that uses the numbers of ``used_mb`` one after the other, second by second."""
    one = BusyHost.__new__(BusyHost)
    one.name = name
    one.memory = SimpleNamespace(limit_bytes=limit_mb and limit_mb * MB, kills=list(kills),
                                 used_bytes=(used * MB for used in used_mb).__next__)
    return one


def fleet(*used_mb):
    return MemoryUse([host("a", used_mb, 400, ["slam", "map", "slam"]),
                      host("b", [3 * used for used in used_mb])])


def test_a_sample_is_the_mean_over_hosts_and_of_shares_over_those_with_a_limit():
    assert fleet(100).sample() == {"ram_mb": 200.0, "ram_percent": 25.0}
    assert fleet(100).quantities() == {"ram_mb": 200.0, "memory_kills": 3}
    assert MemoryUse([]).sample() == MemoryUse([]).quantities() == {}


def test_hosts_have_means_and_peaks_over_the_seconds():
    use = fleet(100, 300, 200)
    assert [use.each_second() for _ in range(3)] == [
        [100 * MB, 300 * MB], [300 * MB, 900 * MB], [200 * MB, 600 * MB]]
    summaries = use.summary()
    assert summaries == {
        "a": {"ram_mb": 200.0, "ram_percent": 50.0, "peak_ram_mb": 300.0,
              "killed": {"map": 1, "slam": 2}},
        "b": {"ram_mb": 600.0, "ram_percent": None, "peak_ram_mb": 900.0, "killed": {}}}
    assert fleet_summary([*summaries.values(), NOT_MEASURED]) == {
        "mean_ram_mb": 400.0, "mean_ram_percent": 50.0, "memory_kills": 3}


def test_a_table_has_a_column_for_each_quantity():
    columns = fleet(100).columns([[100 * MB, 300 * MB]] * 2, [[3, 0]] * 2)
    assert columns["ram_mb"].tolist() == [[100.0, 300.0]] * 2
    np.testing.assert_equal(columns["ram_percent"], [[25.0, np.nan]] * 2)
    assert columns["memory_kills"].tolist() == [[3, 0]] * 2
    assert MemoryUse([]).columns([[]], [[]]) == {}

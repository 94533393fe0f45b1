"""The values of a campaign's metrics for one run."""

import pytest
from designs import planned

from desim.campaign.design.metrics import Metrics

DESIGN = """metrics:
  seconds_per_m2: exploration_time_s / explored_area_m2
  late: exploration_time_s > 50
  twice: 2 * explored
"""
REACHED = {"stop_reason": "elapsed", "simulated_s": 100.0, "exploration_time_s": 40.0,
           "explored": 0.99, "explored_area_m2": 80.0, "map_quality": None}
NOT_REACHED = {**REACHED, "exploration_time_s": None, "explored": 0.5, "explored_area_m2": 50.0}


@pytest.fixture(scope="module")
def metrics(tmp_path_factory):
    return Metrics(planned(tmp_path_factory.mktemp("design"), DESIGN))


def row(metrics, status="finished"):
    return {"run_id": "a", "status": status, "metrics": metrics, "functions": {}}


@pytest.mark.parametrize("name, reached, not_reached", [
    ("exploration_time_s", 40.0, 100.0),  # the run's end: no less than that
    ("seconds_per_m2", 0.5, 2.0),  # 40 / 80, 100 / 50
    ("late", 0.0, 1.0),
    ("explored", 0.99, 0.5),
    ("twice", 1.98, 1.0),
    ("map_quality", None, None),  # no instant: there is none
])
def test_an_instant_that_was_not_reached_counts_as_the_end_of_the_run(metrics, name, reached,
                                                                      not_reached):
    assert metrics.value(name, row(REACHED)) == reached
    assert metrics.value(name, row(NOT_REACHED)) == not_reached


def test_of_a_run_that_stopped_for_another_reason_no_instant_is_known(metrics):
    stopped = row({**NOT_REACHED, "stop_reason": "explored"})
    assert metrics.value("exploration_time_s", stopped) is None
    assert metrics.value("seconds_per_m2", stopped) is None
    assert metrics.value("explored", stopped) == 0.5


def test_the_table_has_no_value_for_it(metrics):
    found = metrics.of(row(NOT_REACHED))
    assert found["exploration_time_s"] is found["seconds_per_m2"] is found["late"] is None
    assert found["twice"] == 1.0


def test_a_run_that_failed_has_no_metrics(metrics):
    assert metrics.value("exploration_time_s", {"run_id": "a", "status": "failed",
                                                "error": "boom"}) is None

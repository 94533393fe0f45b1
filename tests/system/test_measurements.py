"""Measurements of whole runs, each with a period of its own (``measure.periods``)."""

import numpy as np
import pytest
from runs import HELLO, built

import desim
from desim.export.animation.scene import AnimationScene
from desim.export.ros.topics import _explored
from desim.monitor.summary import robots_table, samples_table, summarize
from desim.report.run_figure import png
from desim.results.recording import Recording
from desim.results.samples import measured
from desim.scenario.quantities import measurements

BUSY = ("computers=measured", "robot.power={}", "middleware=ros1", "stop.elapsed=6 s")
# All that this run may have: quantities of another task and of DDS are not among these.
NAMES = {*measurements(())} - {"matched_pairs"}
RATES = ("cpu_percent", "node_cpu_percent", "rx_kBps", "tx_kBps", "bytes_per_s:/*/scan")


def tables(*overrides):
    """The samples of 6 s, the robots' table and the summary."""
    simulation = built(HELLO, *BUSY, *overrides)
    simulation.run()
    monitor = simulation.monitor
    return samples_table(monitor), robots_table(monitor), summarize(
        monitor, simulation.kernel.now_ns)


@pytest.fixture(scope="module")
def usual():
    return tables("measure.every=1 s")


def test_each_name_that_may_have_a_period_is_a_column(usual):
    samples, _, _ = usual
    assert {name.partition(":")[0] for name in samples} - {"time_s", "cause"} == NAMES - {
        "robots"}


@pytest.mark.parametrize("name", RATES)
def test_a_rate_is_that_of_its_own_period(name, usual):
    """The same as where all have this period, and null between."""
    column = name.partition(":")[0]
    samples, robots, summary = tables("measure.every=3 s", f"measure.periods={{{column}: 1 s}}")
    assert samples["time_s"] == usual[0]["time_s"]
    assert samples[name] == usual[0][name]
    assert [share is None for share in samples["explored"]] == [
        time_s % 3 != 0 for time_s in samples["time_s"]]
    assert (robots["rx_bytes"] == usual[1]["rx_bytes"]).all()
    # Means over the samples are over others, and all else is the same.
    differ = {key for key in summary if summary[key] != usual[2][key]}
    assert differ <= {"map_age_s", "stale_age_s"}


def test_a_rate_bridges_the_samples_without_it(usual):
    samples, robots, summary = tables("measure.every=1 s", "measure.periods={rx_kBps: 3 s, "
                                      "robots: 2 s, bytes_per_s: 3 s}")
    for name in ("rx_kBps", "bytes_per_s:/*/scan"):
        every = usual[0][name][1:7]
        assert samples[name][1:3] == [None, None] == samples[name][4:6]
        assert samples[name][3::3] == pytest.approx([np.mean(every[:3]), np.mean(every[3:])])
    assert robots["time_s"].tolist() == np.repeat([0.0, 2.0, 4.0, 6.0], 3).tolist()
    assert (robots["ram_mb"] == usual[1]["ram_mb"].reshape(-1, 3)[::2].ravel()).all()
    assert summary["robots"] == usual[2]["robots"]  # whose memory is as of each second


def test_a_rate_over_less_than_10_ms_is_null_and_its_bytes_are_in_the_next():
    samples, _, _ = tables("measure.every=4 ms", "stop.elapsed=102 ms")
    times_s = [0.012 * k for k in range(1, 9)]
    for name in RATES:
        if name in samples:
            known_s, _ = measured({key: np.array(values, float) for key, values in samples.items()
                                   if key in ("time_s", name)}, name)
            assert known_s[known_s > 0] == pytest.approx(times_s), name


def test_an_event_soon_after_the_start_makes_no_rate():
    """With ideal computers robots know a tenth of the terrain 36 us after the first scan is sent.
    The bytes until then are in the next rate."""
    series = []
    for on in "[]", "[explored_10pct]":
        samples, _, _ = tables("computers=ideal", "robot.power=null", "middleware=direct",
                               "measure.every=1 s", f"measure.on={on}")
        series.append({name: np.array(values, float) for name, values in samples.items()
                       if name in ("time_s", "rx_kBps", "bytes_per_s:/*/scan")})
    plain, with_events = series
    assert with_events["time_s"][1] < 1e-4
    for name in "rx_kBps", "bytes_per_s:/*/scan":
        totals = []
        for own in series:
            times_s, rates = measured(own, name)
            totals.append(float((rates * np.diff(times_s, prepend=0)).sum()))
            assert not ((times_s > 0) & (times_s < 0.01)).any()
            assert max(rates) < 2 * np.median(rates)
        assert totals[0] == pytest.approx(totals[1])


def test_readers_of_the_series_pass_over_what_was_not_due(tmp_path):
    run = desim.run(HELLO, overrides=[
        "stop.elapsed=7 s", "measure.periods={explored_union: 3 s, bytes_per_s: 4 s}"],
        out=tmp_path)
    assert run.samples["time_s"].tolist() == [0, 3, 4, 5, 6, 7]
    times_s, shares = measured(run.samples, "explored_union")
    assert times_s.tolist() == [0, 3, 6, 7] and (np.diff(shares) > 0).all()
    assert measured(run.samples, "bytes_per_s:/*/scan")[0].tolist() == [0, 4, 7]
    recording = Recording(run)
    scene, types = AnimationScene(recording), _Types()
    assert np.isfinite(scene._explored).all()
    assert [time_ns / 1e9 for time_ns, _ in _explored(recording, types)] == times_s.tolist()
    assert types.shares == shares.tolist()
    assert png(run, 40).startswith(b"\x89PNG")


class _Types:
    """Messages for ROS that are not made."""

    def __init__(self) -> None:
        self.shares = []

    def make(self, _: str, data: float) -> None:
        self.shares.append(data)

"""The levels of a parameter, and the settings of each."""

import pytest
from designs import labels, loaded, planned

from desim.campaign.design.parameters import parameters_of


def values(tmp_path, shape):
    """Of the parameter ``p``."""
    made = parameters_of(loaded(tmp_path, f"parameters: {{p: {shape}}}\n"))
    return [level.value for level in made["p"].levels]


@pytest.mark.parametrize("shape, expected", [
    ("{key: fleet.size, values: [1, 4, 8]}", [1, 4, 8]),
    ("{key: k, values: [1 Gb/s, 10 Mb/s]}", ["1 Gb/s", "10 Mb/s"]),
    ("{key: k, values: [0.5, no, true, null, [1 m, 2 m]]}", [
        0.5, "no", True, None, ["1 m", "2 m"]]),
    ("{key: k, from: 1, to: 5}", [1, 2, 3, 4, 5]),
    ("{key: k, from: 1, to: 30, step: 10}", [1, 11, 21]),
    ("{key: k, from: 1, to: 2, step: 0.25}", [1, 1.25, 1.5, 1.75, 2]),
    ("{key: k, from: 5 m, to: 20 m, step: 5 m}", ["5 m", "10 m", "15 m", "20 m"]),
    ("{key: k, from: 5 m, to: 6 m, step: 0.5 m}", ["5 m", "5.5 m", "6 m"]),
    ("{key: k, from: 0, to: 1, count: 5}", [0, 0.25, 0.5, 0.75, 1]),
    ("{key: k, from: 1 Mb/s, to: 100 Mb/s, count: 3, scale: log}", [
        "1 Mb/s", "10 Mb/s", "100 Mb/s"]),
    ("{key: k, from: 1, to: 2, count: 3, scale: log}", [1, 1.41421, 2]),
    ("{key: k, from: -90 dBm, to: -80 dBm, step: 5 dBm}", ["-90 dBm", "-85 dBm", "-80 dBm"]),
    ("{key: k, from: 3, to: 3}", [3]),
    ("{key: k, from: 0 m, to: 1 m}", []),  # for samples
    ("{levels: {near: {k: 5 m}, far: {k: 50 m}}}", ["near", "far"]),
])
def test_levels(tmp_path, shape, expected):
    assert values(tmp_path, shape) == expected


def test_tenths_are_exact(tmp_path):
    assert values(tmp_path, "{key: k, from: 0 m, to: 1 m, step: 0.1 m}") == [
        "0 m", "0.1 m", "0.2 m", "0.3 m", "0.4 m", "0.5 m", "0.6 m", "0.7 m", "0.8 m", "0.9 m",
        "1 m"]


def test_samples_stay_in_their_range_and_reach_both_ends(tmp_path):
    made = parameters_of(loaded(tmp_path, """parameters:
  whole: {key: a, from: 1, to: 4}
  length: {key: b, from: 10 m, to: 20 m}
  rate: {key: c, from: 1 Mb/s, to: 100 Mb/s, scale: log}
  words: {key: d, values: [x, y]}
"""))
    last = 1 - 2**-53

    def sampled(name):
        return [made[name].sampled(u).value for u in (0.0, 0.5, last)]

    assert sampled("whole") == [1, 3, 4]
    assert sampled("length") == ["10 m", "15 m", "20 m"]
    assert sampled("rate") == ["1 Mb/s", "10 Mb/s", "100 Mb/s"]
    assert sampled("words") == ["x", "y", "y"]


def test_what_a_parameter_sets_and_who_refers_to_it(tmp_path):
    plan = planned(tmp_path, """set: {robot.laser.max_range: $range, fleet: {size: 3}}
parameters:
  range: {values: [5 m, 10 m]}
  how:
    levels:
      narrow: {robot.laser.beams: 10}
      wide: {robot.laser.beams: 40, robot.laser.noise: 1 cm}
stop: {elapsed: 1 s}
measure: {every: 500 ms}
""")
    assert labels(plan) == [("5 m", "narrow"), ("5 m", "wide"), ("10 m", "narrow"),
                            ("10 m", "wide")]
    scenarios = [plan.scenario(vector, 0).scenario for vector in plan.vectors]
    assert [scenario.robot.laser.max_range_m for scenario in scenarios] == [5, 5, 10, 10]
    assert [scenario.robot.laser.beams for scenario in scenarios] == [10, 40, 10, 40]
    assert {scenario.fleet.size for scenario in scenarios} == {3}
    assert {scenario.stop.elapsed_ns for scenario in scenarios} == {10**9}
    assert {scenario.measure.every_ns for scenario in scenarios} == {5 * 10**8}


def test_a_later_parameter_is_laid_over_an_earlier_one(tmp_path):
    plan = planned(tmp_path, """parameters:
  how: {levels: {one: {fleet.size: 1}}}
  robots: {key: fleet.size, values: [2, 3]}
""")
    assert [plan.scenario(vector, 0).scenario.fleet.size for vector in plan.vectors] == [2, 3]

"""The combinations that a design runs."""

import sys
from types import SimpleNamespace

import pytest
from designs import labels, planned

from desim.errors import InputError

TWO = """parameters:
  robots: {key: fleet.size, values: [1, 2]}
  beams: {key: robot.laser.beams, values: [10, 20]}
"""
SPANS = """parameters:
  robots: {key: fleet.size, from: 1, to: 4}
  range: {key: robot.laser.max_range, from: 5 m, to: 25 m}
"""


def test_all_combinations_the_last_parameter_first(tmp_path):
    assert labels(planned(tmp_path, TWO)) == [("1", "10"), ("1", "20"), ("2", "10"), ("2", "20")]


def test_zip(tmp_path):
    assert labels(planned(tmp_path, TWO + "vectors: zip\n")) == [("1", "10"), ("2", "20")]


def test_a_list_may_name_other_values(tmp_path):
    assert labels(planned(tmp_path, TWO + "vectors: [{beams: 30, robots: 2}, "
                          "{robots: 1, beams: 10}]\n")) == [("2", "30"), ("1", "10")]


def test_no_parameters_is_one_vector(tmp_path):
    assert labels(planned(tmp_path, "")) == [()]


def test_a_function_beside_the_design(tmp_path):
    (tmp_path / "pairs_of_mine.py").write_text(
        "def pairs():\n    for n in (1, 2):\n        yield {'robots': n, 'beams': 10 * n}\n")
    plan = planned(tmp_path, TWO + "vectors: {function: 'pairs_of_mine:pairs'}\n")
    assert labels(plan) == [("1", "10"), ("2", "20")]


def test_a_function_may_count_with_numpy(tmp_path):
    (tmp_path / "counts_with_numpy.py").write_text(
        "import numpy as np\n\ndef pairs():\n"
        "    return [{'robots': n, 'beams': b} for n, b in zip(np.arange(1, 3), [10, 20])]\n")
    plan = planned(tmp_path, TWO + "vectors: {function: 'counts_with_numpy:pairs'}\n")
    assert labels(plan) == [("1", "10"), ("2", "20")]


@pytest.mark.parametrize("vectors", [
    "[{robots: 1, beams: 10}, {robots: 2, beams: 10}, {beams: 10, robots: 1}]",
    "{function: 'repeats_a_vector:vectors'}"])
def test_a_vector_that_stands_there_twice_is_refused(tmp_path, monkeypatch, vectors):
    monkeypatch.setitem(sys.modules, "repeats_a_vector", SimpleNamespace(vectors=lambda: [
        {"robots": n, "beams": 10} for n in (1, 2, 1)]))
    with pytest.raises(InputError, match=r"vectors: vector 2 repeats vector 0 "
                                         r"\(robots: 1, beams: 10\)"):
        planned(tmp_path, f"{TWO}vectors: {vectors}\n")


def strata(plan, name, low, high, count):
    """In which of ``count`` equal parts of the range each sample lies."""
    found = [float(vector.levels[name].label.removesuffix(" m")) for vector in plan.vectors]
    assert all(low <= value <= high for value in found)
    return sorted(min(int((value - low) / (high - low) * count), count - 1) for value in found)


def test_a_latin_hypercube_has_one_sample_in_each_part_of_each_range(tmp_path):
    plan = planned(tmp_path, SPANS + "vectors: {latin_hypercube: 8}\n")
    assert strata(plan, "range", 5, 25, 8) == list(range(8))
    assert sorted(label for label, _ in labels(plan)) == ["1", "1", "2", "2", "3", "3", "4", "4"]


def test_a_sobol_sequence_of_a_power_of_two_has_so_too(tmp_path):
    plan = planned(tmp_path, SPANS + "vectors: {sobol: 8}\n")
    assert strata(plan, "range", 5, 25, 8) == list(range(8))


def test_a_saltelli_design_changes_one_parameter_after_the_other(tmp_path):
    found = labels(planned(tmp_path, SPANS + "vectors: {saltelli: 4}\n"))
    assert len(found) == 4 * (2 + 2)
    for i in range(0, len(found), 4):
        a, first, second, b = found[i:i + 4]
        assert first == (b[0], a[1]) and second == (a[0], b[1])


@pytest.mark.parametrize("vectors", ["latin_hypercube: 8", "sobol: 8", "saltelli: 4"])
def test_samples_are_the_designs_seed_and_nothing_else(tmp_path, vectors):
    def drawn(more):
        return labels(planned(tmp_path, f"{SPANS}vectors: {{{vectors}}}\n{more}"))

    assert drawn("") == drawn("iterations: 9\nset: {robot.laser.beams: 30}\n")
    assert drawn("") != drawn("seed: 2\n")

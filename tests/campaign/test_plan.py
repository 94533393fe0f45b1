"""Seeds and names of runs."""

from designs import planned

COMMON = "parameters: {robots: {key: fleet.size, values: [%s]}}\niterations: 3\nseed: 10\n"
OWN = COMMON + "random_numbers: independent\n"


def seeds(plan):
    return {tuple(level.label for level in vector.levels.values()): [
        plan.seed(vector, k) for k in range(plan.least_iterations)] for vector in plan.vectors}


def test_common_random_numbers(tmp_path):
    assert seeds(planned(tmp_path, COMMON % "1, 2")) == {("1",): [10, 11, 12],
                                                         ("2",): [10, 11, 12]}


def test_independent_ones_are_all_different(tmp_path):
    found = sum(seeds(planned(tmp_path, OWN % "1, 2")).values(), [])
    assert len({*found}) == 6
    assert all(0 <= seed < 2**56 for seed in found)


def test_another_value_or_iteration_moves_nobodys_seed_and_no_run(tmp_path):
    for text in (COMMON, OWN):
        few = planned(tmp_path, text % "1, 3")
        many = planned(tmp_path, (text % "2, 3, 1").replace("iterations: 3", "iterations: 5"))
        before, after = seeds(few), seeds(many)
        assert all(after[key][:3] == own for key, own in before.items())
        ids = {few.run_id(vector, k) for vector in few.vectors for k in range(3)}
        assert ids < {many.run_id(vector, k) for vector in many.vectors for k in range(5)}


def test_a_run_is_the_one_that_desim_run_would_make(tmp_path):
    """The name of a run is that of its resolved scenario, however it came about."""
    from desim.results.identity import Identity
    from desim.scenario.load import load

    plan = planned(tmp_path, COMMON % "1, 2")
    scenario = load(tmp_path / "small.yaml", ["fleet.size=2", "trace.keep=none"], 11).scenario
    assert plan.run_id(plan.vectors[1], 1) == Identity(scenario).run_id(11)
    assert plan.scenario(plan.vectors[1], 1).scenario == scenario

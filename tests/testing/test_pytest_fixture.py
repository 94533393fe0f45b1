"""The pytest fixture ``desim_run``, as another project's tests use it."""

import subprocess
import sys

import pytest
from designs import BASE

pytest_plugins = ["pytester"]


def outcome(pytester, body, **wanted):
    (pytester.path / "small.yaml").write_text(BASE)
    pytester.makepyfile(body)
    result = pytester.runpytest_subprocess("-p", "no:cacheprovider")
    result.assert_outcomes(**wanted)
    return result.stdout.str()


def test_scenarios_lie_beside_the_test(pytester):
    outcome(pytester, """
        def test_it(desim_run):
            run = desim_run("small.yaml", "fleet.size=1", until="20 ms", seed=7)
            assert run.manifest["simulated_s"] == 0.02
            assert run.manifest["seed"] == 7 and run.scenario.fleet.size == 1

        def test_twice(desim_run):
            desim_run.same_digest(desim_run("small.yaml"), desim_run("small.yaml"))
    """, passed=2)


def test_other_digests_fail_and_the_first_row_that_differs_is_shown(pytester):
    shown = outcome(pytester, """
        def test_runs(desim_run):
            desim_run.same_digest(desim_run("small.yaml"), desim_run("small.yaml", seed=2))

        def test_text(desim_run):
            desim_run.same_digest(desim_run("small.yaml"), "0123")
    """, failed=2)
    assert "Failed: the runs differ: " in shown and "is the first that differs" in shown
    assert "small has the digest " in shown and ", wanted: 0123; made with {" in shown


def test_a_wrong_scenario_is_the_tests_error(pytester):
    assert "--set fleet.sze=1: fleet.sze: unknown key (did you mean 'size'?)" in outcome(
        pytester, """
        def test_it(desim_run):
            desim_run("small.yaml", "fleet.sze=1")
    """, failed=1)


@pytest.mark.parametrize("module", ["desim", "numpy"])
def test_pytest_starts_without_desim(module):
    code = f"import desim_pytest, sys; sys.exit({module!r} in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0

"""The choice of tests that are near to a change."""

from __future__ import annotations

import pytest
from quick import LIMIT_S, chosen, measured, ranked, seconds

NEAR = {"desim/middleware/tcp/sender.py": "tests/middleware/test_tcp.py",
        "netmodels/rules/loss.py": "tests/network_models/test_rules_chance.py",
        "desim/campaign/running/crew.py": "tests/campaign/test_crew.py",
        "desim/world/kernels/lidar.py": "tests/world/test_world_lidar.py",
        "tests/tcp_hosts.py": "tests/middleware/test_tcp_theory.py",
        "scenarios/maze_30.yaml": "tests/scenario/test_scenario.py"}


@pytest.mark.parametrize("changed", NEAR)
def test_a_change_is_seen_by_its_rooms_tests_in_a_minute(changed):
    files = chosen(ranked([changed]), seconds())
    assert NEAR[changed] in files
    assert sum(seconds().get(path, 0.0) for path in files) <= LIMIT_S


def test_nearer_and_then_faster_files_go_first():
    found = [(2.0, "far"), (1.0, "slow"), (1.0, "fast"), (1.0, "too long")]
    assert chosen(found, {"far": 1.0, "slow": 9.0, "fast": 2.0, "too long": LIMIT_S}) == [
        "fast", "slow", "far"]


def test_times_are_by_file_and_by_slow_test(tmp_path):
    report = tmp_path / "report.xml"
    report.write_text("""<testsuites><testsuite>
        <testcase classname="tests.test_quick" name="test_a[1]" time="0.5"/>
        <testcase classname="tests.test_quick.TestB" name="test_b" time="0.25"/>
        <testcase classname="tests.test_quick.TestB" name="test_c" time="7.5"/>
        </testsuite></testsuites>""")
    assert measured(report) == {"tests/test_quick.py": 0.75,
                                "tests/test_quick.py::TestB::test_c": 7.5}

"""Relative poses that robots have accepted, against where their teammates really began."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from desim.engine.trace import bits
from desim.monitor.meters.relative_poses import FALSE_M, FALSE_RAD, RelativePoses

S = 10**9
STARTS = {"a": (0.0, 0.0, 0.0), "b": (4.0, 3.0, math.pi)}


class Team:
    """Robots a and b, which accept and drop frames of each other when a test says so."""

    def __init__(self):
        self.kernel = SimpleNamespace(now_ns=0)
        names = tuple(STARTS)
        self.meter = RelativePoses(SimpleNamespace(
            kernel=self.kernel, trace=SimpleNamespace(names=names), explorers=names, robots=names,
            poses=lambda: np.array(list(STARTS.values()))))
        for robot in names:
            self.meter.watch(robot, SimpleNamespace(), 0)

    def accept(self, robot, of, *error, at_s=0):
        """``robot`` takes ``of`` to have begun so far from where it did: x m, y m, yaw rad."""
        self.kernel.now_ns = at_s * S
        self.meter.listeners["frame_of"](robot, list(STARTS).index(of))
        self.meter.listeners["frame_at"](
            robot, *(bits(start + off) for start, off in zip(STARTS[of], error, strict=True)))

    def drop(self, robot, of):
        self.meter.listeners["frame_lost"](robot, list(STARTS).index(of))

    def found(self, *keys):
        summary = self.meter.summary(0)
        return tuple(summary[key] for key in keys)


def test_errors_are_those_of_pairs_that_hold_a_correct_frame():
    team = Team()
    team.accept("a", "b", 0.3, 0.4, -0.01, at_s=10)
    team.accept("b", "a", 0.0, 0.1, 2 * math.pi + 0.02, at_s=20)
    assert team.found("merges", "false_merges", "merged_pairs", "merge_time_s") == (2, 0, 1.0, 15.0)
    assert team.found("merge_error_m", "merge_error_rad") == pytest.approx(
        (math.sqrt((0.25 + 0.01) / 2), math.sqrt((0.0001 + 0.0004) / 2)))


@pytest.mark.parametrize("error", [(1.01 * FALSE_M, 0.0, 0.0), (0.0, 0.0, 1.01 * FALSE_RAD)])
def test_a_frame_is_false_once_however_often_it_is_refined(error):
    team = Team()
    for at_s in (1, 2):
        team.accept("a", "b", *error, at_s=at_s)
    assert team.found("merges", "false_merges", "merged_pairs", "merge_time_s") == (1, 1, 0.0, None)
    team.accept("a", "b", 0.0, 0.0, 0.0, at_s=3)
    assert team.found("merges", "false_merges", "merged_pairs", "merge_time_s") == (1, 1, 0.5, 3.0)
    team.drop("a", "b")
    team.accept("a", "b", *error, at_s=4)
    assert team.found("merges", "false_merges", "merged_pairs", "merge_time_s") == (2, 2, 0.0, 3.0)


def test_a_robot_that_starts_again_holds_no_frame():
    team = Team()
    team.accept("a", "b", 0.0, 0.0, 0.0)
    team.meter.watch("a", SimpleNamespace(), 5 * S)
    assert team.found("merges", "merged_pairs", "merge_error_m") == (1, 0.0, None)
    assert Team().found("merges", "merged_pairs", "merge_error_rad") == (0, None, None)

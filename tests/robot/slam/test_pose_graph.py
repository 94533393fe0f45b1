"""The pose graph: what least squares must give, worked out by hand, and ties that are wrong."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim.robot.slam import pose_graph
from desim.robot.slam.pose_graph import PoseGraph
from desim.robot.transforms import compose, motion_between

SURE = np.diag((1e4, 1e4, 1e4))
STEP = np.array((1.0, 0.0, 0.0))


def chain(steps, information=SURE):
    """A graph of one path, the first node held at the origin."""
    graph = PoseGraph()
    graph.anchor(graph.add_node(np.zeros(3)))
    for number, step in enumerate(steps):
        graph.add_node(compose(graph.poses[number], step))
        graph.tie(number, number + 1, step, information)
    return graph


def test_a_chain_without_loops_stays_as_it_is():
    graph = chain([np.array((1.0, 0.2, 0.3))] * 5)
    before = graph.poses.copy()
    graph.optimize(3, newest=100)
    assert graph.poses == pytest.approx(before, abs=1e-9)


def test_a_gap_is_shared_by_variances():
    """On a line with steps of variances v_k, a closure that is sure moves node n by the gap's share
    of v_1 + ... + v_n (least squares with a constraint)."""
    variances = np.array((1.0, 4.0, 2.0, 1.0))
    graph = PoseGraph()
    graph.anchor(graph.add_node(np.zeros(3)))
    for k, variance in enumerate(variances):
        graph.add_node(compose(graph.poses[k], STEP))
        graph.tie(k, k + 1, STEP, np.diag((1.0 / variance, 1e4, 1e4)))
    graph.tie(0, 4, np.array((4.8, 0.0, 0.0)), np.diag((1e6, 1e6, 1e6)))
    graph.optimize(5, newest=100)
    shares = np.concatenate(((0.0,), np.cumsum(variances) / variances.sum()))
    assert graph.poses[:, 0] == pytest.approx(np.arange(5) + 0.8 * shares, abs=1e-4)
    assert graph.poses[:, 1:] == pytest.approx(0.0, abs=1e-6)


def test_derivatives_are_those_of_small_steps():
    rng = np.random.default_rng(3)
    graph = PoseGraph()
    for pose in rng.normal(size=(4, 3)):
        graph.add_node(pose)
    graph.tie(0, 1, rng.normal(size=3), np.diag((2.0, 3.0, 4.0)))
    graph.tie(2, 1, rng.normal(size=3), np.diag((5.0, 1.0, 0.0)), 0.3, (3, 0.4))
    errors, blocks, ends, _ = graph._whitened(np.s_[:])
    for node in range(4):
        for column in range(3):
            graph.poses[node, column] += 1e-6
            slope = (graph._whitened(np.s_[:])[0] - errors) / 1e-6
            graph.poses[node, column] -= 1e-6
            wanted = sum(np.where((end == node)[:, None], block[:, :, column], 0.0)
                         for block, end in zip(blocks, ends, strict=True))
            assert slope == pytest.approx(wanted, abs=1e-4)


def ring_with_a_false_tie():
    """A square of 20 steps that drifts and comes home, with a right closure and a false one."""
    true = [np.zeros(3)]
    for k in range(20):
        true.append(compose(true[-1], np.array((1.0, 0.0, math.pi / 2 if k % 5 == 4 else 0.0))))
    steps = [motion_between(one, two) + (0.02, 0.0, 0.005) for one, two in zip(
        true[:-1], true[1:], strict=True)]
    graph = chain(steps, np.diag((400.0, 1e4, 1e4)))
    graph.tie(0, 20, motion_between(true[0], true[20]), SURE, drift_m=0.5)
    graph.tie(3, 12, motion_between(true[3], true[12]) + (6.0, -3.0, 1.0), SURE, drift_m=0.5)
    graph.optimize(20, newest=100)
    return np.hypot(*(graph.poses[:, :2] - np.array(true)[:, :2]).T).max()


def test_a_false_closure_loses_its_weight():
    assert ring_with_a_false_tie() < 0.15


def test_but_not_without_scaling(monkeypatch):
    monkeypatch.setattr(pose_graph, "_PHI", 1e12)
    with pytest.raises(AssertionError):
        test_a_false_closure_loses_its_weight()


def test_nodes_before_the_newest_stay():
    graph = chain([STEP] * 10)
    graph.tie(0, 10, np.array((11.0, 0.0, 0.0)), SURE)
    graph.optimize(3, newest=4)
    assert graph.poses[:7, 0] == pytest.approx(np.arange(7))
    assert graph.poses[10, 0] > 10.3


def test_a_teammate_that_is_seen_ties_two_paths():
    """Two robots drive side by side; one drifts, the other is held. Seen at its end, the drifting
    one is moved there, and nothing is said of its heading."""
    graph = chain([STEP] * 5, np.diag((25.0, 1e6, 1e6)))
    other = graph.add_node(np.array((4.6, 2.0, 0.0)))
    graph.anchor(other)
    graph.tie(5, other, np.array((0.0, 2.0, 0.0)), np.diag((1e4, 1e4, 0.0)), 0.5)
    graph.optimize(5, newest=100)
    assert graph.poses[5] == pytest.approx((4.6, 0.0, 0.0), abs=0.02)


def test_a_place_on_the_way_binds_the_nodes_at_both_ends():
    """One quarter of the way was seen at 0.3 m; the end follows by the rule of proportion."""
    graph = chain([STEP], np.diag((1.0, 1e4, 1e4)))
    watcher = graph.add_node(np.array((0.0, -3.0, 0.0)))
    graph.anchor(watcher)
    graph.tie(watcher, 0, np.array((0.3, 3.0, 0.0)), np.diag((1e6, 1e6, 0.0)), 0.5, (1, 0.25))
    graph.optimize(5, newest=100)
    assert graph.poses[1] == pytest.approx((1.2, 0.0, 0.0), abs=1e-3)


def bias_of_a_convoy(between, sign, robots=4, readings=300, sigma_m=0.022):
    """Robots in a bare corridor see whom they follow; the error (m) of their mean place at its end.
    A node comes when the odometer has read 1 m, so sooner where it reads too much. Unless
    ``between``, a tie has the odometer's word for the way since the node before."""
    noise = sign * sigma_m * np.random.default_rng(5).normal(size=(robots, readings))
    read, true = np.cumsum(0.12 + noise, axis=1), 0.12 * np.arange(readings)
    graph, paths = PoseGraph(), []
    for robot in range(robots):
        at, nodes = [0], [graph.add_node(np.array((2.0 * robot, 0.0, 0.0)))]
        graph.anchor(nodes[0])
        for k in range(2 * robot + 2, readings):
            step = read[robot, k] - read[robot, at[-1]]
            if step >= 1.0 or len(at) == 1:
                nodes.append(graph.add_node(graph.poses[nodes[-1]] + (step, 0.0, 0.0)))
                variance = sigma_m ** 2 * (k - at[-1])
                graph.tie(*nodes[-2:], step * STEP, np.diag((1.0 / variance, 1e6, 1e6)))
                at.append(k)
        paths.append((at, nodes))
    for (at, nodes), (others, theirs), reads in zip(paths[:-1], paths[1:], read[1:], strict=True):
        for k, node in zip(at[1:], nodes[1:], strict=True):
            j = int(np.searchsorted(others, k, side="right")) - 1
            if j + 1 < len(others):
                share = (k - others[j]) / (others[j + 1] - others[j])
                back_m = 0.0 if between else share * (reads[others[j + 1]] - reads[others[j]])
                graph.tie(node, theirs[j], (2.0 - back_m) * STEP, np.diag((2500.0, 2500.0, 0.0)),
                          0.5, (theirs[j + 1], share if between else 0.0))
    graph.optimize(10, newest=10_000)
    return np.mean([graph.poses[nodes[-1], 0] - 2.0 * robot - true[at[-1]]
                    for robot, (at, nodes) in enumerate(paths)])


def test_a_convoy_drifts_to_neither_side():
    """With the noise and its negative the errors cancel, but for what is not linear."""
    assert abs(bias_of_a_convoy(True, 1) + bias_of_a_convoy(True, -1)) < 0.05


def test_but_it_does_where_a_step_counts_twice():
    errors = [bias_of_a_convoy(False, sign) for sign in (1, -1)]
    assert abs(sum(errors)) > 0.1


@given(st.floats(-50, 50), st.floats(-50, 50), st.floats(-3, 3))
def test_the_frame_does_not_matter(x, y, yaw):
    def solved(start):
        graph = PoseGraph()
        graph.anchor(graph.add_node(start))
        for k in range(6):
            step = np.array((1.0, 0.1 * k, 0.4))
            graph.add_node(compose(graph.poses[k], step))
            graph.tie(k, k + 1, step, np.diag((50.0, 80.0, 300.0)))
        graph.tie(0, 6, np.array((2.0, 3.0, 2.2)), SURE)
        graph.optimize(10, newest=100)
        return motion_between(graph.poses[:1], graph.poses)

    assert solved(np.array((x, y, yaw))) == pytest.approx(solved(np.zeros(3)), abs=2e-3)

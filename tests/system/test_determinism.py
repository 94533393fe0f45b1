"""The same scenario and seed give the same digest, whatever else changes."""

import json
import os
import subprocess
import sys
from contextlib import ExitStack
from functools import cache

import numpy as np
import pytest
from runs import ANNEX, HELLO, HERE, MAZE_8, ROUGH, built, call_often, outcome_of

from desim import api
from desim.scenario.load import load

CASES = {
    "hello": (HELLO, "stop.elapsed=20 s"),
    "everything at once": (ROUGH,),
    "maze": (MAZE_8, "stop.elapsed=10 s"),
    "broadcast": (ROUGH, "coordination.exchange.via=broadcast"),
    "testbed under load": (
        HELLO, "stop.elapsed=20 s",
        "network.media.lan={model: switch, rate: 5 Mb/s, buffer: 20 kB}",
        "robot.laser.noise=2 cm", "robot.odometry.model=random_walk"),
    "radio": (
        HELLO, "stop.elapsed=20 s", "deployment=field",
        "network.media={lan: null, air: {model: netmodels.radio.dcf.radio:DcfRadio}}"),
}


def digests(outcome):
    return outcome.digest, outcome.digest_by_entity, outcome.events


@cache
def digests_of(case):
    """The digests of a first run."""
    return digests(outcome_of(*CASES[case]))


@pytest.mark.parametrize("case", CASES)
def test_two_runs_in_one_process(case):
    assert digests(outcome_of(*CASES[case])) == digests_of(case)


@pytest.mark.parametrize("case", ["hello", "everything at once"])
def test_processes_in_parallel_with_other_hash_seeds(case):
    file, *overrides = CASES[case]
    with ExitStack() as stack:
        processes = [stack.enter_context(subprocess.Popen(
            [sys.executable, str(HERE / "digests.py"), str(file), *overrides],
            stdout=subprocess.PIPE, env={**os.environ, "PYTHONHASHSEED": hash_seed}))
            for hash_seed in ("0", "4242")]
        answers = [json.loads(process.communicate()[0]) for process in processes]
    assert answers == [list(digests_of(case))] * 2


def test_another_seed_gives_another_digest():
    assert outcome_of(ROUGH, seed=1).digest != outcome_of(ROUGH, seed=2).digest


@pytest.mark.parametrize("deployment", ["field", "testbed"])
def test_robots_and_hosts_declared_in_reverse(deployment):
    scenario = load(ROUGH, [f"deployment={deployment}"]).scenario
    hosts = "{z: {monitor: true}, base: {at: [-10 m, 8 m]}, k: {at: [0 m, 0 m]}}"
    poses = [pose_text(pose) for pose in scenario.fleet.start.poses]
    there = f"fleet.start.poses=[{', '.join(poses)}]"
    back = f"fleet.start.poses=[{', '.join(reversed(poses))}]"
    turned = "{k: {at: [0 m, 0 m]}, base: {at: [-10 m, 8 m]}, z: {monitor: true}}"
    first = outcome_of(ROUGH, f"deployment={deployment}", there, f"hosts={hosts}")
    second = outcome_of(ROUGH, f"deployment={deployment}", back, f"hosts={turned}")
    assert digests(first) == digests(second)


def pose_text(pose, **changes):
    values = {"name": pose.name, "x": f"{pose.x_m} m", "y": f"{pose.y_m} m",
              "heading": f"{pose.heading_rad} rad", **changes}
    return "{" + ", ".join(f"{key}: {value}" for key, value in values.items()) + "}"


@pytest.mark.parametrize("case", ["hello", "everything at once"])
def test_trace_rows_kept_or_not(case, tmp_path):
    file, *overrides = CASES[case]
    manifests = [api.run(file, overrides=[*overrides, f"trace.keep={keep}"],
                         out=tmp_path).manifest for keep in ("none", "messages", "all")]
    assert len({manifest["run_id"] for manifest in manifests}) == 3
    for manifest in manifests:
        assert (manifest["digest"], manifest["digest_by_entity"]) == digests_of(case)[:2]


@pytest.mark.parametrize("case", CASES)
def test_payloads_read_when_needed_at_birth_or_at_delivery(case):
    for payloads in ("birth", "delivery"):
        assert digests(outcome_of(*CASES[case], payloads=payloads)) == digests_of(case)


def test_looking_on_changes_nothing():
    unseen, seen = built(ROUGH), built(ROUGH)
    samples = []
    call_often(seen, lambda: samples.append((seen.monitor.quantities(), seen.world.snapshot())))
    alone, watched = unseen.run(), seen.run()
    assert len(samples) == watched.simulated_ns // 10**8 + 1 > 200
    assert (watched.digest, watched.digest_by_entity) == (alone.digest, alone.digest_by_entity)


@cache
def alone(*common):
    """The digests by entity of the fleet in the hall."""
    return outcome_of(ANNEX, *common).digest_by_entity


def with_one_more(name, x_m, *common):
    """The digests by entity of the fleet in the hall, alone and with a silent robot more."""
    poses = [pose_text(pose) for pose in load(ANNEX).scenario.fleet.start.poses]
    poses.append(f"{{name: {name}, x: {x_m} m, y: 0 m}}")
    return (alone(*common),
            outcome_of(ANNEX, *common, f"fleet.start.poses=[{', '.join(poses)}]",
                       f"robot.passive=[{name}]").digest_by_entity)


# Names before, between and after the others'.
@pytest.mark.parametrize("name", ["a", "r5", "z"])
@pytest.mark.parametrize("deployment", ["testbed", "field"])
@pytest.mark.parametrize("more", [
    (), ("coordination.exchange.via=broadcast",), ("robot.odometry.model=independent",)])
def test_an_unseen_silent_robot_changes_nobody(name, deployment, more):
    without, beside = with_one_more(name, 12, f"deployment={deployment}",
                                    "testbed.robots_per_node=2", *more)
    assert {entity: beside[entity] for entity in beside if entity != name} == without
    assert name in beside


def test_a_silent_robot_that_lasers_see_does_change_them():
    without, beside = with_one_more("z", -12)
    changed = [name for name in without if beside[name] != without[name]]
    assert "monitor" in changed and any(name.startswith("r") for name in changed), changed


NETWORKS = {
    "switch": "network.media.lan={model: switch}",
    "slow link": "network.media.lan={model: link, rate: 20 Mb/s, latency: 30 ms}",
    "lossy": "network.media.lan={model: ideal, rules: [{rule: loss, probability: 10 %}]}",
}


def test_the_network_moves_no_sensor_noise():
    """A robot that stands in the annex sees the same, tick for tick; those in the hall drive other
    ways, and yet each reading of theirs is as far from the truth as before."""
    poses = [pose_text(pose) for pose in load(ANNEX).scenario.fleet.start.poses]
    readings = {}
    for network, override in NETWORKS.items():
        simulation = built(ANNEX, override, "robot.passive=[z]", "robot.odometry.model=independent",
                           "fleet.start.poses=[" + ", ".join(poses)
                           + ", {name: z, x: 12 m, y: 0 m}]")
        scans, errors = [], []

        def check(simulation=simulation, scans=scans, errors=errors):
            world, tick = simulation.world, simulation.kernel.now_ns // 10**8
            snapshot = world.snapshot()
            scans.append(world.scan(snapshot, np.array([3]), tick)[0])
            errors.append([world.odometry(snapshot, robot, tick) - snapshot.poses[robot]
                           for robot in range(4)])

        call_often(simulation, check)
        outcome = simulation.run()
        readings[network] = (np.array(scans), np.array(errors), outcome.digest)
    (scans, errors, _), *others = readings.values()
    assert scans.std(axis=0).min() > 0.005  # there is noise
    for other_scans, other_errors, _ in others:
        assert np.array_equal(scans, other_scans)
        assert np.array_equal(errors[:, 3], other_errors[:, 3])
        turns = np.abs(errors - other_errors)
        assert np.minimum(turns, 2 * np.pi - turns).max() < 1e-9
    assert len({digest for *_, digest in readings.values()}) == 3

"""Of a robot's mind: what strategies show, and where SLAM takes robots to be."""

import numpy as np
import pytest
from test_bundle import columns_of

import desim
from desim.api import recording_of
from desim.report.replay.bundle import PLANS


@pytest.fixture(scope="module")
def minds(tmp_path_factory, repository):
    """A central base and three robots with SLAM; for 12 s."""
    return desim.run(repository / "scenarios/hello.yaml", overrides=[
        "coordination.strategy=centralized", "hosts.base={}",
        "hosts.base.strategy={strategy: centralized}", "robot.localization=scan_matching",
        "stop.elapsed=12 s"], out=tmp_path_factory.mktemp("minds"))


def test_the_assignment_of_the_base_is_shown_under_its_name(minds):
    shown = [plan for plan in recording_of(minds).plans if plan.kind == "assignment"]
    assert shown and {plan.robot for plan in shown} == {"base"}
    assert {text for plan in shown for text in plan.texts} <= {"robot_0", "robot_1", "robot_2"}
    assert all(len(plan.texts) == len(plan.xy_mm) for plan in shown)


def test_marks_come_to_the_page_with_their_words(minds):
    about, found = columns_of(minds)
    assert about["plan_kinds"] == [*PLANS, "assignment"]
    kind, count = found["plan.kind"][0], found["plan.count"][0]
    ends = np.cumsum(count)
    shown = [(ends[k] - count[k], ends[k]) for k in np.flatnonzero(kind == len(PLANS))]
    words = [[about["marks"][text] for text in found["plan.text"][0][begin:end]]
             for begin, end in shown]
    assert words == [list(plan.texts) for plan in recording_of(minds).plans
                     if plan.kind == "assignment"]
    hosts = found["plan.host"][0][kind == len(PLANS)]
    assert {about["hosts"][host] for host in hosts} == {"base"}


def test_the_poses_of_slam_are_shown_and_not_listed(minds):
    recording = recording_of(minds)
    poses = [plan for plan in recording.plans if plan.kind == "pose"]
    assert {plan.robot for plan in poses} == {"robot_0", "robot_1", "robot_2"}
    for plan in poses:
        true_m = recording.poses.at(plan.time_ns)[recording.robots.index(plan.robot), :2]
        assert np.abs(plan.xy_mm[0] / 1000 - true_m).max() < 0.2
    about, _ = columns_of(minds)
    assert not any("localized" in event[2] for event in about["events"])


def test_nothing_depends_on_who_watches(minds, repository, tmp_path):
    unwatched = desim.run(repository / "scenarios/hello.yaml", overrides=[
        "coordination.strategy=centralized", "hosts.base={}",
        "hosts.base.strategy={strategy: centralized}", "robot.localization=scan_matching",
        "stop.elapsed=12 s", "trace.keep=none"], out=tmp_path)
    assert unwatched.manifest["digest"] == minds.manifest["digest"]

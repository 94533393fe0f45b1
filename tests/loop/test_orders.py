"""Orders and answers between the command and the guest, and the environment of programs."""

from __future__ import annotations

import sys
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from desim.loop.addresses import Address
from desim.loop.environment import environment, hosts_file
from desim.loop.lateness import LATE_NS, lateness_of
from desim.loop.order import LoopAnswer, Order

TEXT = st.text(st.characters(blacklist_categories=["Cs"]), max_size=20)


@given(st.lists(TEXT, max_size=3), st.none() | st.integers(0, 2**63), TEXT,
       st.sampled_from(["virtual", "wall"]))
def test_an_order_is_read_as_it_was_written(tmp_path_factory, changes, seed, command, clock):
    folder = tmp_path_factory.mktemp("order")
    order = Order("/a b/s.yaml", changes, seed, "/c", command, clock)
    order.write(folder)
    assert Order.read(folder) == order


def test_the_paths_of_an_order_hold_in_any_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Order("../s.yaml", [], None, "results", "desim loop ../s.yaml").write(tmp_path)
    monkeypatch.chdir("/")
    read = Order.read(tmp_path)
    assert (read.scenario, read.out) == (str(tmp_path.parent / "s.yaml"), str(tmp_path / "results"))


@given(st.tuples(st.integers(0, 2), TEXT, TEXT, TEXT))
def test_an_answer_is_read_as_it_was_written(tmp_path_factory, fields):
    folder = tmp_path_factory.mktemp("answer")
    assert LoopAnswer.read(folder) is None
    LoopAnswer(*fields).write(folder)
    assert LoopAnswer.read(folder) == LoopAnswer(*fields)


def test_lateness_is_that_of_all_frames():
    assert lateness_of([]) is None
    assert lateness_of([1500]) == (1.5, 1.5, 1.5, 0.0)
    late = lateness_of([*range(0, 100_000, 1000), 2 * LATE_NS])
    assert late == (50.0, 99.0, 2000.0, round(1 / 101, 6))
    assert late.valid  # 1 of 101
    assert lateness_of([LATE_NS] * 100).late_share == 0.0  # as late as may be
    assert not lateness_of([0, LATE_NS + 1]).valid


HOST = [Address(0, 1), Address(2, 1)]


def test_programs_know_their_host_its_address_and_the_master():
    found = environment("base", HOST, Path("/tmp/home"), Address(0, 4), None, {})
    assert (found["DESIM_HOST"], found["DESIM_IP"]) == ("base", "10.77.0.2")
    assert found["DESIM_PYTHON"] == sys.executable
    assert found["ROS_MASTER_URI"] == "http://10.77.0.5:11311"
    assert found["ROS_IP"] == "10.77.0.2"
    assert 'NetworkInterface name="eth0"' in found["CYCLONEDDS_URI"]
    assert found["HOME"] == "/tmp/home" and found["ROS_LOG_DIR"] == "/tmp/home/ros"
    assert "ROS_MASTER_URI" not in environment("base", HOST, Path("/tmp/home"), None, None, {})


def test_of_the_user_s_environment_programs_get_what_finds_software_alone():
    user = {"PATH": "/opt/ros/bin", "PYTHONPATH": "/a", "LANG": "C", "SECRET": "x",
            "ROS_MASTER_URI": "http://robot:11311", "ROS_IP": "192.168.1.7", "HOME": "/home/u"}
    found = environment("base", HOST[1:], Path("/h"), None, None, user)
    assert {name: found.get(name) for name in user} == {
        "PATH": "/opt/ros/bin", "PYTHONPATH": "/a", "LANG": "C", "SECRET": None,
        "ROS_MASTER_URI": None, "ROS_IP": "10.79.0.2", "HOME": "/h"}
    assert 'name="eth2"' in found["CYCLONEDDS_URI"]


def test_hosts_are_known_by_their_names():
    assert hosts_file({"base": HOST, "robot_0": [Address(1, 300)]}).splitlines() == [
        "127.0.0.1 localhost", "10.77.0.2 base", "10.78.1.45 robot_0"]

"""The bundle of a run has what its recording has."""

import json
import re

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from unpacking import unpacked

import desim
from desim.api import recording_of
from desim.report.replay.bundle import bundle
from desim.report.replay.page import page_of


def columns_of(run):
    about, columns = bundle(recording_of(run))
    return about, unpacked(columns.index, columns.text())


def test_poses_and_maps(hello):
    recording = recording_of(hello)
    about, found = columns_of(hello)
    assert about["robots"] == ["robot_0", "robot_1", "robot_2"]
    assert (found["pose.ns"][0] == recording.poses.times_ns).all()
    assert (found["pose.x_mm"] == recording.poses.xy_mm[:, :, 0].T).all()
    assert (found["pose.y_mm"] == recording.poses.xy_mm[:, :, 1].T).all()
    for k, growth in enumerate(recording.growths):
        known = np.where(found[f"growth.{k}.known.is"], found[f"growth.{k}.known"], 65535)
        assert (known[0] == growth.known_since.ravel()).all()
        assert (found[f"growth.{k}.occupied"][0] == growth.occupied.ravel()).all()


def test_the_merged_map_names_who_was_first(hello):
    recording = recording_of(hello)
    _, found = columns_of(hello)
    known = np.stack([growth.known_since.ravel() for growth in recording.growths])
    first = known.min(axis=0)
    assert (np.where(found["merged.known.is"][0], found["merged.known"][0], 65535) == first).all()
    somebody = first != 65535
    # Its colour is that of the most frequent one in the square of 5 x 5 cells around it.
    grid = recording.growths[0].grid
    own = np.where(somebody, known.argmin(axis=0), -1).reshape(grid.height, grid.width)
    squares = sliding_window_view(np.pad(own, 2, constant_values=-1), (5, 5))
    counts = np.stack([(squares == robot).sum(axis=(2, 3)).ravel()[somebody] for robot in range(3)])
    robot, at = found["merged.robot"][0][somebody], np.arange(somebody.sum())
    own = own.ravel()[somebody]
    assert (counts[robot, at] == counts.max(axis=0)).all()
    assert (robot == own)[counts[own, at] == counts.max(axis=0)].all()
    assert (robot != own).any()


def test_every_message_counts(hello):
    about, found = columns_of(hello)
    traffic = hello.metrics["traffic"]
    assert found["topic.messages"].sum() == hello.metrics["messages_delivered"]
    assert len(found["message.number"][0]) == sum(
        traffic[kind]["delivered"] for kind in ("coordination", "monitoring"))
    assert found["load.bytes"].sum() == found["topic.bytes"].sum() == sum(
        kind["bytes"] for kind in traffic.values())
    assert about["notes"] == []


def test_the_parts_of_a_messages_time_sum_to_its_latency(tmp_path, repository):
    run = desim.run(desim.load(repository / "scenarios" / "hello.yaml", [
        "stop.elapsed=5 s", "trace.ledger=true"]), out=tmp_path)
    about, found = columns_of(run)
    count = found["part.count"][0]
    ends = np.cumsum(count)
    total_ns = np.add.reduceat(found["part.ns"][0], (ends - count)[count > 0])
    flight_us = found["message.flight_us"][0][count > 0]
    assert len(flight_us) > 10 and (total_ns // 1000 == flight_us).all()
    assert "airtime" in about["ledger"]["parts"]
    assert "lan at workstation" in about["ledger"]["places"]


def test_without_a_ledger_there_are_no_parts(hello):
    about, found = columns_of(hello)
    assert about["ledger"] is None and "part.count" not in found


def test_two_runs_name_the_keys_that_differ(hello, tmp_path, repository):
    other = desim.run(repository / "scenarios" / "hello.yaml", out=tmp_path, seed=2, overrides=(
        "stop.elapsed=3 s", "coordination.exchange.period=1 s", "trace.ledger=true"))
    found = list(map(json.loads, re.findall(
        r'class="run-about">(.*?)</script>', page_of([recording_of(hello), recording_of(other)]))))
    parted = desim.compare(hello, other).parted
    assert [about["parted"] for about in found] == 2 * [parted._asdict()]
    assert found[0]["parted"].keys() == {"time_s", "robot", "apart_m"}
    assert [about["apart"] for about in found] == [
        ["coordination.exchange.period 5 s", "stop.elapsed 2000 s"],
        ["coordination.exchange.period 1 s", "stop.elapsed 3 s"]]

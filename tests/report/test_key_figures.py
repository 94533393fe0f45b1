"""A run's headline, and the rows of its table about middleware and processors."""

from __future__ import annotations

import pytest

from desim.report.key_figures import (
    _awareness,
    _energy,
    _memory,
    _network,
    _processors,
    _saturated,
    headline,
    key_figures,
)


def delay(mean_s, done, name, pairs=128):
    return {"mean": mean_s, "max": mean_s, name: done, "pairs": pairs}


def test_what_was_noticed_and_what_never():
    assert _awareness({
        "discovery_bytes": 47_214_810, "discovery_frames": 103_628, "false_alarms": 2,
        "detection_delay_s": delay(7.31, 128, "noticed"),
        "resync_delay_s": delay(1.25, 100, "resynced")}) == [
            ("discovery", "47.2 MB", "in 103628 frames"),
            ("loss noticed", "7.3 s", "later on average, 128 of 128 pairs"),
            ("heard again", "1.2 s", "later on average, 100 of 128 pairs"),
            ("false alarms", "2", "robots taken for gone that were up and in reach")]
    assert _awareness({
        "discovery_bytes": 999_940, "discovery_frames": 3, "false_alarms": 0,
        "detection_delay_s": delay(None, 0, "noticed"),
        "resync_delay_s": delay(None, 0, "resynced")}) == [
            ("discovery", "999.9 kB", "in 3 frames"),
            ("loss noticed", "never", "0 of 128 pairs"),
            ("heard again", "never", "0 of 128 pairs")]


def test_nothing_is_said_of_what_did_not_happen():
    direct = {"discovery_bytes": 0, "discovery_frames": 0, "false_alarms": None,
              "detection_delay_s": delay(None, None, "noticed", None),
              "resync_delay_s": delay(None, 0, "resynced", 0)}
    assert _awareness(direct) == _awareness({}) == []


def test_an_imported_run_says_where_it_is_from_and_another_how_it_ended():
    assert headline({"imported_from": "drive.mcap"}, {"name": "yard", "status": "imported"}) == (
        "yard: imported from drive.mcap")
    assert headline({"stop_reason": "explored"}, {
        "name": "maze", "seed": 3, "status": "finished"}) == "maze, seed 3: finished, explored"


@pytest.mark.parametrize(("missed", "said"), [
    (0, "0 missed ticks"), (1, "1 missed tick"), (2, "2 missed ticks")])
def test_missed_ticks_are_counted_in_words(missed, said):
    loads = {"mean_cpu_percent": 12.5, "robots": {"robot_0": {"cpu_percent": 20.0}},
             "missed_ticks": missed}
    assert _processors(loads) == [
        ("processors", "12.5 % busy", "of the robots', on average; at most 20.0 %"),
        ("", said, "of timers whose nodes were busy")]


EXPLORED = {
    "robots": {"robot_0": {}}, "simulated_s": 400.0, "exploration_time_s": 310.26,
    "union_time_s": 300.0, "fleet_time_s": None, "censored": False, "judged_robot": "robot_0",
    "explored": 0.9912, "explored_area_m2": 99.6, "reachable_area_m2": 100.4,
    "exploration_cost_m": 55.5, "exploration_efficiency_m2_per_m": 1.794,
    "map_completeness": 0.98765, "map_quality": 0.9, "map_error_cells": 1, "safety": 1.0,
    "collisions": 2, "recoveries": 3,
    "messages_sent": 7, "messages_delivered": 5, "messages_in_flight": 1, "messages_dropped": {},
    "bytes_on_air": 2_500_000, "partitions": {"count": 0}}
FINISHED = {"name": "maze", "status": "finished", "real_time_factor": 123.45, "cpu_s": 3.24,
            "peak_memory_mb": 150.4}


def test_the_figures_of_an_exploration():
    assert key_figures(EXPLORED, FINISHED) == [
        ("exploration time", "310.3 s", "99 % known to robot_0"),
        ("  of the union", "300.0 s", "99 % known to some robot"),
        ("  of the fleet", "> 400.0 s", "99 % known to every robot"),
        ("explored area", "100 m2", "of 100 m2"), ("cost", "56 m", "driven by all robots"),
        ("efficiency", "1.79 m2/m", "area / cost"), ("map completeness", "0.9877", ""),
        ("map quality", "0.9000", "1 wrong cell"), ("safety", "1.00", "2 collisions"),
        ("recoveries", "3", ""), ("messages", "7 sent", "5 delivered"),
        ("", "1 in flight", "at the end"),
        ("on the air", "2.5 MB", "50.00 kb/s, all hosts together"),
        ("speed", "123.5 times real time (CPU)", "400.0 s in 3.2 s of CPU, 150 MB")]


def test_what_was_not_reached_has_the_best_share_and_no_memory_is_said_where_none_is_known():
    rows = key_figures({**EXPLORED, "exploration_time_s": None, "censored": True,
                        "exploration_efficiency_m2_per_m": None, "outdated_goal_m": 4.6,
                        "outdated_goal_s": 12.4}, {**FINISHED, "peak_memory_mb": None})
    assert rows[0] == ("exploration time", "> 400.0 s", "not reached; best 99.12%")
    assert rows[5:7] == [("  wasted", "5 m", "12 s, towards what a teammate had explored"),
                         ("efficiency", "-", "area / cost")]
    assert rows[-1][2] == "400.0 s in 3.2 s of CPU"


def test_the_figures_of_another_task_have_their_units_and_fleets_without_robots_none():
    patrol = {**{key: EXPLORED[key] for key in EXPLORED if "_time_s" not in key},
              "task": "patrolling", "task_metrics": [
                  "idleness_mean_s", "visits", "by_place", "way_m", "area_m2", "worst_idleness",
                  "last_s"],
              "idleness_mean_s": 12.3456, "visits": 3, "by_place": [1, 2], "way_m": None,
              "area_m2": 7, "worst_idleness": 0.5, "last_s": None}
    assert key_figures(patrol, FINISHED)[:7] == [
        ("task", "patrolling", ""), ("  idleness mean", "12.35 s", ""), ("  visits", "3", ""),
        ("  way", "-", ""), ("  area", "7 m2", ""), ("  worst idleness", "0.5", ""),
        ("  last", "-", "")]
    assert [name for name, *_ in key_figures({**patrol, "robots": {}}, FINISHED)] == [
        "messages", "", "on the air", "speed"]


def test_an_imported_run_has_what_its_recording_has():
    imported = {"name": "yard", "status": "imported"}
    known = {"imported_from": "a.mcap", "exploration_cost_m": 1234.5, "messages_delivered": None}
    assert key_figures(known, imported) == [("imported from", "a.mcap", ""),
                                            ("driven", "1,234 m", "")]
    assert key_figures({**known, "messages_delivered": 5678}, imported)[2:] == [
        ("messages", "5,678 delivered", "")]


def test_a_network_in_which_things_went_wrong():
    assert _network({
        "simulated_s": 0.0, "messages_sent": 7, "messages_delivered": 5, "messages_in_flight": 0,
        "messages_unmatched": 2, "messages_dropped": {"outbox_full": 4, "host_down": 1},
        "bytes_on_air": 0, "packets_lost": {"queue_full": 9},
        "utilisation": {"lan": None, "air": {"mean": 0.125, "max": 0.5},
                        "bus": {"mean": 0.25, "max": 0.25}},
        "background": [{"sent": 10, "between": ["a", "b"], "delivered": 8}],
        "control_bytes": 1_250_000, "partitions": {"count": 2, "total_s": 30.4, "longest_s": 20.6},
        "false_alarms": 1}) == [
        ("messages", "7 sent", "5 delivered"), ("", "0 in flight", "at the end"),
        ("", "2 unmatched", "not known who listens"), ("", "4 dropped", "outbox_full"),
        ("", "1 dropped", "host_down"), ("on the air", "0.0 kB", "0.00 kb/s, all hosts together"),
        ("", "9 packets", "lost: queue_full"),
        ("", "12.5% busy", "air, mean of its parts; at most 50.0%"), ("", "25.0% busy", "bus"),
        ("background", "10 packets", "a to b, 8 delivered"),
        ("", "1.2 MB", "of protocols of networks, beside"),
        ("partitions", "2", "30 s in all, the longest 21 s"),
        ("false alarms", "1", "robots taken for gone that were up and in reach")]


def test_busy_computers_and_their_memory():
    robots = {"robot_0": {"cpu_percent": 20.0, "peak_ram_mb": 800.4},
              "robot_1": {"cpu_percent": None, "peak_ram_mb": None},
              "robot_2": {"cpu_percent": 5.0, "peak_ram_mb": 700.0}}
    loads = {"mean_cpu_percent": 12.5, "robots": robots, "missed_ticks": 0,
             "hosts": {"base": {"cpu_percent": 3.0, "killed": {"slam": 2, "nav": 1}},
                       "desk": {"cpu_percent": 4.0, "killed": {}}},
             "cluster_nodes": {"n0": {"waited_s": 1.5}, "n1": {"waited_s": 2.0}},
             "mean_ram_mb": 600.4, "memory_kills": 3}
    assert _processors(loads) == [
        ("processors", "12.5 % busy", "of the robots', on average; at most 20.0 %"),
        ("", "3.0 % busy", "of base's"), ("", "4.0 % busy", "of desk's"),
        ("", "3.5 s", "that virtual ones waited for those of their nodes"),
        ("", "0 missed ticks", "of timers whose nodes were busy"),
        ("memory", "600 MB", "of the robots', on average; at most 800 MB"),
        ("", "3 killed", "processes, for want of memory"),
        ("", "3 killed", "processes of base, for want of memory")]
    assert _processors({}) == []
    assert len(_memory({**loads, "memory_kills": 0, "hosts": {}})) == 1


def test_what_gave_in_first_and_what_energy_went_into():
    assert _saturated({"saturated_first": "queue", "saturation": {"queue": {"from_s": 12.4}}}) == [
        ("saturates first", "queue", "from 12 s on")]
    assert _saturated({"saturated_first": "lan", "saturation": {"lan": {
        "from_s": 5.0, "part": "base sending"}}}) == [
        ("saturates first", "lan", "from 5 s on: base sending")]
    assert _saturated({"saturated_first": None}) == _energy({}) == []
    assert _energy({"energy_j": 1250.0, "drive_j": 1000.0, "sensors_j": 150.0, "compute_j": 60.0,
                    "radio_j": 40.0}) == [
        ("energy", "1.2 kJ", "drive 1.0, sensors 0.1, compute 0.1, radio 0.0")]

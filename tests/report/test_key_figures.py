"""A run's headline, and the rows of its table about middleware and processors."""

from __future__ import annotations

import pytest

from desim.report.key_figures import _awareness, _processors, headline


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

"""An access point that stops and comes back: stations lose it, roam, and join again."""

import pytest

from desim import api
from desim.errors import InputError
from desim.middleware.arp import Neighbours
from desim.scenario.load import from_mapping

S, BEACON_S = 10**9, 0.1024
LOST_S = 7 * BEACON_S + 0.5  # seven missed beacons, and half a second of doubt (mac80211)


def scenario(*faults, points=("0 m",), robots=1, **infrastructure):
    """Robots at 3 m, 4 m, ... that stand, and tell a base on the wires where they are."""
    return {
        "name": "fails", "deployment": "field", "stop": {"elapsed": "12 s"},
        "environment": {"terrain": {"size": ["60 m", "20 m"]}},
        "fleet": {"size": robots, "start": {"from": ["3 m", "0 m"], "step": ["1 m", "0 m"]}},
        "hosts": {"base": {"at": ["0 m", "-2 m"]}}, "task": {"model": "none"},
        "faults": [{"host": "ap_0", **fault} for fault in faults],
        "network": {"media": {"air": {
            "model": "radio",
            "access_points": [{"at": [x, "0 m"], "channel": channel}
                              for x, channel in zip(points, (1, 6, 11), strict=False)],
            "infrastructure": {"wired": ["base"], **infrastructure}}}}}


def steps(tmp_path, data):
    """Its events about access points: time in s, kind, who, access point; and the run."""
    run = api.run(from_mapping(data).scenario, out=tmp_path)
    rows = run.table("events")
    return [(t_ns / S, kind, entity, words.split()[0]) for t_ns, kind, entity, words in zip(
        *(rows[name].tolist() for name in ("t_ns", "kind", "entity", "words")), strict=True)
        if "associated" in kind or kind.startswith("access_point")], run


def test_a_station_loses_it_by_missed_beacons_and_joins_again(tmp_path):
    """It stops at 3 s for 4 s. Its station gives it up after seven beacons and half a second, scans
    and finds none, and joins within the five seconds until it scans again."""
    found, run = steps(tmp_path, scenario({"at": "3 s", "down_for": "4 s"}))
    assert [row[1:] for row in found] == [
        ("associated", "robot_0", "ap_0"), ("access_point_stopped", "ap_0", "0"),
        ("disassociated", "robot_0", "ap_0"), ("access_point_started", "ap_0", "0"),
        ("associated", "robot_0", "ap_0")]
    at_s = [row[0] for row in found]
    assert at_s[1] == 3 and at_s[3] == 7
    assert 3 + LOST_S - BEACON_S <= at_s[2] <= 3 + LOST_S + BEACON_S
    assert 7 < at_s[4] < 7 + 5


@pytest.mark.parametrize("down_for", ["4 s", "300 ms"])
def test_the_gap_begins_with_the_stop(tmp_path, down_for):
    """The twin counts from the disassociation, after the station's doubt."""
    found, run = steps(tmp_path, scenario({"at": "3 s", "down_for": down_for}))
    left_s = next(row[0] for row in found if row[1] == "disassociated")
    gap_s = found[-1][0] - 3
    assert run.metrics["handover_gap_s"]["max"] == pytest.approx(gap_s, abs=1e-6)
    assert gap_s > found[-1][0] - left_s + 0.05


def test_a_short_break_is_seen_by_what_it_says_then(tmp_path):
    """Down for three beacons: nobody doubts; but it knows nobody any more, and says so."""
    found, _ = steps(tmp_path, scenario({"at": "3 s", "down_for": "300 ms"}))
    assert [row[1] for row in found] == [
        "associated", "access_point_stopped", "access_point_started", "disassociated",
        "associated"]
    assert 3.3 < found[3][0] <= 3.3 + BEACON_S


def test_who_left_asks_for_addresses_again(tmp_path, monkeypatch):
    """As Linux does where the carrier is gone; the twin's are still good."""
    def asked(name):
        data = scenario({"at": "3 s", "down_for": "300 ms"})
        data["middleware"] = {"model": "ros1", "master": "base"}
        data["robot"] = {"publishes": [{"topic": "load", "size": "100 B", "rate": "10 Hz",
                                        "to": "base"}]}
        run = api.run(from_mapping(data).scenario, out=tmp_path / name)
        return run.metrics["discovery_by_kind"]["arp"]["frames"]

    often = asked("as it is")
    monkeypatch.setattr(Neighbours, "lose_carrier", lambda *_: None)
    assert often > asked("twin")


def test_with_another_one_near_they_roam_to_it(tmp_path):
    found, _ = steps(tmp_path, scenario({"at": "3 s"}, points=("0 m", "20 m"), robots=2))
    last = {entity: point for _, kind, entity, point in found if kind == "associated"}
    assert last == {"robot_0": "ap_1", "robot_1": "ap_1"}
    assert [row[2] for row in found if row[1] == "access_point_started"] == []


def test_the_twin_without_the_fault_has_no_handover(tmp_path):
    found, _ = steps(tmp_path, scenario(points=("0 m", "20 m"), robots=2))
    assert [row[1] for row in found] == ["associated"] * 2


@pytest.mark.parametrize(("fault", "says"), [
    ({"at": "3 s", "kind": "software"},
     "scenario: faults.0.kind: an access point has no software and no drive; allowed: stop"),
    ({"at": "3 s", "host": "ap_1"},
     "scenario: faults.0.host: unknown host 'ap_1' (did you mean 'ap_0'?); allowed: base, "
     "robot_0, ap_0")])
def test_what_is_refused(fault, says):
    with pytest.raises(InputError) as caught:
        from_mapping(scenario(fault))
    assert str(caught.value) == says

"""``desim net fleet``: what is said of a fleet's messages, and wrong questions."""

import json

import pytest
from typer.testing import CliRunner

from desim.cli import app
from desim.commands.views.fleet_load import verdict
from desim.middleware.headers import stream_frame


def test_what_arrives_too_late_is_not_carried():
    """A second on the way, where a new scan comes after 40 ms; nothing is lost."""
    topic = {"delivery_ratio": 1.0, "lost": {}, "delay_p95_ms": 1000.0, "rate_hz": 25.0}
    assert verdict({"topics": {"/*/scan": topic}}, 0.99) == (
        False, "does not carry: /*/scan is late, 95 % within 1 s where the next one comes after "
               "40 ms")


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "two.yaml").write_text(
        "name: two\ndeployment: field\nenvironment: {terrain: {size: [20 m, 10 m]}}\n"
        "fleet: {size: 2, start: {from: [0 m, 0 m], step: [1 m, 0 m]}}\n"
        "network: {media: {air: {model: link, rate: 8 Mb/s}}}\n")


def desim(*words, code=0):
    done = CliRunner().invoke(app, ["net", *words])
    assert "Traceback" not in done.stderr
    assert done.exit_code == code, done.stderr
    return done.stdout if code == 0 else done.stderr


def test_the_command():
    """931 B with headers at 8 Mb/s."""
    assert desim("fleet", "two.yaml", "--map", "857", "--set", "seed=7") == (
        "two, seed 7: 2 hosts, 20 s\n"
        "  robots stand where they start\n"
        "  a map update is 857 B: as given\n"
        "  all drive, and have a new map to tell each time; there are no faults\n"
        "  arrived: until 5 s after these 20 s; delays are of those that arrived\n\n"
        "topic            from  to   Hz    B   Mb/s  arrived      mean      95 %      99 %  lost\n"
        "/map_exchange/*     2   2  0.2  857  0.003   1.0000  0.931 ms  0.931 ms  0.931 ms\n\n"
        "medium   Mb/s  carried    busy  at most  packets  lost\n"
        "air     0.003    0.003  0.0002   0.0002        8\n\n"
        "carries: 1 of all messages arrive, 95 % of each topic's within 0.931 ms "
        "(/map_exchange/*)\n")


def test_delays_beyond_the_measured_time_are_explained():
    """Two updates each of 10 MB at 8 Mb/s, 10 s of air: the first of one robot arrives after 10 s,
    the rest when nobody counts any more."""
    said = desim("fleet", "two.yaml", "--map", "10 MB", "--duration", "10")
    assert ("  arrived: until 5 s after these 10 s; delays are of those that arrived; with such "
            "losses another --seed may differ widely\n") in said


def test_the_command_in_json():
    found = json.loads(desim("fleet", "two.yaml", "--set", "seed=7", "--seed", "3", "--json",
                             "--set", "network.media.air.rate=9 Mb/s", "--duration", "10"))
    assert (found["scenario"], found["seed"], found["carries"]) == ("two", 3, True)
    assert found["settings"]["set"] == ["seed=7", "network.media.air.rate=9 Mb/s"]
    assert found["media"]["air"]["utilisation"]["max"] == pytest.approx(
        2 * stream_frame(found["map_bytes"])[0] * 8 / 9e6 / 10, rel=1e-3)


def test_help_lists_it():
    assert "\n  fleet       Whether a scenario's network carries what its robots say\n" in desim()
    said = desim("fleet", "--help")
    assert said.startswith("Usage: desim net fleet SCENARIO [--key value ...] [--seed N] [--json]")
    assert "  --set A.B.C=VALUE  another value of the scenario; can be given again\n" in said


@pytest.mark.parametrize(("words", "says"), [
    (["none.yaml"], "none.yaml: no such file"),
    ([], "SCENARIO is missing: a scenario's YAML file"),
    (["two.yaml", "--set", "network.fidelty=mac"], "--set network.fidelty=mac: network.fidelty: "
     "unknown key (did you mean 'fidelity'?); allowed: fidelity, media"),
    (["two.yaml", "--mpa", "3"], "--mpa: there is no such option (did you mean 'map'?); allowed: "
     "--scenario, --set, --map, --spread, --duration, --enough, --seed, --json"),
    (["two.yaml", "--enough", "200"], "--enough: '200 %' is too large; at most 100 %"),
    (["two.yaml", "--set", "fleet.start.from=[90 m, 0 m]"],
     "two.yaml:4:25: fleet.start: the start of robot_0 at (90, 0) m lies outside the terrain"),
])
def test_wrong_questions(words, says):
    complaint = desim("fleet", *words, code=2)
    assert complaint.startswith(says) and complaint.count("\n") == 1

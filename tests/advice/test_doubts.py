"""Warnings before a run, and the merging and removing of mappings by --set."""

import json

import pytest
from typer.testing import CliRunner

from desim.advice.doubts import media_beside, too_late
from desim.cli import app
from desim.errors import InputError
from desim.scenario.load import load

BEGIN = """name: doubts
fleet: {size: 1}
hosts: {base: {at: [0 m, 0 m]}}
network:
  others: {pc: {}}
  background:
    - {medium: lan, between: [pc, base], rate: 1 kb/s, from: 3 s}
  media:
    lan:
      model: ideal
      rules:
        - {rule: loss, probability: 1 %, from: 2 s}
        - {rule: outage, hosts: [base], from: 1999 ms, until: 5 s}
    wifi: {model: disk, range: 9 m, rules: [{rule: loss, probability: 1 %, topics: [nosuch]}]}
faults: [{at: 90 s, host: robot_0}]
stop: {elapsed: 2 s}
"""
LATE = "is no earlier than the end of the run, 2 s (stop.elapsed): it never happens"


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "doubts.yaml"
    path.write_text(BEGIN)
    return path


def models(file, *changes):
    return {name: medium.model
            for name, medium in load(file, changes).scenario.network.media.items()}


def test_what_would_begin_after_the_end_is_named_by_its_key(file):
    assert too_late(load(file).scenario) == [
        f"network.media.lan.rules.0.from: 2 s {LATE}", f"network.background.0.from: 3 s {LATE}",
        f"faults.0.at: 90 s {LATE}"]
    assert too_late(load(file, ["stop.elapsed=91 s"]).scenario) == []


def test_a_mapping_of_set_merges_and_null_removes(file):
    assert models(file, "network.media={lan: {model: disk}}") == {"lan": "disk", "wifi": "disk"}
    new = "network.media={new: {model: ideal}}"
    assert models(file, new) == {"lan": "ideal", "wifi": "disk", "new": "ideal"}
    assert models(file, new, "network.media.wifi=null") == {"lan": "ideal", "new": "ideal"}
    assert models(file, "network.media=null", "network.background=[]", new) == {"new": "ideal"}


def test_media_that_stay_beside_new_ones_are_named(file):
    def beside(*changes):
        loaded = load(file, changes)
        return media_beside(loaded.scenario, loaded.places)

    assert beside() == beside("network.media.lan.model=disk") == []
    assert beside("network.media.lan=null", "network.media={wifi: {range: 8 m}}",
                  "network.background=[]") == []
    new = "network.media={new: {model: ideal}}"
    assert beside(new) == [
        f"network.media still has lan (ideal, {file}:9:5), wifi (disk, {file}:14:5), beside what "
        "--set adds; --set network.media.lan=null takes it away"]
    assert beside("network.media=null", "network.background=[]", new) == []


def test_a_run_says_so_before_it_begins_and_its_summary_at_the_end(file, tmp_path):
    out = tmp_path / "out"
    done = CliRunner().invoke(app, ["run", str(file), "--out", str(out), "--set",
                                    "network.media.new={model: ideal}"])
    assert done.exit_code == 0, done.output
    said = [line for line in done.stderr.splitlines() if line.startswith(("note:", "warning:"))]
    topics = "network.media.wifi.rules.0.topics: no topic of the run has matched 'nosuch'"
    assert said[0].startswith("note: network.media still has lan (ideal, ")
    assert said[1:4] == [
        f"warning: {file}:12:48: network.media.lan.rules.0.from: 2 s {LATE}",
        f"warning: {file}:7:62: network.background.0.from: 3 s {LATE}",
        f"warning: {file}:15:15: faults.0.at: 90 s {LATE}"]
    assert sum(LATE in line for line in said) == 3
    assert any(line.startswith(f"warning: {topics}") for line in said)
    (summary,) = out.glob("*/*/summary.json")
    warnings = json.loads(summary.read_text())["warnings"]
    assert f"faults.0.at: 90 s {LATE}" in warnings
    assert any(text.startswith(topics) for text in warnings)


def test_a_host_that_does_not_exist_is_an_error_with_those_that_do(file):
    done = CliRunner().invoke(app, ["run", str(file), "--set",
                                    "network.media.lan.rules.0.links=[[bse, robot_0]]"])
    assert done.exit_code == 2
    assert done.stderr.splitlines()[-1].endswith(
        "network.media.lan.rules.0.links.0.0: 'bse' names no host (did you mean 'base'?); hosts "
        "are base, robot_0, workstation, pc")


def test_a_name_of_set_that_a_later_one_takes_away_is_an_error(file):
    with pytest.raises(InputError, match="what is set after it chooses another plug-in"):
        load(file, ["network.media.wifi.range=8 m", "network.media.wifi.model=ideal"])

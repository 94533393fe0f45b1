"""``desim sweep SCENARIO --vary``: a design from the command line."""

import pytest
import yaml
from designs import BASE
from typer.testing import CliRunner

from desim.campaign.design.design import load_design
from desim.campaign.design.plan import Plan
from desim.campaign.design.varied import name_of, varied_design
from desim.campaign.folder.campaign import Campaign
from desim.cli import app
from desim.scenario.load import load


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.yaml").write_text(BASE)
    return tmp_path


def swept(*words):
    result = CliRunner().invoke(app, ["sweep", "small.yaml", "--jobs", "1", *words])
    return result.exit_code, result.output


def refused(*words):
    code, output = swept(*words)
    assert code == 2
    return output


def levels(plan):
    return [{name: level.value for name, level in vector.levels.items()}
            for vector in plan.vectors]


TWO = ("--vary", "network.media.lan.rate=1Gb/s,100Mb/s", "--vary", "fleet.size=1,2",
       "--seeds", "1", "--until", "50 ms")


def test_it_runs_all_combinations_and_leaves_its_design():
    assert swept(*TWO) == (0, """\
4 runs, 0 done already; 1 at a time, in results/small_rate_size
4 of 4 runs; table: results/small_rate_size/runs.parquet
no run has a value of exploration_time_s
its design, to keep or edit: results/small_rate_size/design.yaml
its report: desim report results/small_rate_size
""")
    campaign = Campaign("results/small_rate_size")
    assert [*zip(campaign.runs["rate"], campaign.runs["size"], strict=True)] == [
        ("1Gb/s", 1), ("1Gb/s", 2), ("100Mb/s", 1), ("100Mb/s", 2)]
    assert campaign.design.question == (
        "How does small change with network.media.lan.rate (1Gb/s, 100Mb/s) and fleet.size (1, 2)?")
    assert {run.scenario.stop.elapsed_ns for run in campaign} == {50_000_000}


def test_the_design_that_it_leaves_is_the_same_campaign():
    swept(*TWO)
    result = CliRunner().invoke(app, ["sweep", "results/small_rate_size/design.yaml"])
    assert (result.exit_code, result.output.splitlines()[0]) == (
        0, "4 runs, 4 done already; 1 at a time, in results/small_rate_size")


def test_other_values_of_the_same_keys_go_on_in_the_same_campaign():
    swept(*TWO)
    code, output = swept("--vary", "network.media.lan.rate=1Gb/s,10Mb/s", *TWO[2:])
    assert (code, output.splitlines()[:2]) == (0, [
        "results/small_rate_size: 2 runs of an earlier design, another scenario or another version "
        "of desim; they stay, but are not in the table",
        "4 runs, 2 done already; 1 at a time, in results/small_rate_size"])


def test_an_edited_design_with_a_name_of_its_own_is_not_replaced(here):
    swept(*TWO)
    file = here / "results" / "small_rate_size" / "design.yaml"
    file.write_text(yaml.safe_dump({**yaml.safe_load(file.read_text()), "name": "mine"}))
    assert refused(*TWO) == (
        "results/small_rate_size: holds the campaign 'mine', the design's name is "
        "'small_rate_size'; choose another folder with --out\n")


def test_a_dry_run_writes_nothing(here):
    code, output = swept("--dry-run", *TWO)
    assert code == 0 and "rate=100Mb/s, size=2, iteration 0" in output
    assert not (here / "results").exists()


def test_commas_inside_of_mappings_and_lists_part_no_values():
    plan = Plan(varied_design("small.yaml", [
        "network.media.lan={model: switch, rate: 1 Mb/s},{model: ideal}",
        "fleet.start={from: [-4 m, 4 m], step: [2 m, 0 m]}, {from: [-4 m, 4 m], step: [1 m, 0 m]}"],
        seeds=1))
    assert levels(plan)[:2] == [
        {"lan": {"model": "switch", "rate": "1 Mb/s"},
         "start": {"from": ["-4 m", "4 m"], "step": [step, "0 m"]}} for step in ("2 m", "1 m")]
    assert len(plan.vectors) == 4


def test_settings_hold_in_every_run():
    plan = Plan(varied_design("small.yaml", ["fleet.size=1,2"], 3, ["robot.laser.beams=30"]))
    assert {plan.scenario(vector, 0).scenario.robot.laser.beams for vector in plan.vectors} == {30}
    assert plan.most_iterations == 3


@pytest.mark.parametrize("words, complaint", [
    (("--vary", "fleet.sze=1,2"), "--vary fleet.sze=1,2: fleet.sze: unknown key (did you mean "
                                   "'size'?); allowed: size, robots, types, start"),
    (("--vary", "fleet.size=1,2", "--set", "fleet.sze=1"),
     "--set fleet.sze=1: fleet.sze: unknown key (did you mean 'size'?); allowed: size, robots, "
     "types, start"),
    (("--vary", "fleet.size=1,two"),
     "--vary fleet.size=1,two: fleet.size: must be a whole number, got 'two'"),
    (("--vary", "fleet.size=1"),
     "--vary fleet.size=1: must look like a.b.c=value,value, e.g. fleet.size=4,8"),
    (("--vary", "fleet.size"),
     "--vary fleet.size: must look like a.b.c=value,value, e.g. fleet.size=4,8"),
    (("--vary", "fleet..size=1,2"),
     "--vary fleet..size=1,2: must look like a.b.c=value,value, e.g. fleet.size=4,8"),
    (("--vary", "fleet.size=1,,2"),
     "--vary fleet.size=1,,2: not YAML: expected the node content, but found ','"),
    (("--vary", "fleet.size=1,1"),
     "--vary fleet.size=1,1: parameters.size: the value 1 stands there twice"),
    (("--vary", "fleet.size=1,2", "--vary", "fleet.size=3,4"),
     "--vary fleet.size=3,4: fleet.size is varied already"),
    ((), "small.yaml: this is a scenario, of one run: desim run small.yaml; a design has a base "
         "and parameters; desim sweep small.yaml --vary fleet.size=4,8 needs none"),
    (("--until", "1 s"), "--until: it belongs to --vary; a design has the key stop"),
    (("--seeds", "3"), "--seeds: it belongs to --vary; a design has the key iterations"),
])
def test_what_is_wrong_is_said_of_the_option(words, complaint):
    assert refused(*words) == f"{complaint}\n"


def test_a_design_is_no_scenario(here):
    (here / "d.yaml").write_text("name: d\nbase: small.yaml\n")
    result = CliRunner().invoke(app, ["sweep", "d.yaml", "--vary", "fleet.size=1,2"])
    assert (result.exit_code, result.output) == (
        2, "d.yaml:2:7: base: this is a design, of many runs: desim sweep d.yaml\n")


def test_a_campaign_has_as_long_a_name_as_is_allowed(here):
    """100 letters: of the scenario, then of its parameters as far as there is space."""
    (here / f"{'a' * 90}.yaml").write_text(BASE)
    design = varied_design(f"{'a' * 90}.yaml", ["robot.laser.longest_range=5 m,6 m"]).design
    assert design.name == "a" * 90 + "_longest_r"


@pytest.mark.parametrize("keys, names", [
    (["network.media.lan.rate", "fleet.size"], ["rate", "size"]),
    (["network.media.lan.rate", "network.media.air.rate"], ["lan_rate", "air_rate"]),
    (["faults.0.at", "faults.1.at"], ["faults_0_at", "faults_1_at"]),
    (["x.seed", "rate", "lan.rate"], ["x_seed", "setting_1", "lan_rate"]),
])
def test_a_parameter_is_called_by_the_end_of_its_key(keys, names):
    assert [name_of(key, keys) for key in keys] == names


def test_files_among_the_values_lie_where_the_command_is_given(here):
    """The stored design finds them from its own folder."""
    (here / "maps").mkdir()
    (here / "maps" / "rooms.yaml").write_text("image: rooms.pgm\nresolution: 0.5\norigin: [0,0,0]\n"
                                              "negate: 0\noccupied_thresh: 0.65\n"
                                              "free_thresh: 0.196\n")
    (here / "maps" / "rooms.pgm").write_bytes(b"P5 24 24 255\n" + bytes([254] * 576))
    code, output = swept("--vary", "environment.terrain=loop,maps/rooms.yaml", "--seeds", "1",
                         "--set", "fleet.start={from: [4 m, 4 m], step: [1 m, 0 m]}")
    kept = load_design("results/small_terrain/design.yaml")
    assert kept.design.parameters["terrain"].values == ("loop", "../../maps/rooms.yaml"), output


@pytest.mark.parametrize("deployment, key, medium", [
    ("testbed", "network.media.lan.rate=3 Mb/s", {"model": "switch", "rate": "3 Mb/s"}),
    ("field", "network.media.air.card=11g_2008", {
        "model": "radio", "card": "11g_2008", "preset": "indoor"}),
    ("field", "network.media.air.metric=7", {
        "model": "radio", "card": "pi_4", "preset": "indoor", "metric": 7})])
def test_a_key_of_a_medium_that_the_deployment_gives(deployment, key, medium):
    """It may be set without naming the model once more."""
    name = key.split(".")[2]
    short = load("small.yaml", [f"deployment={deployment}", key])
    whole = load("small.yaml", [f"deployment={deployment}",
                                f"network.media.{name}={medium}"])
    assert short.scenario.network == whole.scenario.network


def test_a_medium_of_another_name_needs_a_model(here):
    assert "network.media.wire: the key 'model' is missing" in refused(
        "--vary", "network.media.wire.rate=1 Mb/s,2 Mb/s")

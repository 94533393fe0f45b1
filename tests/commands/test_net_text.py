"""``desim net``: the usage of a case, the line about it and its measures, to the letter."""

from io import StringIO
from pathlib import Path

import pytest
from pydantic import Field
from rich.console import Console
from typer.testing import CliRunner

from desim.cli import app
from desim.commands.views import cases
from desim.ports import Params
from desim.units import Length

MEASURES = {
    "offered_mbps": None, "goodput_mbps": 4.9, "goodput_share": None, "throughput_mbps": 5.25,
    "delay_mean_ms": None, "delivered": 7, "delivery_ratio": None, "lost": {}, "attempts": None,
    "control_frames": None, "utilisation": None, "drop_rate": None, "fairness": None,
    "measured_s": 3.0}


def rows(**more):
    out = Console(file=StringIO(), width=120)
    out.print(cases.measures_table({**MEASURES, **more}))
    return [line.rstrip() for line in out.file.getvalue().splitlines()]


def test_the_least_that_a_case_measures():
    assert rows() == ["goodput     4.900 Mb/s  of payload", "throughput  5.250 Mb/s  with headers",
                      "delivered            7", "measured       3.000 s  simulated, without the "
                                                "warm-up"]


def test_slow_networks_have_their_rates_in_kilobits():
    """LoRa carries some hundred bits a second."""
    assert rows(goodput_mbps=0.000293, throughput_mbps=0.00041)[:2] == [
        "goodput     0.293 kb/s  of payload", "throughput  0.410 kb/s  with headers"]


def test_all_that_a_case_may_measure():
    assert rows(
        offered_mbps=6.0, goodput_share=0.98, delay_mean_ms=2.5, delay_error_ms=0.25,
        delay_p50_ms=2.0, delay_p95_ms=4.0, delay_p99_ms=5.0, delivery_ratio=0.875,
        lost={"queue_full": 3, "outage": 1}, attempts=20, failure_rate=0.05, control_frames=9,
        control_bytes=450, utilisation={"mean": 0.5, "max": 0.75}, drop_rate=0.00125,
        fairness=0.99) == [
        "goodput      4.900 Mb/s  of payload; offered 6.000 Mb/s",
        "                 0.9800  of what it is compared with (goodput_share)",
        "throughput   5.250 Mb/s  with headers",
        "delay          2.500 ms  mean, standard error 0.250 ms",
        "               2.000 ms  50 % arrive within",
        "               4.000 ms  95 % arrive within",
        "               5.000 ms  99 % arrive within",
        "delivered             7  0.8750 of what was settled",
        "lost                  3  queue_full", "lost                  1  outage",
        "attempts             20  0.0500 failed (failure_rate)",
        "control           450 B  in 9 frames of protocols",
        "utilisation      0.5000  mean over hosts, ports or cables; the largest 0.7500",
        "drop rate       0.00125  given up, of those that were not refused",
        "fairness         0.9900  Jain's index of the flows",
        "measured        3.000 s  simulated, without the warm-up"]


def test_a_delay_of_one_message_has_no_error():
    assert rows(delay_mean_ms=2.5, delay_error_ms=None, delay_p50_ms=2.5, delay_p95_ms=2.5,
                delay_p99_ms=2.5)[2] == "delay         2.500 ms  mean"


def test_the_number_stands_out_between_its_name_and_its_meaning():
    columns = cases.measures_table(MEASURES).columns
    assert [(column.style, column.justify) for column in columns] == [
        ("cyan", "left"), ("", "right"), ("dim", "left")]


class Inside(Params):
    at_m: Length = Field("1 m", description="where")


class Radio(Params):
    gain: float = Field(1.5, description="of the antenna")
    inside: Inside = Field(Inside(), description="a block")


class Layout(Radio):
    """Places."""

    places: dict[str, Inside] = Field(description="of hosts")
    flows: tuple[Inside, ...] = Field((), description="between them")
    near: Inside | None = Field(None, description="one block")
    rts: bool = Field(False, description="ask first")
    count: int = Field(3, alias="number", description="how many")


def test_the_keys_of_a_file_with_those_inside_of_its_own_blocks():
    assert cases._layout_usage(Layout, Layout).splitlines() == [
        "Usage: desim net layout FILE [--seed N] [--json]", "", "Places.", "",
        "The keys of the file, which is YAML:", "",
        "  places          of hosts", "  places.HOST.at  where; default 1 m",
        "  flows           between them", "  flows[].at      where; default 1 m",
        "  near            one block", "  near[].at       where; default 1 m",
        "  rts             ask first; default false", "  number          how many; default 3", "",
        "and those of the radio (desim describe radio has the keys inside):", "",
        "  gain            of the antenna; default 1.5", "  inside          a block", "",
        "  --seed N  of all random numbers; default 1", "  --json    one JSON object"]


def test_the_usage_of_a_case_has_its_options():
    assert cases._usage("toy", Radio, Layout, "1").splitlines() == [
        "Usage: desim net toy [--key value ...] [--seed N] [--json]", "", "Places.", "",
        "  --gain N    of the antenna; default 1.5",
        "  --inside N  a block; default at_m=1.0",
        "  --seed N    of all random numbers; default 1", "  --json      one JSON object", "",
        "A number without a unit has the one that is shown."]


def test_the_line_about_a_layout_counts_its_hosts_and_says_what_the_radio_is_given():
    given = Layout(places={"a": {}, "b": {}}, flows=({},), gain=2.0)
    assert cases.title("layout", 7, given) == (
        "layout: hosts 2, flows 1, gain 2.0, rts false, number 3, seed 7")
    plain = Layout(places={"a": {}})
    assert cases.title("layout", 7, plain) == (
        "layout: hosts 1, flows 0, rts false, number 3, seed 7")
    assert cases.title("toy", 1, Inside()) == "toy: at 1 m, seed 1"


def net(*words):
    done = CliRunner().invoke(app, ["net", *words])
    return done.exit_code, done.output


@pytest.mark.parametrize(("words", "says"), [
    ([], "FILE is missing: a layout's YAML file\n"),
    (["a.yaml", "b.yaml"], "'a.yaml b.yaml' is not one file; wanted: desim net layout FILE "
                           "[--seed N] [--json]\n"),
    (["--rts"], "'--rts' is not one file; wanted: desim net layout FILE [--seed N] [--json]\n"),
    (["none.yaml"], "none.yaml: no such file\n")])
def test_a_layout_takes_one_file(words, says):
    assert net("layout", *words) == (2, says)


@pytest.mark.parametrize(("given", "target"), [
    ([], "results/two/coverage.png"), (["--to", "far.svg"], "far.svg")])
def test_coverage_is_drawn_into_the_results_or_where_it_is_wanted(tmp_path, monkeypatch, given,
                                                                  target):
    monkeypatch.chdir(tmp_path)
    Path("two.yaml").write_text("name: two\nfleet: {size: 2}\n")
    asked = []
    monkeypatch.setattr("desim.report.reach.draw", lambda scenario, *words: asked.append(
        (scenario.fleet.size, *map(str, words))) or "all of it")
    done = CliRunner().invoke(app, ["coverage", "two.yaml", "--at", "robot_1", "--medium", "lan",
                                    "--set", "fleet.size=3", *given])
    assert (done.exit_code, done.output) == (0, f"all of it\n{target}\n")
    assert asked == [(3, "robot_1", "lan", target)]
    assert Path("results/two").is_dir() == (not given)


@pytest.mark.parametrize(("radio", "shows"), [
    ("{standard: 11n, mcs: 4}", "rate 39 Mb/s"), ("{standard: 11n}", "rate 65 Mb/s"),
    ("{standard: 11ac, mcs: 8, width: 80 MHz, guard_interval: 400 ns, streams: 2}",
     "rate 780 Mb/s")])
def test_of_an_mcs_its_rate_is_shown(tmp_path, radio, shows):
    """IEEE 802.11-2016, tables 19-27 and 21-38."""
    file = tmp_path / "two.yaml"
    file.write_text(f"{radio[:-1]}, places: [[0, 0], [9, 0]], duration: 10 ms, "
                    "warm_up: 10 ms, flows: [{from: 0, to: 1}]}")
    said = CliRunner().invoke(app, ["net", "layout", str(file)])
    assert f", {shows}, " in said.stdout and " 54 Mb/s" not in said.stdout


def test_an_option_is_named_as_it_is_typed():
    said = CliRunner().invoke(app, ["net", "saturation", "--standard", "11n", "--guard-interval",
                                    "1600"])
    assert said.stderr == ("--guard-interval: 11n has none of 1600 ns; allowed: 800 ns, 400 ns\n")
    assert said.exit_code == 2

"""The commands as a user meets them: what they print, and how they exit."""

from __future__ import annotations

import importlib
import json
import os
import re
import shutil
import subprocess
import sys
from contextlib import contextmanager

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest
import typer
from typer.testing import CliRunner

import desim
from desim.cli import app
from desim.commands.compiling import compiling
from desim.commands.exit_codes import exit_codes
from desim.commands.views import progress
from desim.commands.views.message_rows import story
from desim.compiler.store import announced
from desim.engine.kernel import Phase
from desim.results.seal import manifest_of, seal
from desim.results.traces import kept

S = 1_000_000_000


@pytest.fixture(scope="module")
def hello(repository):
    return str(repository / "scenarios" / "hello.yaml")


def desim_(*words, code: int = 0) -> str:
    """The output of a command; the test fails if it exits with another code."""
    done = CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=False)
    assert done.exit_code == code, done.output
    return done.output


def only(folder):
    (path,) = folder.iterdir()
    return path


@pytest.fixture(scope="module")
def run_path(hello, tmp_path_factory):
    """Four seconds of hello; messages are kept, trace rows are not."""
    out = tmp_path_factory.mktemp("results")
    desim_("run", hello, "--until", "4 s", "--out", out, "--quiet")
    return only(out / "hello")


def test_run_prints_the_metrics_and_where_the_results_are(hello, tmp_path):
    out = tmp_path / "a [red]folder[/]"
    said = desim_("run", hello, "--until", "2 s", "--seed", "7", "--out", out)
    assert "hello, seed 7: finished, elapsed" in said
    for word in ("exploration time", "> 2.0 s", "map quality", "messages", "digest"):
        assert word in said
    assert str(only(out / "hello")) in said


def test_quiet_is_quiet(hello, tmp_path):
    assert desim_("run", hello, "--until", "1 s", "--out", tmp_path, "--quiet") == ""


def test_overrides_reach_the_scenario(hello, tmp_path):
    desim_("run", hello, "--until", "1 s", "--set", "fleet.size=2", "--set",
           "coordination.exchange=null", "--out", tmp_path, "--quiet")
    assert len(desim.Run(only(tmp_path / "hello")).metrics["robots"]) == 2


def test_until_ends_a_run_before_its_faults_begin(hello, tmp_path):
    desim_("run", hello, "--until", "1 s", "--set", "faults=[{at: 5 s, host: robot_1}]",
           "--out", tmp_path, "--quiet")
    run = desim.Run(only(tmp_path / "hello"))
    assert (run.metrics["simulated_s"], run.manifest["status"]) == (1.0, "finished")


def test_check_runs_twice(hello, tmp_path):
    assert "every row of the trace is the same" in desim_(
        "run", hello, "--until", "2 s", "--check", "--out", tmp_path)


def test_check_names_the_first_row_that_differs(hello, tmp_path, monkeypatch):
    @contextmanager
    def disturbed(simulation, folder):
        simulation.kernel.at(S, Phase.OBSERVE, 0, lambda _: simulation.trace.row(
            S, simulation.names.id("disturbance"), simulation.names.id("robot_1")))
        yield

    monkeypatch.setattr(progress, "watching", lambda console: disturbed)
    said = desim_("run", hello, "--until", "2 s", "--check", "--out", tmp_path, code=1)
    assert "the run does not repeat itself" in said
    row = next(line for line in said.splitlines() if line.lstrip().startswith(">"))
    assert row.split() == [">", "1.000000000", "s", "disturbance", "robot_1", "0", "0", "0"]


@pytest.mark.parametrize("words, says", [
    (["--set", "robot.laser.rate=5 m"], "unknown unit"),
    (["--set", "fleet.sise=3"], "did you mean 'size'?"),
    (["--until", "5"], "has no unit"),
    (["--set", "physics.model=desim.ports:World"], "has no build(), advance()"),
    (["--set", "fleet.start.step=[0.1 m, 0 m]"], "fleet.start"),
])
def test_wrong_input_is_one_clear_message_and_exit_code_2(hello, tmp_path, words, says):
    said = desim_("run", hello, "--out", tmp_path, *words, code=2)
    assert says in said
    assert "Traceback" not in said
    assert not list(tmp_path.rglob("*.json"))


def test_a_missing_scenario(tmp_path):
    assert "nowhere.yaml" in desim_("run", tmp_path / "nowhere.yaml", code=2)


def test_ctrl_c_exits_with_130_and_says_what_is_kept(hello, tmp_path, monkeypatch):
    def interrupt(_):
        import signal
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(progress, "watching", lambda console: at(1.5, interrupt))
    said = desim_("run", hello, "--out", tmp_path, code=130)
    path = only(tmp_path / "hello")
    assert said.strip() == f"interrupted; what there is until then: {path}"
    assert desim.Run(path).manifest["status"] == "interrupted"


def test_our_own_failure_shows_the_traceback_and_how_to_repeat_it(hello, tmp_path, monkeypatch):
    def fail(_):
        raise RuntimeError("a bug")

    monkeypatch.setattr(progress, "watching", lambda console: at(1.5, fail))
    monkeypatch.setattr(sys, "argv", ["desim", "run", "a scenario.yaml"])
    said = desim_("run", hello, "--out", tmp_path, code=1)
    assert "RuntimeError: a bug" in said
    assert "at simulated time 1.500000000 s" in said
    assert said.rstrip().endswith("desim run 'a scenario.yaml'")


def at(time_s: float, do):
    """A watch that calls ``do`` at an instant of the run."""
    @contextmanager
    def watch(simulation, folder):
        simulation.kernel.at(round(time_s * S), Phase.WORLD, 0, do)
        yield

    return watch


def test_the_gauge_reads_what_happened_since_it_was_read_before(hello, tmp_path):
    readings, on_air, wall_s = [], [0], iter((10.0, 12.0, 12.5))

    @contextmanager
    def watch(simulation, folder):
        gauge = progress.Gauge(simulation, folder, clock=lambda: next(wall_s))
        for time_s in (1, 3):
            simulation.kernel.at(time_s * S, Phase.OBSERVE, 0, lambda _: (
                simulation.graph.catch_up(), readings.append(gauge.read()),
                on_air.append(progress.totals(simulation.graph).bytes_on_air)))
        yield

    run = desim.run(hello, overrides=("stop.elapsed=4 s",), out=tmp_path, watch=watch)
    table = run.table("messages")
    arrived = (table["end_ns"] >= S) & (table["end_ns"] <= 3 * S) & (table["fate"] == "delivered")
    assert [reading["time_s"] for reading in readings] == [1.0, 3.0]
    assert [reading["factor"] for reading in readings] == [0.5, 4.0]
    assert readings[1]["messages_per_s"] == pytest.approx(arrived.sum() / 2, abs=20)
    assert [reading["bytes_per_s"] for reading in readings] == [
        on_air[1], (on_air[2] - on_air[1]) / 2]
    last = arrived & (table["end_ns"] >= 2 * S)
    links = set(zip(table["source"][last], table["destination"][last], strict=True))
    assert readings[1]["links"] == len(links)
    assert 0.0 < readings[0]["explored"] <= readings[0]["explored_union"] <= 1.0


# ---------------------------------------------------------------------------- looking at a run


def test_messages_are_found_by_topic_fate_and_time(run_path):
    table = desim.Run(run_path).table("messages")
    scans = sorted(set(table["number"][table["topic"] == "/robot_0/scan"].tolist()))
    lines = desim_("trace", run_path, "--topic", "/robot_0/sc*n").splitlines()
    assert lines[0].strip().startswith("message    published at")
    assert [int(line.split()[0]) for line in lines[1:41]] == scans[:40]
    assert lines[41] == f"and {len(scans) - 40} more"
    (under_way,) = {line.split()[1] for line in
                    desim_("trace", run_path, "--topic", "*/scan", "--at", "2 s").splitlines()[1:]}
    assert under_way == "2.000000"
    assert desim_("trace", run_path, "--dropped") == \
        f"none of {table['number'].size} messages was dropped\n"
    assert desim_("trace", run_path, "--topic", "nonsense", "--dropped").startswith(
        f"none of {table['number'].size} messages; topics are /map_exchange/")


def test_the_story_of_a_message_is_the_same_kept_or_run_again(hello, run_path, tmp_path):
    desim_("run", hello, "--until", "4 s", "--set", "trace.keep=all", "--set", "trace.ledger=true",
           "--out", tmp_path, "--quiet")
    table = desim.Run(run_path).table("messages")
    # The driver looks at a command when it moves the robot next.
    number = table["number"][table["topic"] == "/robot_0/cmd_vel"][0]
    of_kept = desim_("trace", only(tmp_path / "hello"), "--message", number)
    assert desim_("trace", run_path, "--message", number) == of_kept
    rows, times = of_kept.split("\n\n")
    steps = [line.split()[4] for line in rows.splitlines()]
    assert steps[0] == "sent" and set(steps[1:]) >= {"frame", "delivered", "read"}
    assert times.strip() in desim_("why", run_path, "--message", number)
    assert times.splitlines()[-1].startswith("receiver's queue workstation ")


def test_every_message_has_its_own_rows(hello, tmp_path):
    run = desim.run(hello, overrides=("stop.elapsed=2 s", "trace.keep=all"), out=tmp_path)
    rows, names = kept(run, tmp_path / "spool")
    table = run.table("messages")
    for i in np.linspace(0, len(table["number"]) - 1, 25).astype(int).tolist():
        number = int(table["number"][i])
        steps = story(rows, names, number)
        assert steps[0].time_ns == table["born_ns"][i]
        assert steps[0].where == table["source"][i]
        assert steps[0].detail == f"{table['topic'][i]}, {table['size_bytes'][i]} B"
        assert ("delivered", table["destination"][i], table["end_ns"][i]) in [
            (step.what, step.where, step.time_ns) for step in steps]
    assert story(rows, names, int(table["number"].max()) + 10**6) == []
    assert desim_("trace", run.path, "--message", 1).splitlines()[-1] == (
        f"where its time went (the run is repeated): desim why {run.path} --message 1")


def test_a_run_that_ends_at_once(hello, tmp_path):
    """Before the first sample, and before any message has arrived."""
    desim_("run", hello, "--until", "1 us", "--out", tmp_path, "--quiet")
    path = only(tmp_path / "hello")
    ended = "no message between hosts had reached its fate when the run ended\n"
    assert desim_("trace", path) == desim_("why", path, code=2) == ended
    assert desim_("trace", path, "--message", 1).endswith(
        " B with headers\n\nit had not reached its fate when the run ended\n")
    desim_("figure", path)
    shown = desim.Run(path)._repr_html_()
    assert "<td style=\"text-align:left\">exploration time</td>" in shown and "nan" not in \
        re.sub("<iframe.*</iframe>", "", shown)


def test_a_message_that_does_not_exist(run_path):
    said = desim_("trace", run_path, "--message", 10**7, code=2)
    assert "no message 10000000; a run's messages between hosts have the numbers 1 to" in said


def test_diff_of_a_run_with_itself_and_with_another(hello, run_path, tmp_path):
    assert desim_("diff", run_path, run_path) == "the traces are equal\n"
    desim_("run", hello, "--until", "4 s", "--seed", "5", "--out", tmp_path, "--quiet")
    said = desim_("diff", run_path, only(tmp_path / "hello"), code=1)
    assert "entities differ" in said
    assert "is the first that differs" in said
    assert sum(line.lstrip().startswith(">") for line in said.splitlines()) == 2


def test_diff_names_a_line_of_the_entities_that_differ(hello, run_path, tmp_path):
    """Each robot that one run has and the other has not is one of them."""
    desim_("run", hello, "--until", "100 ms", "--set", "fleet.size=16", "--set",
           "fleet.start={from: [-8 m, 10 m], step: [1 m, 0 m], snap: true}", "--out", tmp_path,
           "--quiet")
    first, *_ = desim_("diff", run_path, only(tmp_path / "hello"), code=1).splitlines()
    count, _, names = re.fullmatch(r"(\d+) of (\d+) entities differ: (.*), \.\.\.", first).groups()
    assert int(count) > 13 and len(names.split(", ")) == 12


def test_diff_reads_the_poses_of_runs_with_one_digest(run_path, tmp_path):
    """A table that was changed and sealed again has the digest of what happened."""
    copy = shutil.copytree(run_path, tmp_path / "copy")
    rows = pq.read_table(copy / "poses.parquet")
    moved = pc.add(rows["x_mm"], pa.scalar(250, rows.schema.field("x_mm").type))
    pq.write_table(rows.set_column(rows.schema.get_field_index("x_mm"),
                                   rows.schema.field("x_mm"), moved), copy / "poses.parquet")
    seal(copy, manifest_of(copy), set(manifest_of(copy)["files"]))
    assert desim_("diff", run_path, copy, code=1) == (
        "the digests are equal, but poses are not: robot_0 parts at 0 s, by 0.25 m; "
        "a folder was changed\n")


def test_diff_of_a_failed_run_says_so(hello, run_path, tmp_path, monkeypatch):
    def fail(_):
        raise RuntimeError("a bug")

    monkeypatch.setattr(progress, "watching", lambda console: at(1.5, fail))
    desim_("run", hello, "--out", tmp_path, code=1)
    failed = only(tmp_path / "hello")
    for runs in ((failed, run_path), (run_path, failed), (failed, failed)):
        assert desim_("diff", *runs, code=2) == (
            f"{failed}: the run failed, it has no digest and no end to compare or repeat; its "
            "manifest.json has the error\n")
    assert "the run failed" in desim_("trace", failed, "--message", 10**7, code=2)


def test_a_message_lost_for_good_has_a_place_of_its_loss(hello, tmp_path):
    @contextmanager
    def stopping(simulation, folder):
        simulation.kernel.at(S, Phase.WORLD, 0, lambda _: simulation.graph.hosts[0].stop())
        yield

    run = desim.run(hello, out=tmp_path, watch=stopping, overrides=(
        "stop.elapsed=2 s", "trace.keep=all", "trace.ledger=true",
        "network.media.lan={model: ideal, rules: [{rule: loss, probability: 50 %}]}"))
    table = run.table("messages")
    waited = (table["fate"] == "dropped") & (table["end_ns"] > table["last_ns"])
    said = desim_("trace", run.path, "--message", table["number"][waited][0])
    assert ", dropped (sender_down at robot_0) after 201.318 ms" in said
    assert "propagation" not in said.splitlines()[-2]
    assert said.splitlines()[-1].startswith("frames between the two hosts were lost meanwhile")


def test_a_folder_that_is_no_run(tmp_path):
    for command in (["diff", tmp_path, tmp_path], ["figure", tmp_path],
                    ["trace", tmp_path, "--message", 1]):
        assert "not the folder of a run" in desim_(*command, code=2)


def test_check_of_a_scenario_names_the_commands_for_one(tmp_path):
    (tmp_path / "a.yaml").write_text("name: a\n")
    assert desim_("check", tmp_path / "a.yaml", code=2).strip() == (
        f"{tmp_path}/a.yaml: a file, not the folder of a run; of a scenario: desim run FILE, or "
        "desim net fleet FILE without its robots")


def test_plugins_lists_every_kind():
    said = desim_("plugins")
    for word in ("network (desim.networks)", "switch", "range", "nearest_frontier", "direct"):
        assert word in said
    for line in ("  Time division: a cycle of slots, each long enough for one packet, and each "
                 "host sends in its own one.\n",
                 "  The range of ``network.fidelity: disk``, computed from path loss and error "
                 "model, against what ``mac`` delivers there to a single receiver.\n"):
        assert line in said


def test_what_must_be_given_has_an_example():
    assert "  delay: must be given, e.g. '20 ms'.  one way\n" in desim_("describe", "latency")
    assert "  at: must be given, e.g. ['3 m', '-2.5 m'].  x and y" in desim_("describe", "jamming")


def test_describe_says_what_a_plugin_does_and_takes():
    said = desim_("describe", "switch")
    assert said.startswith("switch (network): netmodels.switch.switch:Switch")
    assert "rate: default '1 Gb/s'" in said
    assert "drops for: queue_full" in said
    assert desim_("describe", "netmodels.switch:Switch").split("\n\n")[1:] \
        == said.split("\n\n")[1:]
    radio = desim_("describe", "netmodels.radio.dcf.radio:DcfRadio")
    assert ("  reception: of receivers (802.11-2016)\n"
            "    noise_figure: default '7 dB'.  noise") in radio
    for slot in "  fading: default None.  by", "    speed: default '1.2 m/s'.  of":
        assert slot in radio
    assert "did you mean 'switch'?" in desim_("describe", "swich", code=2)


def test_terrains_are_described_built_in_and_generated():
    assert "  zigzag     Nine walls and ten roads.\n" in desim_("plugins")
    built_in, generated = desim_("describe", "maze").split("\n\nmaze (generated terrain): ")
    assert built_in == ("maze (terrain): environment.terrain: maze\n\nThin walls on a grid of 10 x "
                        "10 cells, 80 m x 80 m (the paper).\n\nno parameters")
    assert generated.startswith("environment.terrain: {maze: ...}\n\nA maze of square cells")
    assert "\n  cell: default '8 m'.  side of a cell" in generated
    assert "did you mean 'warehouse'?" in desim_("describe", "warehuose", code=2)


@pytest.mark.parametrize("path, says", [
    ("os:path", "'os:path' is not a plug-in: it names a module, and a plug-in is a class"),
    ("os:sep", "'os:sep' is not a plug-in: it names a str, and a plug-in is a class"),
    ("os:fspath", "'os:fspath' is not a plug-in: it names a builtin_function_or_method, and a "
                  "plug-in is a class"),
    ("shlex:join", "a function that is a rule takes (frame, receivers) or (frame, receivers, "
                   "context)")])
def test_describe_refuses_what_is_neither_a_class_nor_a_rule(path, says):
    assert desim_("describe", path, code=2).rstrip().endswith(says)


def test_schema_is_json_schema():
    schema = json.loads(desim_("schema"))
    assert set(schema["properties"]) >= {"name", "fleet", "network", "stop"}


def test_the_light_commands_import_nothing_heavy():
    code = "import desim, desim.cli, sys; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {name.split(".")[0] for name in done.stdout.split()}
    assert not loaded & {"numba", "numpy", "matplotlib", "networkx", "pydantic", "pyarrow",
                         "scipy"}


KERNEL = """
from desim.ports.kernels import kernel

@kernel("i8(i8)")
def twice(x):
    return 2 * x
"""


def test_only_what_is_compiled_is_announced_and_once(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.syspath_prepend(tmp_path)
    for name in "chilly", "frozen":
        (tmp_path / f"{name}.py").write_text(KERNEL)
    said = []
    with announced(lambda: said.append("compiling")):
        for name in "chilly", "frozen":
            assert importlib.import_module(name).twice(2) == 4
    assert said == ["compiling"]
    del sys.modules["chilly"]
    with announced(lambda: said.append("again")):
        assert importlib.import_module("chilly").twice(3) == 6  # from the cache
    assert said == ["compiling"]


def test_where_kernels_cannot_be_kept_the_way_out_is_said():
    def fail():
        with exit_codes(), compiling(quiet=True):
            raise RuntimeError("cannot cache function 'sin': no locator available")

    with pytest.raises(typer.Exit) as left:
        fail()
    assert left.value.exit_code == 2


# --------------------------------------------------------------------- networks without robots


IDLE_LINE = ("bottleneck", "--senders", 1, "--load", 0.5, "--arrivals", "periodic", "--duration", 3)


def test_net_lists_the_cases():
    said = desim_("net")
    assert said == desim_("net", "--help")
    assert "  saturation  Saturated stations of 802.11 that all hear each other equally" in said


def test_net_shows_the_options_of_a_case():
    said = desim_("net", "saturation", "--help")
    assert "Usage: desim net saturation [--key value ...] [--seed N] [--json]" in said
    assert re.search(r"\n  --stations N +that send \(a fleet\); default 10\n", said)


def test_net_prints_a_table():
    said = desim_("net", *IDLE_LINE)
    assert said.splitlines()[0] == (
        "bottleneck: senders 1, capacity 10 Mb/s, load 0.5, queue 100, arrivals periodic, payload "
        "1472 B, latency 1 ms, duration 3 s, seed 1")
    rows = [line.split() for line in said.splitlines()]
    assert ["delay", "2.202", "ms", "mean,", "standard", "error", "0.000", "ms"] in rows
    assert ["delivered", "1249", "1.0000", "of", "what", "was", "settled"] in rows


def test_net_prints_one_json_object_with_the_same_keys_everywhere():
    line = json.loads(desim_("net", *IDLE_LINE, "--json", "--seed", 4))
    assert (line["case"], line["seed"], line["settings"]["capacity"]) == (
        "bottleneck", 4, "10 Mb/s")
    assert line["goodput_mbps"] == pytest.approx(4.9, rel=0.001)
    hidden = json.loads(desim_("net", "hidden", "--spacing", 30, "--rts", "--duration", "1 s",
                               "--json"))
    assert (hidden["settings"]["rts"], hidden["settings"]["spacing"]) == (True, "30 m")
    assert set(line) == set(hidden) >= {
        "goodput_mbps", "delay_mean_ms", "delay_p50_ms", "delay_p95_ms", "delay_p99_ms", "lost",
        "attempts", "failure_rate", "drop_rate"}


@pytest.mark.parametrize(("words", "says"), [
    (("saturatoin",), "unknown case 'saturatoin' (did you mean 'saturation'?); known: bottleneck, "
                      "broadcast, bus, chain, hidden, layout, saturation, two_pairs, or a dotted "
                      "path 'package.module:Class'"),
    (("hidden", "--spacng", 3), "--spacng: there is no such option (did you mean 'spacing'?); "
                                "allowed: --spacing, --rts, --load, --standard, --rate, --payload, "
                                "--preset, --duration, --seed, --json"),
    (("hidden", "--spacing", "3 kg"), "--spacing: unknown unit 'kg' for a length; allowed: m, km, "
                                      "cm, mm, e.g. '200 m'"),
    (("saturation", "--rate", 10, "--standard", "11b"),
     "--rate: 10 Mb/s is no rate of 11b; allowed: 1 Mb/s, 2 Mb/s, 5.5 Mb/s, 11 Mb/s"),
    (("saturation", "--standard", "11b", "--headers", 600000),
     "--headers: 1000 B of payload and 600000 B of headers are too long for 802.11; at most 2296 B"
     ),
    (("chain", "--mac", "dcf", "--rate", 7), "--rate: 7 Mb/s is no rate of 11a; allowed: 6 Mb/s, 9 "
     "Mb/s, 12 Mb/s, 18 Mb/s, 24 Mb/s, 36 Mb/s, 48 Mb/s, 54 Mb/s"),
    (("chain", "--mac", "dcf", "--rate", 54, "--hops", 2),
     "--rate: 5% of packets at 54 Mb/s get over 25 m, too few for a hop; allowed: a slower rate, "
     "or hosts nearer to each other (--spacing)"),
    (("hidden", "--load", 1e9), "--load: 1e+09 Mb/s is more than a sender gets onto the air; "
                                "allowed: at most the rate, or none (saturated)"),
    (("bottleneck", "--load", 1e-9), "--load: must be at least 0.001, got 1e-09"),
    (("bus", "--load", 1e-9), "--load: must be at least 0.001, got 1e-09"),
    (("bottleneck", "--capacity", 1e-6), "it would last 1.34e+10 simulated seconds; at most 1e+09"),
    (("broadcast", "--hz", 1e-9), "--hz: nobody says anything in 40 s; allowed: more often, or a "
                                  "longer --duration"),
    (("hidden", "--preset", "foo"), "--preset: 'foo' is not allowed; allowed: ns3_3_44, or none"),
    (("saturation", "--payload", 1.5), "--payload: '1.5 B' is not a whole number of B"),
    (("chain", "--leave", 100),
     "--leave: 100 s is not before the end, which is 12 s after the start of the flow"),
    (("saturation", "--payload", 2296),
     "--payload: 2296 B of payload and 28 B of headers are too long for 802.11; at most 2296 B"),
    (("bus", "--mode", "csma_cd", "--propagation", "30 us"),
     "--propagation: twice 30000 ns and the jam of 3200 ns must fit into a slot of 512 bits, 51200 "
     "ns at this rate"),
])
def test_net_complains_once_and_exits_with_2(words, says):
    assert desim_("net", *words, code=2) == f"{says}\n"


@pytest.mark.parametrize(("words", "wrong", "command"), [
    (("net", "bus", "--seed", -1), "Invalid value for '--seed': ", "desim net"),
    (("net", "bus", "--seed", "abc"), "Invalid value for '--seed': ", "desim net"),
    (("validate", "extra"), "Got unexpected extra argument", "desim validate"),
    (("describe",), "Missing argument 'PLUGIN'", "desim describe"),
    (("sweep", "--jbos", 3), "No such option", "desim sweep"),
    (("validat",), "No such command 'validat'", "desim"),
])
def test_a_wrong_command_line_takes_a_line(words, wrong, command):
    """The complaint is in the words of typer."""
    said, = desim_(*words, code=2).splitlines()
    assert said.startswith(wrong) and said.endswith(f"; allowed: see {command} --help")


def test_without_a_command_there_is_help():
    assert "Commands" in desim_(code=2)


def test_validate_compares():
    said = desim_("validate", "--only", "round_trip", "--only", "packet_errors")
    assert "round_trip: ROS-NetSim, README: 500 ms one way\n" in said
    assert "ok     1000.000000   1000.000000      0.000000  ms    round trip: mean\n" in said
    assert said.endswith("14 of 14 within tolerance\n")


def test_validate_fails_where_a_comparison_does(monkeypatch):
    from netmodels.validation import rules

    monkeypatch.setattr(rules, "EACH_WAY", "501 ms")
    said = desim_("validate", "--only", "round_trip", code=1)
    assert "FAIL   1002.000000   1000.000000      0.000000  ms    round trip: mean\n" in said
    found = json.loads(desim_("validate", "--only", "round_trip", "--json", code=1))
    assert (found["checks"], found["failed"]) == (2, 2)
    assert found["rows"][0] == {
        "group": "round_trip", "source": "ROS-NetSim, README: 500 ms one way",
        "what": "round trip: mean", "measured": 1002.0, "published": 1000.0, "tolerance": 0.0,
        "unit": "ms", "holds": False}


def test_validate_knows_its_groups():
    said = desim_("validate", "--only", "wating", code=2)
    assert said.startswith("--only: there is no group 'wating' (did you mean 'waiting'?); known: "
                           "access_categories, access_points, aloha, associations, broadcast, "
                           "bursts, bus, chain, chains, collisions, ")


def test_too_little_address_space_is_an_error_and_no_wait(hello):
    """With half of what it wants: OpenBLAS would wait for ever."""
    done = subprocess.run(
        ["bash", "-c", 'ulimit -v 550000; exec "$@"', "-", sys.executable, "-m", "desim.cli", "run",
         hello, "--until", "5 s"], capture_output=True, text=True, check=False,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"})
    assert done.returncode == 2
    assert done.stderr == ("a process may have 550000 kB of address space (ulimit -v); desim wants "
                           "585937 kB at least\n")


def test_a_terminal_without_unicode(run_path):
    """A bar's characters become question marks; nothing fails."""
    shown = subprocess.run([sys.executable, "-m", "desim.cli", "why", run_path], check=True,
                           capture_output=True, env={**os.environ, "PYTHONIOENCODING": "ascii"})
    assert b"?" in shown.stdout and shown.stderr == b""


@pytest.mark.parametrize(("option", "says"), [
    ("--pace", "--pace: it belongs to --live and --foxglove"),
    ("--port", "--port: it belongs to --live")])
def test_options_of_a_live_run(hello, option, says):
    assert desim_("run", hello, option, "5", code=2).strip() == says

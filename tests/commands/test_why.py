"""``desim why``: the waterfalls, the selection, and what it refuses."""

import json
from io import StringIO

import pyarrow.parquet as pq
import pytest
from rich.console import Console
from typer.testing import CliRunner

from desim import api
from desim.cli import app
from desim.commands.views.why import bar, duration, in_words, show
from desim.errors import InputError
from desim.results.file_names import LEDGER
from desim.results.ledger import ledger_of, read_ledger
from desim.results.run import Run
from desim.results.why import BUSY, READ, Query, breakdown

SLOW = ("stop.elapsed=4 s", "network.media={lan: {model: switch, rate: 300 kb/s}}")


@pytest.fixture(scope="module")
def made(repository, tmp_path_factory):
    """A run of hello on a slow LAN that has kept its messages, and one with its ledger."""
    out = tmp_path_factory.mktemp("results")
    return [api.run(repository / "scenarios" / "hello.yaml", out=out,
                    overrides=(*SLOW, f"trace.ledger={kept}")) for kept in ("false", "true")]


@pytest.fixture(scope="module")
def ledger(made):
    return ledger_of(made[1])


def why(*words, code=0):
    outcome = CliRunner().invoke(app, ["why", *map(str, words)])
    assert outcome.exit_code == code, outcome.output
    return outcome.output


def test_a_ledger_is_the_same_kept_or_made_again(made, ledger):
    plain, kept = made
    assert plain.manifest["digest"] == kept.manifest["digest"]
    assert kept.has(LEDGER) and not plain.has(LEDGER)
    assert ledger_of(plain).to_pylist() == ledger.to_pylist()


def test_it_has_the_messages_of_the_run(made, ledger):
    messages = made[1].table("messages")
    for column in ("number", "born_ns", "end_ns", "size_bytes"):
        assert (ledger[column].to_numpy() == messages[column]).all()
    for column in ("topic", "source", "destination", "fate", "reason"):
        assert ledger[column].to_pylist() == messages[column].tolist()


def test_messages_are_read_after_they_have_arrived(ledger):
    read = [row for row in ledger.to_pylist() if row["read_ns"] is not None]
    assert read and all(row["read_ns"] >= row["end_ns"] for row in read)
    assert any(row["read_ns"] > row["end_ns"] for row in read)
    assert all(row["read_ns"] is None for row in ledger.to_pylist() if row["reason"])


def test_the_latest_come_first_and_their_parts_sum_up(ledger):
    found = breakdown(ledger, Query(late=7))
    latencies = [fate.latency_ns for fate in found.messages]
    assert len(latencies) == 7 and latencies == sorted(latencies, reverse=True)
    assert latencies[0] == max(row["latency_ns"] or 0 for row in ledger.to_pylist())
    for fate, latency_ns in zip(found.messages, latencies, strict=True):
        assert sum(part.time_ns for part in fate.parts) == latency_ns
    shown_ns = sum(time_ns for part, time_ns in found.messages_times_ns.items() if part != READ)
    assert shown_ns == sum(latencies)
    assert found.delivered + found.dropped == len(ledger)


def test_messages_are_chosen_by_topic_host_and_number(ledger):
    found = breakdown(ledger, Query(topic="/*/cmd_vel", source="robot_1", late=10**6))
    assert found.delivered == len(found.messages) > 0
    assert {(fate.topic, fate.source) for fate in found.messages} == {
        ("/robot_1/cmd_vel", "robot_1")}
    found = breakdown(ledger, Query(destination="robot_?", late=10**6))
    assert {fate.destination[:6] for fate in found.messages} == {"robot_"}
    number = breakdown(ledger, Query()).messages[3].number
    assert [fate.number for fate in breakdown(ledger, Query(message=number)).messages] == [number]


def test_dropped_messages_have_a_reason_and_a_place(ledger):
    found = breakdown(ledger, Query(dropped=True, late=3))
    assert len(found.messages) == 3
    assert {(fate.reason, fate.place) for fate in found.messages} == {
        ("outbox_full", "workstation")}
    assert sum(lost.messages for lost in found.lost) == found.dropped
    one, = breakdown(ledger, Query(message=found.messages[0].number)).messages
    assert one.reason == "outbox_full"


@pytest.mark.parametrize("query, says", [
    (Query(topic="/robot_1/scn"), r"no message has the topic '/robot_1/scn' \(did you mean "
                                     r"'/robot_1/scan'\?\); there are /map_exchange/robot_"),
    (Query(source="robto_1"), r"no message has the sender 'robto_1' \(did you mean 'robot_1'"),
    (Query(destination="nobody"), "no message has the receiver 'nobody'; there are robot_0, "),
    (Query(message=10**9), r"no message 1000000000 among those with a fate; the last of them "
                              r"is \d+"),
    (Query(topic="/robot_0/scan", source="robot_1"), "no message of this topic between these"),
    (Query(message=1, topic="/robot_9/*"), r"message 1 has not the topic '/robot_9/\*', but /"),
    (Query(message=1, dropped=True), "message 1 was delivered, not dropped"),
])
def test_a_wrong_question_is_one_clear_complaint(ledger, query, says):
    with pytest.raises(InputError, match=says):
        breakdown(ledger, query)


def test_a_run_without_messages_says_so(ledger):
    with pytest.raises(InputError, match="no message between hosts had reached its fate when"):
        breakdown(ledger.slice(0, 0), Query())


def test_a_run_of_another_version_that_kept_no_ledger_is_refused(made, monkeypatch):
    monkeypatch.setitem(made[0].manifest, "source", "another")
    with pytest.raises(InputError, match="its messages' parts of time were not kept, and it "
                                         "cannot be repeated: source in its manifest differ from "
                                         r"those installed now; run the scenario again \(with "
                                         r"--set trace.ledger=true they are kept\)"):
        ledger_of(made[0])


def test_a_run_that_does_not_repeat_itself_says_so(made, monkeypatch):
    monkeypatch.setitem(made[0].manifest, "digest", "another")
    with pytest.raises(InputError, match="the run does not repeat itself: its digest is another,"):
        ledger_of(made[0])


def test_the_command_prints_waterfalls(made):
    text = why(made[1].path, "--late", 1, "--topic", "/robot_?/scan")
    assert text.startswith("1 of ") and "/scan, workstation -> robot_" in text
    assert "\nqueue            lan at workstation" in text and " █" in text
    assert "delivered messages that match: mean of each part" in text
    assert " dropped messages that match\n" in text and "outbox_full      at workstation" in text
    found = json.loads(why(made[1].path, "--dropped", "--json"))
    assert found["dropped"] == sum(lost["messages"] for lost in found["lost"])
    assert len(found["messages"]) == 10
    assert why(made[1].path, "--from", "nobody", code=2).count("\n") == 1
    topic, whole = next(item for item in found["by_topic"].items() if not item[1]["lost"])
    assert why(made[1].path, "--topic", topic, "--dropped").startswith(
        f"none of {whole['delivered']} messages that match was dropped\nall ")
    assert "not the folder of a run" in why(made[1].path.parent, code=2)


@pytest.mark.parametrize("width", [40, 80, 200])
def test_bars_begin_where_the_one_before_ends(ledger, width):
    out = Console(file=StringIO(), width=width)
    show(breakdown(ledger, Query(late=1)), {}, out)
    drawn = [line[36:] for line in out.file.getvalue().partition("\n\n")[2].splitlines()
             if "█" in line]
    begins = [len(line) - len(line.lstrip()) for line in drawn]
    assert begins == sorted(begins) and len(drawn) > 2


def test_the_place_of_a_loss_in_words():
    assert in_words("air at robot_240") == "on air at robot_240"
    assert in_words("robot_3") == "at robot_3"


def test_bars_and_durations():
    assert bar(0, 5, 10, 4) == "██" and bar(5, 5, 10, 4) == "  ██"
    assert bar(0, 1, 10**6, 4) == "▏" and bar(10**6 - 1, 1, 10**6, 4) == "   █"
    assert bar(0, 3, 8, 2) == "▊" and bar(0, 0, 0, 9) == ""
    assert [duration(ns) for ns in (0, 999, 1000, 1.5e6, 2.25e9)] == [
        "0 ns", "999 ns", "1.000 us", "1.500 ms", "2.250 s"]


def test_a_run_knows_its_ledger(made, ledger):
    assert Run(made[1].path).ledger.equals(ledger)


SLOW_NODES = ("computers={model: table, callbacks: {move_base: {control: {fixed: 30 ms}, "
              "any: {fixed: 5 ms}}, mapping: {any: {fixed: 8 ms}}}}", "stop.elapsed=3 s",
              "trace.ledger=true")


@pytest.fixture(scope="module")
def busy(repository, tmp_path_factory):
    """A run of hello on computers that get busy."""
    return api.run(repository / "scenarios" / "hello.yaml", overrides=SLOW_NODES,
                   out=tmp_path_factory.mktemp("busy"))


def test_commands_were_computed_before_their_birth(busy):
    found = breakdown(busy.ledger, Query(topic="/*/cmd_vel", late=3, since="/*/scan"))
    for fate in found.messages:
        *waits, (part, place, time_ns) = fate.before
        assert (part, place, time_ns) == ("computing", f"{fate.source} move_base", 30_000_000)
        assert {part for part, *_ in waits} <= {"node's queue", "run queue"}
    assert found.times_ns["computing"] == 30_000_000 * found.delivered
    age = found.age
    assert age.messages + age.blind == found.delivered and age.messages > 0
    assert age.mean_ns == pytest.approx(sum(age.parts_ns.values()))
    assert age.parts_ns["callback"] >= 30_000_000


def test_the_command_prints_what_was_before_the_birth(busy):
    text = why(busy.path, "--topic", "/*/cmd_vel", "--late", 1, "--since", "/*/scan")
    summary, _, story = text.partition("\nmessage ")
    before = story.partition("\nborn at ")[0]
    assert "\ncomputing        robot_" in before and " move_base" in before and " █" not in before
    assert "\nsince the reading on which they are based: " in summary and "\nkept  " in summary
    found = json.loads(why(busy.path, "--topic", "/*/cmd_vel", "--since", "/*/scan", "--json"))
    assert found["messages"][0]["before"][-1]["part"] == "computing"
    assert set(found["age"]) == {"messages", "blind", "mean_ns", "longest_ns", "parts_ns"}


def test_ideal_computers_have_nothing_before_a_birth(ledger):
    found = breakdown(ledger, Query())
    assert not any(fate.before for fate in found.messages)
    assert not {"node's queue", "run queue", "computing", BUSY} & found.times_ns.keys()


def test_a_ledger_of_before_computers_got_busy_is_read(made, ledger, tmp_path):
    """Its columns on callbacks are null."""
    new = ["node", "called_ns", "node_queue_ns", "run_queue_ns", "computing_ns", "by_callback"]
    pq.write_table(ledger.drop_columns(new), tmp_path / LEDGER)
    read = read_ledger(tmp_path / LEDGER)
    assert read.drop_columns(new).to_pylist() == ledger.drop_columns(new).to_pylist()
    assert read["node"].null_count == read["by_callback"].null_count == len(ledger)

"""The report of a campaign whose runs kept their ledgers: where messages' time went, by topic."""

import csv
import json
import re
from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from desim.campaign.design.design import load_design
from desim.cli import app
from desim.report.campaign.campaign_report import write
from desim.report.campaign.figures.latency import latency_figure
from desim.report.campaign.numbers import Estimates, Study
from desim.report.campaign.numbers.latencies import by_topic_and_vector
from desim.report.campaign.tables.latency import age_table
from desim.results.file_names import LEDGER, LEDGER_TOPICS
from desim.results.latency_by_topic import as_json, by_topic, from_json, hosts_of, without_numbers
from desim.results.run import Run
from desim.results.why import Query, breakdown
from desim.statistics.intervals import t_interval

pytestmark = pytest.mark.usefixtures("svg_alone")

PARTS = {"sender's queue": "senders_queue_s", "queue": "queue_s", "airtime": "airtime_s",
         "propagation": "propagation_s", "retransmission": "retransmission_s"}

def swept(folder, repository, ledger, more=""):
    """A campaign on a LAN of 300 kb/s: maps wait, and outboxes lose some."""
    design = folder / "design.yaml"
    design.write_text(f"""\
name: d
base: {repository / "scenarios" / "hello.yaml"}
set: {{stop.elapsed: 4 s, trace.ledger: {ledger}, {more}
      network.media: {{lan: {{model: switch, rate: 300 kb/s}}}}}}
parameters: {{robots: {{key: fleet.size, values: [2, 3]}}}}
iterations: 2
report: {{metrics: [explored_area_m2]}}
""")
    outcome = CliRunner().invoke(app, ["sweep", str(design), "--jobs", "1", "--quiet", "--out",
                                       str(folder / "d")])
    assert outcome.exit_code == 0, outcome.output
    return folder / "d", load_design(design).design


@pytest.fixture(scope="module")
def kept(tmp_path_factory, repository):
    """A campaign that kept its ledgers, and its design."""
    return swept(tmp_path_factory.mktemp("kept"), repository, "true")


@pytest.fixture(scope="module")
def by_hand(kept):
    """From ``ledger.parquet``: of each vector and topic, a run's mean latency, mean parts and
    counts of losses, message by message."""
    found = {}
    study = Study(*kept)
    for vector in study.vectors:
        for row in vector.rows:
            ledger = pq.read_table(study.run_folders[study.text("run_id")[row]] / LEDGER)
            run = {}
            for message in ledger.to_pylist():
                topic = "/".join("*" if word.startswith("robot_") or word == "workstation" else word
                                 for word in message["topic"].split("/"))
                latency, parts, lost = run.setdefault(topic, ([], {}, {}))
                if message["latency_ns"] is None:
                    where = message["reason"], without_numbers(message["place"])
                    lost[where] = lost.get(where, 0) + 1
                    continue
                latency.append(message["latency_ns"])
                for part, time_ns in zip(message["parts"], message["times_ns"], strict=True):
                    parts[part] = parts.get(part, 0) + time_ns
            for topic, of_run in run.items():
                found.setdefault((vector.number, topic), []).append(of_run)
    return found


def rows_of(folder, name):
    with open(folder / "report" / "tables" / f"{name}.csv", newline="") as file:
        return list(csv.DictReader(file))


def disagreements(folder, by_hand):
    """Rows of ``latency_by_topic.csv`` with a number that is not that of the ledgers."""
    wrong, rows = [], rows_of(folder, "latency_by_topic")
    assert {(int(row["vector"]), row["topic"]) for row in rows} == set(by_hand)
    for row in rows:
        runs = [run for run in by_hand[int(row["vector"]), row["topic"]] if run[0]]
        if not runs:
            assert row["n"] == "0" and not row["latency_s"]
            continue
        expected = t_interval([np.mean(latency) / 1e9 for latency, _, _ in runs]
                              ).within(0.0, np.inf)
        wanted = {"latency_s": expected.mean, "n": len(runs)}
        if expected.low is not None:
            wanted["latency_low_s"] = expected.low
        wanted |= {column: np.mean([parts.get(part, 0) / len(latency) / 1e9
                                    for latency, parts, _ in runs])
                   for part, column in PARTS.items() if column in row}
        if any(float(row[column]) != pytest.approx(value, rel=1e-9, abs=1e-15)
               for column, value in wanted.items()):
            wrong.append(row)
    return wrong


def test_the_table_has_the_numbers_of_the_ledgers(kept, by_hand):
    page = write(*kept).read_text()
    assert not disagreements(kept[0], by_hand)
    assert 'id="latency"' in page and "latency_parts" in page
    rows = [row for row in rows_of(kept[0], "latency_by_topic") if row["latency_s"]]
    assert rows and max(float(row["senders_queue_s"]) for row in rows) > 0.01
    for row in rows:  # the parts are the whole
        parts = sum(float(row[name]) for name in row if name in PARTS.values())
        assert parts == pytest.approx(float(row["latency_s"]), rel=1e-9)


def test_a_shifted_part_is_noticed(kept, by_hand, monkeypatch):
    """The twin: a part is a twentieth longer."""
    def shifted(found):
        for one in found.values():
            if "airtime" in one["times_ns"]:
                one["times_ns"]["airtime"] += one["times_ns"]["airtime"] // 20
        return from_json(found)

    monkeypatch.setattr("desim.report.campaign.numbers.latencies.from_json", shifted)
    write(*kept)
    assert disagreements(kept[0], by_hand)


def test_losses_by_reason_and_place(kept, by_hand):
    write(*kept)
    rows = rows_of(kept[0], "losses_by_topic")
    found = {(int(row["vector"]), row["topic"], row["reason"], row["place"]):
             float(row["messages"]) for row in rows}
    wanted = {}
    for (vector, topic), runs in by_hand.items():
        for _, _, lost in runs:
            for where, count in lost.items():
                key = vector, topic, *where
                wanted[key] = wanted.get(key, 0.0) + count / 2
    assert found == wanted and found
    assert all(0.0 < float(row["share"]) <= 1.0 for row in rows)


@pytest.fixture(scope="module")
def busy(tmp_path_factory, repository):
    """The same with computers that are too slow, and its design."""
    return swept(tmp_path_factory.mktemp("busy"), repository, "true",
                 "computers: measured, robot.computer.speed: 0.1,")


def ages_by_hand(folder, design):
    """From ``ledger.parquet``: of each vector and topic the median and the 95th percentile of each
    step, s, sorted and picked by hand, as means over the runs."""
    found, study = {}, Study(folder, design)
    for vector in study.vectors:
        for row in vector.rows:
            times = {}
            ledger = pq.read_table(study.run_folders[study.text("run_id")[row]] / LEDGER)
            for message in ledger.to_pylist():
                if message["latency_ns"] is not None and message["computing_ns"] is not None:
                    topic = re.sub(r"robot_\d|workstation", "*", message["topic"])
                    times.setdefault((vector.number, topic), []).append((
                        message["node_queue_ns"] + message["run_queue_ns"],
                        message["computing_ns"], message["latency_ns"]))
            for key, messages in times.items():
                steps = [sorted(step) for step in zip(*messages, strict=True)]
                found.setdefault(key, []).append([between(step, share) / 1e9 for step in steps
                                                  for share in (0.5, 0.95)])
    return {key: np.mean(runs, axis=0) for key, runs in found.items()}


def between(ordered, share):
    """The value at a share of the way from the first to the last one."""
    whole, part = divmod(share * (len(ordered) - 1), 1)
    low, high = ordered[int(whole)], ordered[min(int(whole) + 1, len(ordered) - 1)]
    return low + part * (high - low)


STEPS = [f"{step}_{of}_s" for step in ("waited", "computed", "on_the_way")
         for of in ("median", "p95")]


def ages_that_disagree(folder, design, rows):
    wanted = ages_by_hand(folder, design)
    assert {(int(row["vector"]), row["topic"]) for row in rows} == set(wanted)
    return [row for row in rows if not np.allclose(
        [float(row[step]) for step in STEPS], wanted[int(row["vector"]), row["topic"]],
        rtol=1e-9, atol=1e-9)]


def test_the_table_has_the_ages_of_the_ledgers(busy):
    text = write(*busy).read_text()
    assert "Before the birth, and on the way" in text
    assert all(f">{step}, median<" in text for step in ("waited", "computed", "on the way"))
    rows = rows_of(busy[0], "age_by_topic")
    assert not ages_that_disagree(*busy, rows)
    assert {"/*/cmd_vel"} < {row["topic"] for row in rows}
    assert all(float(row["computed_median_s"]) > 0.0 for row in rows)
    assert max(float(row["waited_p95_s"]) for row in rows) > 1e-3


def test_a_computation_that_is_counted_as_waiting_is_noticed(busy, monkeypatch):
    """The twin."""
    monkeypatch.setattr("desim.report.campaign.numbers.latencies.from_json", lambda found: {
        name: replace(one, ages=one.ages and one.ages._replace(waited=one.ages.computed))
        for name, one in from_json(found).items()})
    study = Study(*busy)
    table = age_table(study, by_topic_and_vector(study, Estimates(study)))
    assert ages_that_disagree(*busy, [dict(zip(table.exact_head, row, strict=True))
                                      for row in table.exact_rows])


def test_ideal_computers_have_no_ages(kept):
    study = Study(*kept)
    assert age_table(study, by_topic_and_vector(study, Estimates(study))) is None


def test_sums_without_ages_are_read(busy):
    """Those of runs that are older than ages."""
    folder = next(iter(Study(*busy).run_folders.values()))
    sums = json.loads(Run(folder).file(LEDGER_TOPICS).read_text())
    removed = [one.pop("ages") for one in sums.values()]
    assert any(removed) and not any(one.ages for one in from_json(sums).values())


def test_without_ledgers_the_report_has_nothing_of_it(tmp_path, repository, kept):
    folder, design = swept(tmp_path, repository, "false")
    page = write(folder, design).read_text()
    assert "messages' time" not in page and "latency_parts" not in page
    assert not list((folder / "report").glob("*/latency*"))
    digests = [Study(*one).text("digest").tolist() for one in (kept, (folder, design))]
    assert digests[0] == digests[1]


def test_runs_without_a_ledger_are_left_out(kept, tmp_path):
    study = Study(*kept)
    vector = study.vectors[0]
    study.run_folders.pop(study.text("run_id")[vector.rows[0]])
    found = by_topic_and_vector(study, Estimates(study))
    assert {one.runs for one in found if one.vector is vector} == {1}
    assert {one.runs for one in found if one.vector is not vector} == {2}


@pytest.mark.parametrize("campaign", ["kept", "busy"])
def test_a_run_keeps_the_sum_of_its_ledger(campaign, request):
    study = Study(*request.getfixturevalue(campaign))
    for folder in study.run_folders.values():
        ledger = Run(folder).ledger
        summed = by_topic(ledger, hosts_of(ledger))
        kept_sums = json.loads(Run(folder).file(LEDGER_TOPICS).read_text())
        assert as_json(summed) == kept_sums and from_json(kept_sums) == summed


def test_why_has_the_same_by_topic(kept):
    folder = next(iter(Study(*kept).run_folders.values()))
    ledger = Run(folder).ledger
    found = breakdown(ledger, Query())
    assert found.by_topic == by_topic(ledger, hosts_of(ledger))
    assert sum(one.delivered for one in found.by_topic.values()) == found.delivered
    assert sum(one.dropped for one in found.by_topic.values()) == found.dropped
    outcome = CliRunner().invoke(app, ["why", str(folder)])
    assert "by topic: delivered, dropped, mean latency, and the shares of its parts" \
        in outcome.output
    data = json.loads(CliRunner().invoke(app, ["why", str(folder), "--json"]).output)
    assert data["by_topic"] == as_json(found.by_topic)


def test_an_empty_ledger_has_no_topics(kept):
    folder = next(iter(Study(*kept).run_folders.values()))
    assert by_topic(Run(folder).ledger.slice(0, 0), ()) == {}


def test_places_of_numbered_hosts_are_one():
    assert without_numbers("lan at robot_12") == "lan at robot_*"
    assert without_numbers("lan at workstation") == "lan at workstation"


def test_the_caption_says_what_is_left_out(kept):
    study = Study(*kept)
    found = by_topic_and_vector(study, Estimates(study))
    slowest = max(found, key=lambda one: one.latency.mean)
    many = [slowest._replace(topic=f"/t{i}") for i in range(14)]
    assert latency_figure(study, found)[1] == \
        "Drawn: 5 of 6 topics, the slowest; the table has all. "
    assert latency_figure(study, many)[1] == \
        "Drawn: 12 of 14 topics, the slowest; the table has all. "

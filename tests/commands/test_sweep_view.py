"""A campaign on a terminal: what is printed of its runs, its cost, its damage and its failures."""

from io import StringIO
from pathlib import Path
from types import SimpleNamespace

import pytest

from desim.campaign.running.prediction import Cost, Forecast
from desim.commands.views import sweep as view
from desim.commands.views.terminal import Terminal


def terminal(**more):
    return Terminal(file=StringIO(), width=120, highlight=False, soft_wrap=True, markup=False,
                    emoji=False, **more)


def lines(on):
    return on.file.getvalue().splitlines()


class Agenda:
    """``done`` runs of ``total``; ``rows``: the causes of those that failed, by their numbers."""

    def __init__(self, done=0, total=0, **failed):
        self.rows = {run_id: {"run_id": run_id, "status": "failed", "error": error}
                     for run_id, error in failed.items()}
        self.progress = done, len(failed), total

    def __contains__(self, run_id):
        return run_id != "old"


def swept(agenda, **wrong):
    """A campaign in ``out``, of which the index and some runs may be ``wrong``."""
    index = SimpleNamespace(damaged=wrong.get("damaged", 0), cut_off=wrong.get("cut_off", False))
    return SimpleNamespace(
        agenda=agenda, out=Path("out"), index=index, index_was_lost=wrong.get("lost", False),
        damaged_runs=wrong.get("runs", {}), others=wrong.get("others", 0), plan=None, metrics=None)


@pytest.fixture(autouse=True)
def warned(monkeypatch):
    """The warnings of a campaign, which are none."""
    found = []
    monkeypatch.setattr(view, "warnings_of", lambda *_: found)
    return found


def ended(agenda, **wrong):
    """The lines of a campaign of which nothing is left to do."""
    on = terminal()
    with view.SweepView(on, swept(agenda, **wrong), "2 at a time"):
        pass
    return lines(on)


def test_each_run_has_a_line():
    on, agenda = terminal(), Agenda(1, 2, r1="boom")
    levels = {"robots": SimpleNamespace(label="1"), "beams": SimpleNamespace(label="[x]")}
    agenda.runs = [(SimpleNamespace(levels=levels), 0, "r1"),
                   (SimpleNamespace(levels={}), 1, "r22")]
    view.show_runs(on, agenda)
    assert lines(on) == ["r1  failed    robots=1, beams=[x], iteration 0",
                         "r22  to run    , iteration 1", "2 runs, 1 done, 1 of them failed"]


@pytest.mark.parametrize(("expected", "costs", "by_probes", "jobs", "said"), [
    (None, [], True, 2, "no prediction: every probe has failed"),
    (Forecast(5400.0, 10800.0), [Cost(1, 10, True), Cost(2.25, 10, False, 0, 50.0)], True, 4,
     "1.5 h of CPU are to be expected (from 2 probes of 3.2 s, 1 of them to the end); 22 min with "
     "4 jobs on cores of their own, at most 45 min, every run to its time limit"),
    (Forecast(89.4, 90.0), [Cost(1, 10, True)] * 3, False, 1,
     "89 s of CPU are to be expected (from 3 finished runs); 89 s with 1 jobs on cores of their "
     "own, at most 2 min, every run to its time limit")])
def test_a_prediction(expected, costs, by_probes, jobs, said):
    on = terminal()
    view.show_prediction(on, expected, costs, by_probes, jobs)
    assert lines(on) == [said]


def test_times_are_in_seconds_minutes_or_hours():
    assert [view._duration(seconds) for seconds in (0, 89.4, 90, 5399, 5400, 7200)] == [
        "0 s", "89 s", "2 min", "90 min", "1.5 h", "2.0 h"]


def test_a_campaign_in_which_all_went_well():
    assert ended(Agenda(4, 4)) == ["4 runs, 4 done already; 2 at a time, in out",
                                   "4 of 4 runs; table: out/runs.parquet"]


def test_warnings_come_at_the_end(warned):
    warned.append("no run has a value of x")
    assert ended(Agenda(4, 4))[2:] == ["no run has a value of x"]


def test_what_was_wrong_with_the_folder():
    assert ended(Agenda(2, 4), damaged=3, cut_off=True, lost=True, others=5,
                 runs={"a": "a: damaged", "b": "b: damaged"})[:-2] == [
        "out/index.jsonl: 3 lines could not be read; it was made again from the folders of the "
        "runs",
        "out/index.jsonl: its last line was cut off, and was taken away",
        "out/index.jsonl: was not there; it was made again from the folders of the runs",
        "a: damaged", "b: damaged", "2 runs are damaged; what is missing is made again",
        "out: 5 runs of an earlier design, another scenario or another version of desim; they "
        "stay, but are not in the table"]
    assert "1 run is damaged; what is missing is made again" in ended(Agenda(), runs={"a": "a"})


def test_of_many_damaged_runs_ten_are_named():
    said = ended(Agenda(), runs={str(i): f"{i}: damaged" for i in range(12)})
    assert said[9:11] == ["9: damaged", "12 runs are damaged; what is missing is made again"]


def test_causes_are_counted_and_the_most_frequent_is_first():
    assert ended(Agenda(3, 4, a="bang", b="boom", c="boom", old="boom"))[1:] == [
        "3 of 4 runs, 4 failed; table: out/runs.parquet", "2 runs failed (b, ...): boom",
        "1 run failed (a): bang", "--retry-failed runs them again"]


@pytest.mark.parametrize(("causes", "end"), [
    (10, ["1 run failed (r9): 9", "--retry-failed runs them again"]),
    (12, ["1 run failed (r9): 9", "and 2 more causes", "--retry-failed runs them again"])])
def test_of_many_causes_ten_are_a_screen(causes, end):
    said = ended(Agenda(12, 12, **{f"r{i}": str(i) for i in range(causes)}))
    assert said[-len(end):] == end


@pytest.fixture
def clock(monkeypatch):
    """The monotonic clock, in a list."""
    now = [100.0]
    monkeypatch.setattr(view.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(view.TimeLeft, "after", lambda self, row: row.get("left_s"))
    return now


FINISHED = {"run_id": "r", "status": "finished"}


def test_where_there_is_no_terminal_a_line_comes_every_ten_seconds(clock):
    on = terminal()
    shown = view.SweepView(on, swept(Agenda(1, 4)), "2 at a time")
    for clock[0], left_s in ((109.9, 5.0), (110.0, None), (119.9, 7.0), (120.0, 30.0)):
        shown.run_ended({**FINISHED, "left_s": left_s})
    assert lines(on)[1:] == ["1 of 4 runs; ? to go", "1 of 4 runs; 30 s to go"]


def test_an_error_is_shown_when_it_is_new_and_a_finished_run_has_none(clock):
    on = terminal()
    shown = view.SweepView(on, swept(Agenda(1, 4)), "2 at a time")
    for run_id, error in (("a", "boom (robot_1, 2 s)"), ("b", "boom (robot_2, 3 s)"),
                          ("c", "bang")):
        shown.run_ended({"run_id": run_id, "status": "failed", "error": error})
    shown.run_ended(FINISHED)
    shown.slow("d", 61.6)
    assert lines(on)[1:] == [
        "a failed: boom (robot_1, 2 s)", "c failed: bang",
        "d has been at it for 62 s; limits: {wall: ...} of the design would end it"]


def test_the_number_of_workers():
    on = terminal()
    shown = view.SweepView(on, swept(Agenda(1, 4)), "by Dask")
    for count in (0, 1, 2):
        shown.workers_up(count)
    assert lines(on)[1:] == ["0 workers up", "1 worker up", "2 workers up"]


def test_on_a_terminal_a_bar_shows_the_same(clock):
    on = terminal(force_terminal=True, color_system=None)
    shown = view.SweepView(on, swept(Agenda(2, 4, a="boom")), "by Dask")
    shown.workers_up(3)
    clock[0] += 60
    shown.run_ended({**FINISHED, "left_s": 30.0})
    assert len(lines(on)) == 1, "nothing but the bar"
    task, = shown._progress.tasks
    assert (task.description, task.completed, task.total, task.fields) == (
        "runs, 3 workers up", 2, 4, {"failed": ", 1 failed", "to_go": "30 s"})


def test_who_is_stopped_gets_no_outcome():
    on = terminal()
    with pytest.raises(KeyboardInterrupt), view.SweepView(on, swept(Agenda(1, 4)), "here"):
        raise KeyboardInterrupt
    assert lines(on) == ["4 runs, 1 done already; here, in out"]


def test_a_quiet_console_prints_nothing_and_labels_are_text(capsys):
    view.console(quiet=True).print("x")
    view.console(quiet=False).print("[red]a :smile: 1.5", "b" * 300)
    assert capsys.readouterr().out == f"[red]a :smile: 1.5 {'b' * 300}\n"

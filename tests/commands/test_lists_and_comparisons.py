"""``desim ls`` and ``desim compare``: tables to the letter, on terminals of several widths."""

import time
from io import StringIO
from pathlib import Path
from types import SimpleNamespace

import pytest

from desim.campaign.folder.comparison import ComparedCampaigns, VectorPair
from desim.campaign.folder.results_list import ListedResult
from desim.commands.views import comparison, results_list
from desim.commands.views.terminal import Terminal
from desim.results.comparison import ComparedRuns, KeyDifference, MetricPair, Parting


@pytest.fixture
def shown(monkeypatch):
    """The lines that a view prints."""
    monkeypatch.setenv("TZ", "UTC")
    time.tzset()

    def lines(view, *what, **terminal):
        out = Terminal(file=StringIO(), highlight=False, markup=False, color_system=None,
                       **terminal)
        monkeypatch.setattr(view, "Terminal", lambda **_: out)
        view.show(*what)
        return [line.rstrip() for line in out.file.getvalue().splitlines()]

    yield lines
    monkeypatch.undo()
    time.tzset()


ONE = ListedResult(Path("results/maze/r1"), "finished", 1e9, 4600, "maze", "r1", 7, 100.0, None,
                   "abcdef0123456")
LISTED = [
    ONE, ListedResult(Path("results/maze/r2"), "interrupted", 1e9 + 61, 512, "maze", "r2", None,
                      3.25, 2.5, None),
    ListedResult(Path("results/big"), "campaign", 1e9 + 3600, 12_000_000_000, note="4 runs"),
    ListedResult(Path("results/x/r3"), "damaged", 1e9, 12_000_000, "x", "r3")]


def test_where_there_is_no_terminal_a_list_has_all_columns(shown):
    assert shown(results_list, Path("results"), LISTED, width=20) == [
        "name  id  seed  status       when              simulated  explored in  digest       size",
        "maze  r1     7  finished     2001-09-09 01:46    100.0 s            -  abcdef01   4.6 kB",
        "maze  r2        interrupted  2001-09-09 01:47      3.2 s        2.5 s              512 B",
        "big             campaign     2001-09-09 02:46                                    12.0 GB  "
        "4 runs",
        "x     r3        damaged      2001-09-09 01:46                                    12.0 MB"]


def test_without_a_note_there_is_no_column_for_one_and_without_results_a_line(shown):
    assert shown(results_list, Path("results"), [ONE]) == [
        "name  id  seed  status    when              simulated  explored in  digest      size",
        "maze  r1     7  finished  2001-09-09 01:46    100.0 s            -  abcdef01  4.6 kB"]
    assert shown(results_list, Path("results"), []) == ["results: no run and no campaign in it"]


@pytest.mark.parametrize(("columns", "head"), [
    (100, "name  id  seed  status       when              simulated  explored in  digest       "
          "size"),
    (80, "name  id  seed  status       when              simulated  explored in     size"),
    (70, "name  id  seed  status       simulated  explored in"),
    (50, "name  id  seed  status       explored in"), (40, "name  id  status"),
    (20, "name  id  status")])
def test_a_terminal_has_the_columns_for_which_there_is_room(shown, columns, head):
    assert shown(results_list, Path("results"), LISTED, width=columns, force_terminal=True)[0] == (
        head)


@pytest.mark.parametrize(("size_bytes", "said"), [
    (0, "0 B"), (999, "999 B"), (1000, "1.0 kB"), (999_949, "999.9 kB"), (1_000_000, "1.0 MB"),
    (4_560_000_000, "4.6 GB")])
def test_sizes_have_their_unit(size_bytes, said):
    assert results_list.size(size_bytes) == said


def run(name, **more):
    files = more.pop("files", {"summary.json"})
    return SimpleNamespace(path=Path(name), has=files.__contains__,
                           manifest={"digest": name, "error": "boom", **more})


def runs(first=None, second=None, **more):
    """Two runs side by side."""
    found = ComparedRuns(first or run("a"), second or run("b"))
    vars(found).update({
        "keys": [KeyDifference("fleet.size", 2, None), KeyDifference("name", "a", [1, "x"])],
        "metrics": [
            MetricPair("explored", 0.5, 0.25), MetricPair("messages", 10, 12),
            MetricPair("same", 1, 1), MetricPair("word", "a", "b"), MetricPair("zero", 0, 3),
            MetricPair("none", None, 2.0)],
        "parted": Parting(2.5, "robot_1", 0.12345), "robots": ({"r"}, {"r"}), **more})
    return found


def test_two_runs(shown):
    assert shown(comparison, runs(), width=30) == [
        "first   a", "second  b", "",
        "key         first  second",
        "fleet.size  2      -",
        'name        a      [1, "x"]', "",
        "metric    first  second  difference      %",
        "explored    0.5    0.25       -0.25  -50.0",
        "messages     10      12          +2  +20.0",
        "word          a       b",
        "zero          0       3          +3",
        "none          -       2", "",
        "1 metrics are equal; at 2.5 s robot_1 is the first to be elsewhere, by 0.123 m",
        "on one time line: desim view a b",
        "the first trace row that differs: desim diff a b"]


def test_on_a_narrow_terminal_rows_are_paragraphs(shown):
    assert shown(comparison, runs(), width=60, force_terminal=True)[2:16] == [
        "", "fleet.size", "  first 2, second -", "", "name", '  first a, second [1, "x"]', "",
        "explored", "  first 0.5, second 0.25, difference -0.25, % -50.0", "", "messages",
        "  first 10, second 12, difference +2, % +20.0", "", "word"]


def test_runs_that_do_not_part(shown):
    same = runs(second=run("b", digest="a"), keys=[], metrics=[])
    assert shown(comparison, same) == [
        "first   a", "second  b", "", "no key differs", "",
        "0 metrics are equal; the digests, too: everything that happened is the same"]
    assert shown(comparison, runs(keys=[], metrics=[], parted=None))[-3:] == [
        "0 metrics are equal; every robot that both have is at the same places",
        "on one time line: desim view a b", "the first trace row that differs: desim diff a b"]
    turned = runs(keys=[], metrics=[], parted=Parting(3.0, "robot_0", 0.0))
    assert "; at 3 s robot_0 is the first to be turned otherwise" in shown(comparison, turned)[-3]


@pytest.mark.parametrize(("robots", "said"), [
    ((set(), set()), "neither has robots"), (({"r"}, set()), "only one of them has robots"),
    (({"drive"}, {"robot_0"}), "no robot has the same name in both")])
def test_runs_that_have_no_robot_in_common(shown, robots, said):
    nobody = runs(keys=[], metrics=[], parted=None, robots=robots)
    assert shown(comparison, nobody)[-3] == f"0 metrics are equal; {said}"


def test_a_run_that_failed_has_its_error(shown):
    failed = runs(first=run("a", files=set()), keys=[], metrics=[])
    assert shown(comparison, failed)[-1] == "a failed: boom"


def campaigns(*pairs):
    found = object.__new__(ComparedCampaigns)
    found.first = found.second = SimpleNamespace(path=Path("c"))
    vars(found).update({"keys": [], "parameters": ("robots", "speed"), "reported": ("explored",),
                        "metrics": ("explored", "messages"), "pairs": lambda metric: pairs})
    return found


def test_two_campaigns(shown):
    pair = VectorPair({"robots": 2, "speed": "fast"}, MetricPair("explored", 0.5, None), (3, 0))
    assert shown(comparison, campaigns(pair)) == [
        "first   c", "second  c", "", "no key differs", "",
        "robots  speed  mean of   first  second  difference  %  runs",
        "2       fast   explored    0.5       -                 3, 0", "",
        "2 metrics in all: --json; intervals: desim report"]
    assert shown(comparison, campaigns())[-3:] == [
        "no vector is in both", "", "2 metrics in all: --json; intervals: desim report"]

"""Tables on a terminal of 40 columns: nothing that names a run or a number is cut."""

from __future__ import annotations

import shutil
from io import StringIO

import pytest

import desim
from desim.campaign.folder.results_list import listed
from desim.commands.views import comparison, results_list
from desim.commands.views.key_figures import result_table
from desim.commands.views.terminal import Terminal


@pytest.fixture(scope="module")
def runs(repository, tmp_path_factory):
    out = tmp_path_factory.mktemp("results")
    return [desim.run(repository / "scenarios" / "hello.yaml", out=out, overrides=(
        "stop.elapsed=4 s", f"fleet.size={size}")) for size in (1, 2)]


def terminal(monkeypatch, view, width):
    """A terminal of ``width`` columns, which ``view`` prints to."""
    console = Terminal(file=StringIO(), width=width, force_terminal=True, color_system=None,
                       highlight=False, markup=False)
    monkeypatch.setattr(view, "Terminal", lambda **_: console)
    return console


def lines(console):
    return [line.rstrip() for line in console.file.getvalue().splitlines()]


@pytest.mark.parametrize(("width", "is_terminal", "is_narrow"), [
    (63, True, True), (64, True, False), (63, False, False)])
def test_a_terminal_below_64_columns_is_narrow_and_a_file_never_is(width, is_terminal, is_narrow):
    console = Terminal(file=StringIO(), width=width, force_terminal=is_terminal)
    assert console.is_narrow is is_narrow


@pytest.mark.parametrize("width", [40, 60, 120])
def test_a_list_names_its_runs(runs, monkeypatch, width):
    console = terminal(monkeypatch, results_list, width)
    results_list.show(runs[0].path.parents[1], listed(runs[0].path.parents[1]))
    assert max(map(len, lines(console))) <= width and "…" not in console.file.getvalue()
    for run, line in zip(reversed(runs), lines(console)[1:], strict=True):
        assert line.split()[:2] == ["hello", run.path.name] and "finished" in line
    assert ("digest" in lines(console)[0]) == (width == 120)


def test_beside_a_note_ids_are_whole_on_40_columns(runs, monkeypatch, tmp_path):
    folder = shutil.copytree(runs[0].path.parent, tmp_path / "a_long_name_of_a_scenario")
    (folder / runs[0].path.name / "summary.json").unlink()
    console = terminal(monkeypatch, results_list, 40)
    results_list.show(tmp_path, listed(tmp_path))
    text = console.file.getvalue()
    assert "damaged" in text and all(run.path.name in text for run in runs) and "…" not in text


def test_numbers_are_whole(runs, monkeypatch):
    wide, narrow = (terminal(monkeypatch, comparison, width) for width in (200, 40))
    for console in wide, narrow:
        monkeypatch.setattr(comparison, "Terminal", lambda console=console, **_: console)
        comparison.show(desim.compare(*runs))
    table = [line.split() for line in lines(wide)]
    (row,) = (line for line in table if line[:1] == ["bytes_on_air"])
    text = " ".join(" ".join(lines(narrow)).split())
    assert (f"bytes_on_air first {row[1]}, second {row[2]}, difference {row[3]}, % {row[4]}"
            in text)


@pytest.mark.parametrize("width", [40, 120])
def test_key_figures_are_whole(runs, width):
    console = Terminal(file=StringIO(), width=width, force_terminal=True, color_system=None)
    assert console.is_narrow == (width == 40)
    console.print(result_table(runs[1].metrics, runs[1].manifest, console.is_narrow))
    assert max(map(len, lines(console))) <= width and "…" not in console.file.getvalue()
    assert all(lines(console)), "no line is empty"
    text = " ".join(" ".join(lines(console)).split())
    assert "of the union > 4.0 s 99 % known to some robot" in text

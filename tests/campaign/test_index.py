"""The index is a copy of what the folders say, whatever happens to it."""

import json
import os
from types import SimpleNamespace

import pytest
from designs import row

from desim.campaign.folder.index import Index, line_of, read
from desim.errors import InputError


@pytest.fixture
def path(tmp_path):
    index = Index(tmp_path / "index.jsonl")
    for run_id in ("a", "b", "c"):
        index.add(row(run_id, explored=0.5))
    index.close()
    return tmp_path / "index.jsonl"


def same(run_id):
    return f"folder of {run_id}"


def folders(present, again, likeness=same, functions=()):
    """Folders of runs that nobody made: the row of each is what ``again`` gives."""
    return SimpleNamespace(present=lambda: present, likeness=likeness, row=again,
                           functions=functions)


def opened(path):
    index = Index(path)
    index.close()
    return index


def test_a_line_that_was_cut_off_is_taken_away_and_said(path):
    whole = path.read_bytes()
    path.write_bytes(whole + whole[:20])
    assert opened(path).cut_off and path.read_bytes() == whole
    assert not opened(path).cut_off


def test_a_line_without_end_is_not_read(path):
    with path.open("ab") as file:
        file.truncate(10**10)
    with pytest.raises(OSError, match="a line of more than 10 MB"):
        read(path)


def test_what_is_added_is_there_again(path):
    assert opened(path).rows == {run_id: row(run_id, explored=0.5) for run_id in "abc"}
    assert opened(path).damaged == 0


def test_the_last_line_of_a_run_holds(path):
    index = Index(path)
    index.add(row("b", explored=0.75))
    assert index.rows["b"]["metrics"] == opened(path).rows["b"]["metrics"] == {"explored": 0.75}


@pytest.mark.parametrize("kept", range(1, 120, 17))
def test_a_last_line_that_was_cut_off_is_taken_away(path, kept):
    whole = path.read_bytes()
    line = line_of(row("d"))[:-1]
    path.write_bytes(whole + line[:kept])
    index = opened(path)
    assert sorted(index.rows) == ["a", "b", "c"] and not index.damaged
    assert path.read_bytes() == whole


DAMAGE = {
    "no JSON": b"#\x00\xff",
    "half a line with the next one behind it": b'{"run_id": "x", "stat{"run_id"',
    "another thing": b"[1, 2]",
    "a row without a result": b'{"run_id": "x", "status": "finished"}',
    "a row of what cannot be": b'{"run_id": "x", "status": "lost", "error": ""}',
    "nested without end": b"[" * 100_000,
    "an empty line": b"",
    "a digit that was not written": line_of(row("b", explored=0.5)).replace(b"0.5", b"0.7")[:-1],
    "a line without its checksum": json.dumps(row("b", explored=0.5)).encode(),
}


@pytest.mark.parametrize("line", DAMAGE.values(), ids=DAMAGE)
def test_damaged_lines_are_left_out_and_the_file_is_made_again(path, line):
    first, second, third, _ = path.read_bytes().split(b"\n")
    path.write_bytes(b"\n".join([first, line, third, b""]))
    index = Index(path)
    assert index.damaged == 1
    index.recover(folders("abc", lambda run_id: row(run_id, explored=0.5)))
    index.add(row("d"))
    index.close()
    assert path.read_bytes() == b"\n".join([first, third, second, b""]) + line_of(
        row("d"))
    assert sorted(os.listdir(path.parent)) == ["index.jsonl"]


def test_it_follows_the_folders(path):
    """``a`` is gone, ``d`` is new, ``e`` is there but cannot be read, ``f`` failed before it had a
    folder, ``g`` was made again but nobody had noted it."""
    index = Index(path)
    for run_id in "fg":
        index.add({"run_id": run_id, "status": "failed", "error": "boom"})

    def again(run_id):
        if run_id == "e":
            raise InputError("e: damaged")
        return row(run_id, explored=0.5)

    assert index.recover(folders("bcdeg", again)) == {"e": "e: damaged"}
    assert sorted(index.rows) == ["b", "c", "d", "f", "g"]
    assert index.rows["g"]["status"] == "finished"
    assert sorted(opened(path).rows) == ["a", "b", "c", "d", "f", "g"]  # of a: the folder decides


def test_a_metric_that_is_new_is_looked_up_in_the_folders(path):
    index = Index(path)
    asked = []

    def again(run_id):
        asked.append(run_id)
        return {**row(run_id), "functions": {"mine:f": 7.0}}

    for _ in range(2):
        index.recover(folders("abc", again, functions=("mine:f",)))
    assert asked == ["a", "b", "c"]
    assert {found["functions"]["mine:f"] for found in index.rows.values()} == {7.0}


def test_a_metric_that_raised_is_looked_up_again(path):
    index = Index(path)
    index.add({**row("a"), "functions": {"f": None}, "raised": {"f": "ValueError: boom"}})
    index.recover(folders("a", lambda run_id: {**row(run_id), "functions": {"f": 1.0}},
                          functions=("f",)))
    assert index.rows["a"]["functions"] == {"f": 1.0} and "raised" not in index.rows["a"]


def test_a_folder_that_has_changed_is_read_again(path):
    """``b`` is read and says something else, ``c`` cannot be read."""
    index = Index(path)

    def again(run_id):
        if run_id == "c":
            raise InputError("c: damaged: summary.json is missing")
        return {**row(run_id, explored=0.75), "folder": "another"}

    wrong = index.recover(folders(
        "abc", again, lambda run_id: same(run_id) if run_id == "a" else "another"))
    assert wrong == {"c": "c: damaged: summary.json is missing"}
    assert [(run_id, found["metrics"]["explored"]) for run_id, found in index.rows.items()] == [
        ("a", 0.5), ("b", 0.75)]


def test_a_disk_that_is_full_leaves_no_half_line(path, monkeypatch):
    whole = path.read_bytes()
    index = Index(path)

    class Full:
        """A file on a disk with room for ten more bytes."""

        def __init__(self, file):
            self.file = file

        def __getattr__(self, name):
            return getattr(self.file, name)

        def write(self, line):
            return self.file.write(line[:10])

    monkeypatch.setattr(index, "_file", Full(index._file))
    with pytest.raises(OSError, match="cut off"):
        index.add(row("d"))
    assert path.read_bytes() == whole
    assert "d" not in index.rows


def test_no_file_is_no_rows(tmp_path):
    assert read(tmp_path / "index.jsonl") == ({}, 0, 0)

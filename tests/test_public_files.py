"""The log of public files is repeated: what is found again, what has changed, what is not there."""

import csv

import public_files
import pytest

MAP = "type octile\nheight 2\nwidth 3\nmap\n...\n.@.\n"
COLUMNS = ("repository", "path", "commit", "format", "command", "first", "now", "mend", "found")


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "me+maps" / "far").mkdir(parents=True)
    (tmp_path / "me+maps" / "far" / "a.map").write_text(MAP)
    (tmp_path / "me+maps" / "numpy.py").write_text("raise SystemExit(9)\n")  # is not imported
    (tmp_path / "me+maps" / "base.yaml").write_text("footprint: [3]\nrobot_radius: 0.25\n")
    (tmp_path / "me+maps" / "pose.txt").write_text("0 1 2 0 0 0 0 1\n1.5 1 3 0 0 0 0 1\n")
    return tmp_path


def table(folder, *rows):
    """A table of ``rows``: a file, a command and what was found."""
    path = folder / "files.csv"
    with path.open("w", newline="") as file:
        csv.writer(file).writerows([COLUMNS, *(
            ("me/maps", name, "newest", "any", command, "right", "right", "", found)
            for name, command, found in rows)])
    return path


def test_what_is_found_is_compared_and_kept(folder, capsys):
    path = table(
        folder, ("far/a.map", "map far/a.map --resolution 2", "6 x 4 m, 20 m2 free"),
        ("pose.txt", "import pose.txt", "1 robot, 9 s, 2 poses each"),
        ("base.yaml", "robot base.yaml", ""), ("none.map", "map none.map", "1 x 1 m"))
    assert public_files.main([str(folder), "--table", str(path), "--write"]) == 1
    assert capsys.readouterr().out.splitlines() == [
        "me/maps: desim map far/a.map --resolution 2", "  was  6 x 4 m, 20 m2 free",
        "  now  10 x 8 m, 20 m2 free",
        "me/maps: desim import pose.txt", "  was  1 robot, 9 s, 2 poses each",
        "  now  1 robot, 1.5 s, 2 poses each",
        "me/maps: desim robot base.yaml", "  was  ",
        "  now  exit code 2: base.yaml:1:1: footprint: must be a list of at least 3 corners, e.g. "
        "[[0.2, 0.2], [0.2, -0.2], [-0.2, 0]], got [3]",
        "4 rows, 3 changed, 1 without a file"]
    assert public_files.main([str(folder), "--table", str(path)]) == 0
    assert capsys.readouterr().out == "4 rows, 0 changed, 1 without a file\n"


def test_a_robot_in_a_few_words():
    """Its body, its speeds and its lasers; else the keys that are read."""
    known = {"footprint": [["-0.5 m", "0.2 m"], ["0.25 m", "-0.2 m"], ["0 m", "0.2 m"]],
             "max_speed": "0.26001 m/s", "robot.lasers.top.max_range": "8 m",
             "robot.lasers.top.height": "0.2 m", "robot.lasers.low.height": "0.1 m"}
    assert public_files.of_robot({"read": {key: (value, "") for key, value in known.items()}}) == (
        "0.75 x 0.4 m, max_speed 0.26 m/s, low, top 8 m")
    assert public_files.of_robot({"read": {"robot.exploration.rate": ("1 Hz", "")}}) == (
        "robot.exploration.rate")


def test_the_table_names_its_outcomes():
    with public_files.TABLE.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0]) == COLUMNS and len(rows) >= 40
    assert {row[key] for row in rows for key in ("first", "now")} <= {
        "right", "refused", "wrong", "silent"}
    assert all(row["mend"] for row in rows if row["first"] != row["now"])

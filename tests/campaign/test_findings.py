"""The campaign of the paper's findings, and its tables."""

import importlib

import pytest


@pytest.fixture
def vectors(monkeypatch, repository):
    monkeypatch.syspath_prepend(str(repository / "scenarios" / "paper"))
    return importlib.import_module("findings_vectors")


def test_eight_robots_are_in_all_terrains_and_other_fleets_in_two(vectors):
    for made, sizes in ((vectors.vectors(), {1, 2, 4, 8, 11, 16, 30}),
                        (vectors.small(), {1, 2, 4, 8, 11, 16})):
        there = {(one["robots"], one["terrain"]) for one in made}
        assert len(made) == 2 * len(there)  # with both maps
        assert there == {(size, terrain) for size in sizes for terrain in ("maze", "zigzag")} | {
            (8, "loop"), (8, "cross")}


def test_the_tables_have_the_terrains(vectors, tmp_path, capsys):
    table = importlib.import_module("findings_table")
    runs = [{**one, "seed": seed, "exploration_time_s": 100.0 * one["robots"] + seed,
             "simulated_s": 2000.0, "exploration_cost_m": 2000.0}
            for one in vectors.vectors([1, 8]) for seed in (1, 2, 3)]
    table.findings(runs, tmp_path)
    assert capsys.readouterr().out.splitlines() == [
        "| robots | maze, merged | maze, at once | zigzag, merged | zigzag, at once |",
        "|---|---|---|---|---|",
        "| 1 | " + " | ".join(["102 ± 2 (2.0 km)"] * 4) + " |",
        "| 8 | " + " | ".join(["802 ± 2 (2.0 km)"] * 4) + " |",
        "",
        "| terrain, 8 robots | merged | at_once |", "|---|---|---|",
        *(f"| {terrain} | 802 ± 2 (2.0 km) | 802 ± 2 (2.0 km) |"
          for terrain in ("maze", "zigzag", "loop", "cross"))]
    assert (tmp_path / "findings.png").exists()


def test_fleets_are_compared_with_eight_robots_and_zigzag_with_the_maze(vectors, capsys):
    table = importlib.import_module("findings_table")
    runs = [{**one, "seed": seed, "simulated_s": 2000.0, "exploration_time_s":
             (2 if one["robots"] == 2 else 1) * (3 if one["terrain"] == "zigzag" else 1)
             * (200.0 + 10 * seed)}
            for one in vectors.vectors([2, 8]) for seed in (1, 2, 3)]
    runs[0]["exploration_time_s"] = None  # two robots in the maze, seed 1: 2000 s
    table.comparisons(runs)
    found = [line for line in capsys.readouterr().out.splitlines() if line]
    titles = [line.split(" | ")[0] for line in found if line.startswith("| robots")]
    assert titles == [f"| robots, {terrain}, {own}, against 8" for terrain in ("maze", "zigzag")
                      for own in ("at_once", "merged")] + [
        f"| robots, {own}, zigzag against maze" for own in ("merged", "at_once")]
    two = [line for line in found if line.startswith("| 2 |")]
    assert sum("(1 late)" in line for line in two) == 1
    assert ["| 2.00 (2.00 to 2.00) |" in line for line in two] == [True, False, True, True,
                                                                 False, False]
    eight = [line for line in found if line.startswith("| 8 |")]
    assert ["| 3.00 (3.00 to 3.00) |" in line for line in eight] == 4 * [False] + 2 * [True]


def test_each_mechanism_is_compared_seed_by_seed_and_the_larger_fleet_with_the_smaller(
        vectors, capsys):
    table = importlib.import_module("findings_table")
    shares = {(8, "nothing"): 1.0, (8, "the_end"): 1.0, (16, "nothing"): 1.5, (16, "the_end"): 0.75}
    table.mechanisms([
        {"robots": robots, "without": without, "seed": seed, "simulated_s": 2000.0,
         "exploration_time_s": None if (robots, without, seed) == (8, "the_end", 3)
         else share * 400 + 10 * seed}
        for (robots, without), share in shares.items() for seed in (1, 2, 3)])
    assert capsys.readouterr().out.splitlines() == [
        "| without | 8 robots | p | 16 robots | p | 16 against 8 |",
        "|---|---|---|---|---|---|",
        "| nothing | 1 |  | 1 |  | 1.48 (1.45 to 1.50) |",
        "| the end | 1.67 (0.18 to 15.13) | 0.42 | 0.52 (0.50 to 0.54) | 0.00017 "
        "| 0.46 (0.05 to 4.07) |",
        "",
        "| 8 robots without | time, s | share of time | p (Holm) | faster |",
        "|---|---|---|---|---|",
        "| nothing | 420 ± 25 | 1 |  |  |",
        "| the end | 943 ± 2273 (1 late) | 1.67 (0.18 to 15.13) | 0.42 | 0 of 3 |",
        "",
        "| 16 robots without | time, s | share of time | p (Holm) | faster |",
        "|---|---|---|---|---|",
        "| nothing | 620 ± 25 | 1 |  |  |",
        "| the end | 320 ± 25 | 0.52 (0.50 to 0.54) | 0.00017 | 3 of 3 |",
        "",
        "| 16 robots against 8, without | time, s | share of time | p (Holm) | faster |",
        "|---|---|---|---|---|",
        "| nothing | 620 ± 25 | 1.48 (1.45 to 1.50) | 0.00026 | 0 of 3 |",
        "| the end | 320 ± 25 | 0.46 (0.05 to 4.07) | 0.26 | 3 of 3 |",
        "",
        "| what 16 robots take of the time of 8, without | time, % | share of time | p (Holm) "
        "| faster |",
        "|---|---|---|---|---|",
        "| nothing | 148 ± 3 | 1 |  |  |",
        "| the end | 56 ± 85 | 0.31 (0.04 to 2.71) | 0.15 | 3 of 3 |"]

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
        "| robots | maze, merged | maze, at_once | zigzag, merged | zigzag, at_once |",
        "|---|---|---|---|---|",
        "| 1 | " + " | ".join(["102 ± 2 (2.0 km)"] * 4) + " |",
        "| 8 | " + " | ".join(["802 ± 2 (2.0 km)"] * 4) + " |",
        "",
        "| terrain, 8 robots | merged | at_once |", "|---|---|---|",
        *(f"| {terrain} | 802 ± 2 (2.0 km) | 802 ± 2 (2.0 km) |"
          for terrain in ("maze", "zigzag", "loop", "cross"))]
    assert (tmp_path / "findings.png").exists()

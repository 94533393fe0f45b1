"""The map of a running fleet on a terminal."""

from __future__ import annotations

from io import StringIO

import numpy as np
import pytest
from rich.console import Console

from desim.commands.views.fleet_map import CharacterGrid, FleetMap
from desim.commands.views.progress import watching
from desim.ports import GridSpec
from desim.results.folder import RunFolder
from desim.scenario.load import load
from desim.simulation.simulation import Simulation

GRID = GridSpec(resolution_m=1.0, width=7, height=6, x_m=-1.0, y_m=-1.0)
HOUSE = [
    "▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒",
    "▒···●········▒      ▒",
    "▒●·●·········▒      ▒",
    "▒············▒      ▒",
    "▒·····▒······▒···   ▒",
    "▒·····▒·············▒",
    "▒·····▒ ············▒",
    "▒·····▒▒▒▒▒▒▒▒······▒",
    "▒·······      ······▒",
    "▒········      ·····▒",
    "▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒",
]


def test_a_character_is_twice_as_high_as_wide():
    raster = CharacterGrid(GRID, columns=4, rows=10)
    assert raster.shape == (2, 4)  # squares of 2 x 4 cells
    cells = np.zeros((6, 7), bool)
    cells[0, 6] = cells[5, 0] = True
    assert raster.any(cells).tolist() == [[True, False, False, False], [False, False, False, True]]


@pytest.mark.parametrize(("place_m", "square"), [
    ((-0.9, -0.9), (1, 0)), ((5.5, 4.9), (0, 3)), ((-9.0, 50.0), (0, 0))])
def test_places_have_squares(place_m, square):
    row, column = CharacterGrid(GRID, 4, 10).cells(np.array([place_m]))
    assert (int(row[0]), int(column[0])) == square


@pytest.fixture(scope="module")
def simulation(repository):
    simulation = Simulation(load(repository / "scenarios" / "hello.yaml").scenario)
    simulation.run(5_000_000_000)
    return simulation


def test_the_house_after_five_seconds(simulation):
    drawn = FleetMap(simulation.monitor, 22, 12).draw().plain
    assert drawn.splitlines() == HOUSE


def test_a_terminal_shows_it_below_the_figures(simulation, tmp_path):
    file = StringIO()
    console = Console(force_terminal=True, width=60, height=17, file=file)
    with watching(console)(simulation, RunFolder(tmp_path, simulation.scenario)):
        pass
    shown = file.getvalue()
    assert shown.index("simulated") < shown.index("network") < shown.index("▒▒▒▒▒")


def test_an_unexplored_place_is_blank(repository):
    simulation = Simulation(load(repository / "scenarios" / "hello.yaml").scenario)
    assert set(FleetMap(simulation.monitor, 40, 20).draw().plain) == {" ", "▒", "\n"}

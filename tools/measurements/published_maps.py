"""The maps that the paper's authors published beside ours, with the same error measure.

    python tools/measurements/published_maps.py [--to FILE] [--json]

Prints the error of four maps of each terrain: the authors' (yzrobot/mrs_testbed, of the reference
data) and ours of ``maze_8``, seed 1, with true poses, with odometry alone and with gmapping. With
--to it draws the authors' and that of gmapping. The measure is that of ``summary.json``, the
distance of each wall cell from the nearest true one, centre to centre (``wall_error_median_m``,
``wall_error_p95_m``).

The authors' map is in a frame of its own. It is laid on the terrain as well as a rigid motion can
(shift and turn, no scale): the one with the smallest mean distance, distances above 1 m counted as
1 m, of a search in ever finer steps. Ours stay where they are: their starts are known.
"""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from PIL import Image
from rich.console import Console
from rich.table import Table
from scipy.ndimage import distance_transform_edt

from desim.monitor.coverage import OCCUPIED, states
from desim.monitor.meters.localization_errors import wall_errors
from desim.ports import GridSpec
from desim.ports.tasks import Ground
from desim.scenario.load import load
from desim.simulation.simulation import Simulation

ROOT = Path(__file__).resolve().parents[2]
MAPS = ROOT.parent / "shared" / "reference" / "mrs_testbed_maps"
TERRAINS = ("maze", "loop", "cross", "zigzag")
LOCALIZATIONS = ("ground_truth", "odometry", "gmapping")
CELL_M, ORIGIN_M = 0.2, {"cross": (-30.0, -87.6), "zigzag": (-30.0, -87.6), "maze": (-30.0, -81.2),
                         "loop": (-30.0, -81.2)}  # as the YAML files beside the images have them
NEAR = -36.0, 36.0  # m, from their frame to the paper's: roughly (acceptance.py)
FARTHEST_M = 1.0
# Steps and reaches of the search: m, rad; as many of each on both sides.
STEPS = ((0.4, 0.01), (0.1, 0.0025), (0.025, 0.0006))
REACH = 4
ROOM_CELLS = 25
BLACK = 0  # the grey value of a wall in their images
WIDTH_IN, ROW_IN = 10.0, 4.9  # of the picture, and of each terrain in it

Row = dict[str, object]


class Placed(NamedTuple):
    """Wall cells [n, 2] (x m, y m) where a rigid motion (x m, y m, rad) takes them."""

    walls_m: np.ndarray
    motion: tuple[float, float, float]


def published(terrain: str) -> np.ndarray:
    """The centres of the wall cells of the authors' map [n, 2], in its own frame."""
    values = np.asarray(Image.open(MAPS / f"{terrain}.pgm"))[::-1]
    x_m, y_m = ORIGIN_M[terrain]
    rows, columns = np.nonzero(values == BLACK)
    return np.c_[x_m + CELL_M * (columns + 0.5), y_m + CELL_M * (rows + 0.5)]


def with_room(ground: Ground) -> Ground:
    """``ground`` with free cells around it: walls of a map may be outside of the terrain."""
    grid, room_m = ground.grid, ROOM_CELLS * ground.grid.resolution_m
    return Ground(GridSpec(grid.resolution_m, grid.width + 2 * ROOM_CELLS,
                           grid.height + 2 * ROOM_CELLS, grid.x_m - room_m, grid.y_m - room_m),
                  np.pad(ground.solid, ROOM_CELLS), np.pad(ground.reachable, ROOM_CELLS))


def laid_on(ground: Ground, walls_m: np.ndarray) -> Placed:
    """``walls_m`` where they fit best, turned about their middle; see the module's docstring."""
    away_m = distance_transform_edt(ground.solid == 0) * ground.grid.resolution_m
    middle_m = walls_m.mean(axis=0)
    best = (*NEAR, 0.0)
    for step_m, step_rad in STEPS:
        beside = range(-REACH, REACH + 1)
        tried = [(best[0] + i * step_m, best[1] + j * step_m, best[2] + k * step_rad)
                 for i in beside for j in beside for k in beside]
        best = min(tried, key=lambda motion: _cost(ground, away_m, moved(walls_m, middle_m,
                                                                         motion)))
    return Placed(moved(walls_m, middle_m, best), best)


def moved(walls_m: np.ndarray, middle_m: np.ndarray, motion: tuple[float, float, float]
          ) -> np.ndarray:
    """Places [n, 2] after a turn about ``middle_m`` and a shift."""
    c, s = math.cos(motion[2]), math.sin(motion[2])
    return (walls_m - middle_m) @ np.array([[c, s], [-s, c]]) + middle_m + motion[:2]


def _cost(ground: Ground, away_m: np.ndarray, walls_m: np.ndarray) -> float:
    rows, columns, inside = cells_of(ground, walls_m)
    return float(np.where(inside, np.minimum(away_m[rows, columns], FARTHEST_M), FARTHEST_M).mean())


def cells_of(ground: Ground, places_m: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Row and column of the cell of each place, the nearest one for those outside; which are
    inside."""
    grid = ground.grid
    columns = np.floor((places_m[:, 0] - grid.x_m) / grid.resolution_m).astype(int)
    rows = np.floor((places_m[:, 1] - grid.y_m) / grid.resolution_m).astype(int)
    near_rows = rows.clip(0, grid.height - 1)
    near_columns = columns.clip(0, grid.width - 1)
    return near_rows, near_columns, (rows == near_rows) & (columns == near_columns)


def as_evidence(ground: Ground, walls_m: np.ndarray) -> np.ndarray:
    """A map of these walls in the terrain's cells, as a robot has it: log-odds int16."""
    log_odds = np.zeros(ground.solid.shape, np.int16)
    rows, columns, _ = cells_of(ground, walls_m)
    log_odds[rows, columns] = OCCUPIED
    return log_odds


def explored(terrain: str, localization: str) -> tuple[Ground, np.ndarray, dict[str, object]]:
    """Of a run: the truth, the map of the robot that is judged, and more columns of its row."""
    simulation = Simulation(load(str(ROOT / "scenarios" / "maze_8.yaml"), (
        f"environment.terrain={terrain}", f"robot.localization={localization}"), 1).scenario)
    outcome = simulation.run()
    monitor = simulation.monitor
    belief = monitor.judged_map()
    return monitor.truth.ground, belief, {"simulated s": round(outcome.simulated_ns / 1e9, 1)}


def measured(terrain: str) -> tuple[list[Row], Ground, dict[str, np.ndarray]]:
    """A row for each map of a terrain, and the maps that are drawn."""
    rows: list[Row] = []
    for kind in LOCALIZATIONS:
        ground, belief, facts = explored(terrain, kind)
        rows.append({"terrain": terrain, "map": kind, **wall_errors(ground, belief), **facts})
    room = with_room(ground)
    placed = laid_on(room, published(terrain))
    theirs = as_evidence(room, placed.walls_m)
    x_m, y_m, turn_rad = placed.motion
    rows.insert(0, {"terrain": terrain, "map": "published", **wall_errors(room, theirs),
                    "motion": f"{x_m:.3f} m, {y_m:.3f} m, {turn_rad:.4f} rad"})
    return rows, room, {"published": theirs, "gmapping": np.pad(belief, ROOM_CELLS)}


def draw(rows: list[Row], maps: dict[str, tuple[Ground, dict[str, np.ndarray]]], path: Path
         ) -> None:
    """Walls in maps (dark) over true walls (light), a terrain each line."""
    figure = Figure(figsize=(WIDTH_IN, ROW_IN * len(maps)), dpi=80, layout="constrained")
    axes = figure.subplots(len(maps), 2, squeeze=False)
    errors = {(row["terrain"], row["map"]): row for row in rows}
    for line, (terrain, (ground, drawn)) in zip(axes, maps.items(), strict=True):
        for plot, (name, log_odds) in zip(line, drawn.items(), strict=True):
            found = errors[terrain, name]
            picture = np.full((*ground.solid.shape, 3), 255, np.uint8)
            picture[ground.solid > 0] = 255, 190, 120
            picture[states(log_odds) > 0] = 30, 60, 120
            plot.imshow(picture, origin="lower", interpolation="nearest")
            plot.set_xticks([])
            plot.set_yticks([])
            who = "published (Zhi Yan, 2020)" if name == "published" else f"desim, {name}, seed 1"
            plot.set_title(f"{terrain}: {who}\nwall cells off by {found['wall_error_median_m']:.2f}"
                           f" m (median), {found['wall_error_p95_m']:.2f} m (95 %)", fontsize=10)
    figure.savefig(path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--to", type=Path, metavar="FILE", help="picture to draw, png, pdf or svg")
    parser.add_argument("--json", action="store_true", help="JSON instead of a table")
    parser.add_argument("terrains", nargs="*", metavar="terrain", default=TERRAINS,
                        help=f"of {', '.join(TERRAINS)}; default: all")
    arguments = parser.parse_args()
    if unknown := [name for name in arguments.terrains if name not in TERRAINS]:
        parser.error(f"unknown terrain {', '.join(unknown)}; known: {', '.join(TERRAINS)}")
    if not MAPS.is_dir():
        raise SystemExit("published_maps: the authors' maps are not in shared/reference/"
                         f"{MAPS.name} beside the checkout")
    rows: list[Row] = []
    maps = {}
    for terrain in arguments.terrains:
        of_terrain, ground, drawn = measured(terrain)
        rows += of_terrain
        maps[terrain] = ground, drawn
    if arguments.json:
        print(json.dumps(rows, indent=2))
    else:
        table = Table("terrain", "map", "median m", "95 % m", "simulated s", "laid on by")
        for row in rows:
            errors = (f"{row[key]:.1f}" for key in ("wall_error_median_m", "wall_error_p95_m"))
            table.add_row(str(row["terrain"]), str(row["map"]), *errors,
                          str(row.get("simulated s", "")), str(row.get("motion", "")))
        Console(width=120).print(table)
    if arguments.to is not None:
        draw(rows, maps, arguments.to)


if __name__ == "__main__":
    main()

"""Do whole fleets explore as they should? Terrains, seeds, the paper's figure, range, real maps.

    python tools/measurements/acceptance.py [--json] [--workers N] [part ...]

Every run is watched tick by tick (no body deeper than 1 cm in a wall or in another). The exit code
is 1 if something that must be shown is not.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

from collisions import Ticks
from rich.console import Console
from rich.table import Table

from desim.monitor.summary import summarize
from desim.scenario.load import load
from desim.simulation.simulation import Simulation

ROOT = Path(__file__).resolve().parents[2]
SCENARIOS = ROOT / "scenarios"
MAPS = ROOT.parent / "shared" / "reference" / "mrs_testbed_maps"
TERRAINS = ("loop", "cross", "zigzag", "maze")
FLEETS = (1, 4, 8, 30)
ALLOWED_M = 0.01  # how deep bodies may be in anything
NEAR, FAR = "15 m", "200 m"
PAPER_S = {8: 489, 4: 349, 2: 350, 1: 384}  # the paper, Table 2
# From the authors' map frame to the paper's: so the maps cover the geometry best (of offsets in
# steps of 0.2 m, intersection over union 0.92 for loop, 0.96 cross, 0.95 maze, 0.89 zigzag).
MAP_OFFSET = "[-36 m, 36 m]"
AGREEMENT = 0.05

Row = dict[str, Any]


class Job(NamedTuple):
    """One run: a scenario's file, what is laid over it, its seed."""

    file: str
    overrides: tuple[str, ...] = ()
    seed: int = 1


class Part(NamedTuple):
    """The result of a part: a row for each line, the result of all, and whether that is what must
    be shown."""

    rows: list[Row]
    result: str
    shown: bool


def run(job: Job) -> Row:
    """The summary of a run, with its CPU time and how deep bodies ever were in anything."""
    begin_s = time.process_time()
    simulation = Simulation(load(job.file, job.overrides, job.seed).scenario)
    ticks = Ticks(simulation)
    outcome = simulation.run()
    cpu_s = time.process_time() - begin_s
    return {**summarize(simulation.monitor, outcome.simulated_ns), "cpu_s": cpu_s,
            "digest": outcome.digest, **ticks.deepest()._asdict()}


def line(what: str, done: Row) -> Row:
    """One run in a table."""
    return {"what": what, "explored s": seconds(done["exploration_time_s"]),
            "fleet s": seconds(done["fleet_time_s"]), "way m": round(done["exploration_cost_m"]),
            "quality": round(done["map_quality"], 4), "collisions": done["collisions"],
            "recoveries": done["recoveries"], "in matter mm": depth_mm(done),
            "CPU s": round(done["cpu_s"], 1)}


def depth_mm(done: Row) -> float:
    return round(1000 * max(done["wall_m"], done["body_m"], 0.0), 1)


def seconds(time_s: float | None) -> float | str:
    return "-" if time_s is None else round(time_s, 1)


def complete(done: Row) -> bool:
    """Explored in time, and never in matter."""
    return done["exploration_time_s"] is not None and solid(done)


def solid(done: Row) -> bool:
    return max(done["wall_m"], done["body_m"]) <= ALLOWED_M


def spread(times_s: list[float]) -> str:
    if not times_s:
        return "none complete"
    return (f"median {statistics.median(times_s):.1f} s, min {min(times_s):.1f} s, "
            f"max {max(times_s):.1f} s")


# ------------------------------------------------------------------------------------------- parts


def terrains(pool: ProcessPoolExecutor) -> Part:
    """Four terrains with 1, 4, 8 and 30 robots: complete within 2000 s."""
    jobs = {f"{terrain}, {size}": Job(str(SCENARIOS / "maze_30.yaml"), (
        f"environment.terrain={terrain}", f"fleet.size={size}"))
        for terrain in TERRAINS for size in FLEETS}
    done = list(pool.map(run, jobs.values()))
    good = sum(map(complete, done))
    return Part(list(map(line, jobs, done)), f"{good} of {len(done)} complete",
                good == len(done))


def seeds(pool: ProcessPoolExecutor) -> Part:
    """maze_30 with 20 seeds: at least 19 complete."""
    jobs = [Job(str(SCENARIOS / "maze_30.yaml"), (), seed) for seed in range(1, 21)]
    done = list(pool.map(run, jobs))
    good = [row["exploration_time_s"] for row in done if complete(row)]
    return Part([line(f"seed {job.seed}", row) for job, row in zip(jobs, done, strict=True)],
                f"{len(good)} of {len(done)} complete: {spread(good)}",
                len(good) >= 19 and all(map(solid, done)))


def paper(pool: ProcessPoolExecutor) -> Part:
    """maze_8 with 10 seeds, beside Table 2 of the paper."""
    jobs = [Job(str(SCENARIOS / "maze_8.yaml"), (), seed) for seed in range(1, 11)]
    done = list(pool.map(run, jobs))
    good = [row["exploration_time_s"] for row in done if complete(row)]
    times = ", ".join(f"{seconds_:.0f}" for seconds_ in PAPER_S.values())
    return Part([line(f"seed {job.seed}", row) for job, row in zip(jobs, done, strict=True)],
                f"{spread(good)}; the paper: {times} s with 8, 4, 2 and 1 robots a node",
                len(good) == len(done))


def ranges(pool: ProcessPoolExecutor) -> Part:
    """maze_8 within 15 m and within 200 m on the same 10 seeds: partitions, and slower."""
    jobs = [Job(str(SCENARIOS / "maze_8.yaml"), (f"network.media.lan.rules.0.distance={reach}",),
                seed) for seed in range(1, 11) for reach in (NEAR, FAR)]
    done = list(pool.map(run, jobs))
    rows, slower_s = [], []
    for job, near, far in zip(jobs[::2], done[::2], done[1::2], strict=True):
        limit_s = near["simulated_s"]  # a run that was cut off took at least so long
        slower_s.append((near["exploration_time_s"] or limit_s) - far["exploration_time_s"])
        rows.append({"what": f"seed {job.seed}", f"{NEAR}: s": seconds(near["exploration_time_s"]),
                     f"{FAR}: s": seconds(far["exploration_time_s"]),
                     "slower by s": round(slower_s[-1], 1),
                     "partitions": near["partitions"]["count"],
                     "in all s": round(near["partitions"]["total_s"], 1),
                     "longest s": round(near["partitions"]["longest_s"], 1),
                     f"{FAR}: partitions": far["partitions"]["count"]})
    partitioned = all(row["partitions"] > 0 for row in rows)
    median_s = statistics.median(slower_s)
    return Part(rows, f"slower by {median_s:.1f} s (median of the paired differences), "
                      f"{sum(s > 0 for s in slower_s)} of {len(slower_s)} pairs slower",
                partitioned and median_s > 0 and all(map(solid, done)))


def maps(pool: ProcessPoolExecutor) -> Part:
    """The authors' own maps of the four terrains, explored; reachable free area as in geometry."""
    if not MAPS.is_dir():
        return Part([{"what": f"no maps in {MAPS.relative_to(ROOT.parent)}"}], "not run", False)
    maze_8 = str(SCENARIOS / "maze_8.yaml")
    real = list(pool.map(run, [Job(maze_8, real_map(terrain)) for terrain in TERRAINS]))
    drawn = list(pool.map(run, [Job(maze_8, (f"environment.terrain={terrain}",))
                                for terrain in TERRAINS]))
    rows = []
    for terrain, there, here, area in zip(TERRAINS, real, drawn, pool.map(areas, TERRAINS),
                                          strict=True):
        rows.append({"what": terrain, "map: s": seconds(there["exploration_time_s"]),
                     "geometry: s": seconds(here["exploration_time_s"]),
                     "map m2": round(area.map_m2, 1),
                     "geometry, same cells m2": round(area.same_cells_m2, 1),
                     "%": round(100 * (area.map_m2 / area.same_cells_m2 - 1), 2),
                     "geometry, own cells m2": round(area.own_cells_m2, 1),
                     "% ": round(100 * (area.map_m2 / area.own_cells_m2 - 1), 2),
                     "in matter mm": depth_mm(there)})
    agree = all(abs(row["%"]) <= 100 * AGREEMENT for row in rows if row["what"] != "zigzag")
    zigzag = next(row["%"] for row in rows if row["what"] == "zigzag")
    return Part(rows, f"in the same cells loop, cross and maze agree within {AGREEMENT:.0%}: "
                      f"{'yes' if agree else 'no'}; zigzag differs by {zigzag:+.1f} %",
                agree and all(map(complete, real)))


class Areas(NamedTuple):
    """Reachable free area in m2: of an authors' map; of the same terrain as geometry, in the cells
    of that map; and in cells whose middles the walls run through, as the geometry has them."""

    map_m2: float
    same_cells_m2: float
    own_cells_m2: float


def areas(terrain: str) -> Areas:
    """The geometry loses the cells that its walls pass. Seen from the map's cells most walls run
    between two cells, which they take both, as the walls in the maps are about two cells wide."""
    file = SCENARIOS / "maze_8.yaml"
    real, drawn = (Simulation(load(file, overrides).scenario) for overrides in (
        real_map(terrain), (f"environment.terrain={terrain}",)))
    starts = drawn.world.snapshot().poses[:, :2]
    cells = (real.monitor.truth.ground.reachable,
             drawn.world.terrain.reachable(real.monitor.truth.ground.grid, starts),
             drawn.monitor.truth.ground.reachable)
    return Areas(*(int(reachable.sum()) * real.monitor.truth.ground.cell_m2 for reachable in cells))


def real_map(terrain: str) -> tuple[str, ...]:
    """Overrides that put the authors' map in the terrain's place; starts in its wavy walls move to
    the nearest free place. The image that zigzag.yaml names does not exist."""
    return (f"environment.terrain={{map: '{MAPS / terrain}.yaml', image: {terrain}.pgm, "
            f"offset: {MAP_OFFSET}}}", "fleet.start.snap=true")


PARTS: dict[str, Callable[[ProcessPoolExecutor], Part]] = {
    "terrains": terrains, "seeds": seeds, "paper": paper, "range": ranges, "maps": maps}


def show(title: str, part: Part) -> None:
    """One part as a table."""
    table = Table(title=title, title_justify="left")
    for column in part.rows[0]:
        table.add_column(column, justify="left" if column == "what" else "right")
    for row in part.rows:
        table.add_row(*(str(value) for value in row.values()))
    console = Console(width=140)
    console.print(table)
    console.print(f"{'shown' if part.shown else 'NOT SHOWN'}: {part.result}\n", highlight=False)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", metavar="part",
                        help=f"of {', '.join(PARTS)}; default: all")
    parser.add_argument("--json", action="store_true", help="JSON instead of tables")
    parser.add_argument("--workers", type=int, default=2, help="processes (default: 2)")
    arguments = parser.parse_args()
    unknown = sorted(name for name in arguments.parts if name not in PARTS)
    if unknown:
        parser.error(f"unknown part {', '.join(unknown)}; known: {', '.join(PARTS)}")
    results: dict[str, Part] = {}
    with ProcessPoolExecutor(arguments.workers) as pool:
        for name in arguments.parts or PARTS:
            results[name] = part = PARTS[name](pool)
            if not arguments.json:
                show((PARTS[name].__doc__ or name).splitlines()[0], part)
    if arguments.json:
        json.dump({name: part._asdict() for name, part in results.items()}, sys.stdout, indent=2)
        print()
    sys.exit(not all(part.shown for part in results.values()))


if __name__ == "__main__":
    main()

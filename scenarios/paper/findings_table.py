"""The tables and figures of docs/studies/paper.md.

They come from the campaigns of findings.yaml and mechanisms.yaml, or their small versions, as far
as these are done:

    python scenarios/paper/findings_table.py results/findings
    python scenarios/paper/findings_table.py results/mechanisms

Prints Markdown, and of findings writes findings.png beside runs.parquet.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
from exploration_times import against, cell, compare, levels, time_s  # beside this file


def findings(runs, folder: Path) -> None:
    """Times and ways against the fleet's size, by terrain and by the map that explore plans with,
    and those of eight robots in all terrains."""
    sizes, owns = sorted(levels(runs, "robots")), levels(runs, "own_map")
    terrains = levels(runs, "terrain")
    columns = [(terrain, own) for terrain in terrains for own in owns
               if {run["robots"] for run in runs if run["terrain"] == terrain} != {8}]
    if columns:
        print("| robots |", " | ".join(f"{terrain}, {own.replace('_', ' ')}"
                                       for terrain, own in columns), "|")
        print("|---" * (len(columns) + 1) + "|")
        for size in sizes:
            print(f"| {size} |", " | ".join(cell(those(runs, size, *column))
                                            for column in columns), "|")
        figure(runs, sizes, columns, folder / "findings.png")
    print("\n| terrain, 8 robots |", " | ".join(owns), "|")
    print("|---" * (len(owns) + 1) + "|")
    for terrain in terrains:
        print(f"| {terrain} |", " | ".join(cell(those(runs, 8, terrain, own)) for own in owns), "|")


def comparisons(runs) -> None:
    """Times of each fleet against those of eight robots, by terrain and by the map that explore
    plans with, and those of zigzag against those of the maze."""
    times: dict = {}
    for run in runs:
        vector = run["terrain"], run["own_map"]
        times.setdefault(vector, {}).setdefault(str(run["robots"]), {})[run["seed"]] = time_s(run)
    late = Counter((run["terrain"], run["own_map"], str(run["robots"])) for run in runs
                   if run["exploration_time_s"] is None)
    for (terrain, own), fleets in sorted(times.items()):
        if set(fleets) > {"8"}:
            compare(f"robots, {terrain}, {own}, against 8", fleets,
                    {size: fleets["8"] for size in fleets if size != "8"},
                    Counter({size: late[terrain, own, size] for size in fleets}))
    for own in levels(runs, "own_map"):
        zigzag = times["zigzag", own]
        compare(f"robots, {own}, zigzag against maze", zigzag, times["maze", own],
                Counter({size: late["zigzag", own, size] for size in zigzag}))


def those(runs, *vector):
    """The runs of a vector."""
    return [run for run in runs if (run["robots"], run["terrain"], run["own_map"]) == vector]


def figure(runs, sizes, columns, path: Path) -> None:
    """Exploration time and cost against the fleet's size, single runs as dots."""
    from matplotlib import pyplot

    shown, panels = pyplot.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    for number, (terrain, own) in enumerate(columns):
        some = [run for run in runs if (run["terrain"], run["own_map"]) == (terrain, own)]
        there = [size for size in sizes if any(run["robots"] == size for run in some)]
        for panel, value in zip(panels, (time_s, lambda run: run["exploration_cost_m"] / 1000),
                                strict=True):
            means = [np.mean([value(run) for run in some if run["robots"] == size])
                     for size in there]
            panel.plot(there, means, color=f"C{number}", label=f"{terrain}, {own}")
            panel.plot([run["robots"] for run in some], [value(run) for run in some], ".",
                       color=f"C{number}", ms=3)
    for panel, label in zip(panels, ("exploration time, s", "way of all robots, km"), strict=True):
        panel.set(xlabel="robots", ylabel=label, ylim=(0, None))
        panel.grid(alpha=0.3)
    panels[0].axhspan(250, 349, color="0.85", zorder=0)  # from where: findings.yaml
    panels[0].legend(fontsize="small")
    shown.savefig(path, dpi=110)


def mechanisms(runs) -> None:
    """Each mechanism taken away, against none, for each size of the fleet; and the larger fleet
    against the smaller one, without each mechanism; and whether the mechanism changes that."""
    sizes, names = sorted(levels(runs, "robots")), levels(runs, "without")
    times = {(size, name): {run["seed"]: time_s(run) for run in runs
                            if (run["robots"], run["without"]) == (size, name)}
             for size in sizes for name in names}
    overview(times, sizes, names)
    for size in sizes:
        late = Counter(run["without"] for run in runs
                       if run["robots"] == size and run["exploration_time_s"] is None)
        compare(f"{size} robots without", {name: times[size, name] for name in names},
                dict.fromkeys(names[1:], times[size, names[0]]), late)
    few, many = sizes[0], sizes[-1]
    compare(f"{many} robots against {few}, without", {name: times[many, name] for name in names},
            {name: times[few, name] for name in names}, Counter())
    shares = {name: {seed: 100 * times[many, name][seed] / few_s
                     for seed, few_s in times[few, name].items() if seed in times[many, name]}
              for name in names}
    compare(f"what {many} robots take of the time of {few}, without", shares,
            dict.fromkeys(names[1:], shares[names[0]]), Counter(), "%")


def overview(times, sizes, names) -> None:
    """Print the shares of time without each mechanism, with p by Holm, a pair of columns for each
    size of the fleet, and those of the larger fleet against the smaller one."""
    few, many = sizes[0], sizes[-1]
    columns = [against({name: times[size, name] for name in names},
                       dict.fromkeys(names[1:], times[size, names[0]])) for size in sizes]
    last = against({name: times[many, name] for name in names},
                   {name: times[few, name] for name in names})
    print("| without |", " | ".join(f"{size} robots | p" for size in sizes),
          f"| {many} against {few} |")
    print("|---" * (2 + 2 * len(sizes)) + "|")
    for name in names:
        print(f"| {name.replace('_', ' ')} |",
              " | ".join(" | ".join(column.get(name, ("1", "")))
                                        for column in columns), f"| {last[name][0]} |")


def main(campaign: Path) -> None:
    runs = parquet.read_table(campaign / "runs.parquet").to_pylist()
    if "without" in runs[0]:
        mechanisms(runs)
    else:
        findings(runs, campaign)
        comparisons(runs)


if __name__ == "__main__":
    main(Path(sys.argv[1]))

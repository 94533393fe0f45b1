"""A table and a map of the resource that saturates first, from the campaign of saturation.yaml.

    python scenarios/studies/saturation_table.py results/saturation

Prints Markdown: for each speed of processors (down) and rate of the network (across), the mean
exploration time in s, and for each resource the number of runs in which it saturated first
("lan and processor": both in the same window of 5 s, so that neither was the first). A mean
with runs that did not finish is a lower bound, marked by >. Then the times at each speed and at
each rate as shares of those at the last one, by ``paired_times.print_shares``. The map,
saturation.png beside runs.parquet, has the times, coloured by the resource that saturated first,
alone or with others, in most runs; a thick line, the knee, parts the cells that take more than 1.2
times as long as runs in which nothing saturated.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
from paired_times import print_shares, time_s  # beside this file

_KNEE = 1.2  # times as long as without a bottleneck: the bound of "slower", a choice


def first_of(run) -> str:
    """The resources that saturated first: several if they did so in the same window of 5 s."""
    instants = {key.removeprefix("saturation_").removesuffix("_from_s"): from_s
                for key, from_s in run.items()
                if key.startswith("saturation_") and key.endswith("_from_s") and from_s is not None}
    least = min(instants.values(), default=None)
    return " + ".join(sorted(name for name, from_s in instants.items() if from_s == least)
                        ) or "nothing"


def gave_in(runs) -> Counter:
    """The count of runs by what saturated first ("nothing": no resource did)."""
    return Counter(map(first_of, runs))


def most_often(first: Counter) -> str:
    """The resource that saturated first, alone or with others, in most runs; several if they did in
    as many."""
    runs: Counter = Counter()
    for names, count in first.items():
        runs.update(dict.fromkeys(names.split(" + "), count))
    return " or ".join(sorted(name for name, count in runs.items() if count == max(runs.values())))


def mean_time(runs) -> str:
    """The mean exploration time, a lower bound where runs did not finish."""
    late = any(run["exploration_time_s"] is None for run in runs)
    return "> " * late + f"{np.mean([time_s(run) for run in runs]):.0f}"


def cell(runs) -> str:
    """The mean time, and the number of runs by what saturated first."""
    if not runs:
        return "–"
    return (f"{mean_time(runs)} ("
            + ", ".join(f"{name} {count}" for name, count in sorted(gave_in(runs).items())) + ")")


def unhindered_s(runs) -> float:
    """The mean time of the runs in which nothing saturated; the shortest one if there are none."""
    return float(np.mean([time_s(run) for run in runs if first_of(run) == "nothing"]
                         or min(map(time_s, runs))))


def shares(runs, name: str, other: str) -> None:
    """Print the times at each value of the parameter ``name``, beside those at the last one, over
    pairs of one value of ``other``, without the rates at which runs did not finish."""
    late = {run["rate"] for run in runs if run["exploration_time_s"] is None}
    times: dict = {}
    for run in runs:
        if run["rate"] not in late:
            value = f"{run[name]:g}" if name == "speed" else run[name]
            times.setdefault(value, {})[run[other], run["seed"]] = time_s(run)
    *before, last = times
    print_shares(f"{name}, against {last}", {value: times[value] for value in before}, times[last])


def knee(times: np.ndarray, fast_s: float
         ) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """The edges (from (x, y), to (x, y)) that part slow cells of ``times`` [rows, columns] s from
    the others: those that take more than ``_KNEE`` times ``fast_s``."""
    slow = times > _KNEE * fast_s
    rows, columns = times.shape
    edges = [((column + 0.5, row - 0.5), (column + 0.5, row + 0.5))
             for row in range(rows) for column in range(columns - 1)
             if slow[row, column] != slow[row, column + 1]]
    edges += [((column - 0.5, row + 0.5), (column + 0.5, row + 0.5))
              for row in range(rows - 1) for column in range(columns)
              if slow[row, column] != slow[row + 1, column]]
    return edges


def draw(cells: dict, speeds: list, rates: list, path: Path) -> None:
    """Write the map to a PNG file."""
    from matplotlib import colormaps, patches, pyplot

    first = {place: most_often(gave_in(runs)) for place, runs in cells.items()}
    colours = dict(zip(sorted(set(first.values())), colormaps["Pastel1"].colors, strict=False))
    times = np.full((len(speeds), len(rates)), np.nan)
    shown, panel = pyplot.subplots(figsize=(7, 3.8), layout="constrained")
    for (speed, rate), runs in cells.items():
        row, column = speeds.index(speed), rates.index(rate)
        times[row, column] = np.mean([time_s(run) for run in runs])
        panel.add_patch(patches.Rectangle((column - 0.5, row - 0.5), 1, 1, ec="white",
                                          fc=colours[first[speed, rate]]))
        panel.text(column, row, mean_time(runs), ha="center", va="center")
    for (x, y), (to_x, to_y) in knee(times, unhindered_s(sum(cells.values(), []))):
        panel.plot([x, to_x], [y, to_y], color="black", lw=3)
    panel.set(xlim=(-0.5, len(rates) - 0.5), ylim=(-0.5, len(speeds) - 0.5),
              xticks=range(len(rates)), xticklabels=rates, xlabel="rate of the network",
              yticks=range(len(speeds)), yticklabels=speeds, ylabel="speed of the processors",
              title="exploration time, s, and what saturates first")
    panel.legend(handles=[patches.Patch(color=colour, label=name)
                          for name, colour in colours.items()],
                 loc="upper left", bbox_to_anchor=(1, 1))
    shown.savefig(path, dpi=110)
    pyplot.close(shown)


def main(campaign: Path) -> None:
    runs = parquet.read_table(campaign / "runs.parquet").to_pylist()
    speeds, rates = (list(dict.fromkeys(run[name] for run in runs)) for name in ("speed", "rate"))
    cells: dict = {}
    for run in runs:
        cells.setdefault((run["speed"], run["rate"]), []).append(run)
    print("| speed |", " | ".join(map(str, rates)), "|")
    print("|---" * (1 + len(rates)) + "|")
    for speed in speeds:
        print(f"| {speed:g} |", " | ".join(cell(cells.get((speed, rate), [])) for rate in rates),
              "|")
    print(f"\nRuns in which nothing saturated took {unhindered_s(runs):.0f} s in the mean.")
    shares(runs, "speed", "rate")
    shares(runs, "rate", "speed")
    draw(cells, speeds, rates, campaign / "saturation.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]))

"""The tables and the figures of docs/studies/exploration.md, as far as their campaign is done.

    python scenarios/paper/exploration_table.py results/exploration results/exploration_ideal

Prints Markdown: times and ways by terrain and fleet; of each terrain the fastest fleet, the knees
of its times, and how busy its computers are; groups of fleets against each other, and against the
second campaign, with true poses, ideal computers and simpler software; maps, safety and loads by
fleet, over all terrains; speeds and safety by terrain; the long runs of the zigzag, and the zigzag
against the other terrains, for equal fleets and seeds.
Writes the paper's figures beside runs.parquet: figure6.png, the loads of computers and network;
figure7.png, times, ways, efficiencies and maps, those of the second campaign as thin lines.
"""

from __future__ import annotations

import sys
from collections import Counter
from operator import itemgetter
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
from exploration_times import levels, time_cell, time_s, way_km  # beside this file

from desim.statistics.comparisons import holm, paired
from desim.statistics.intervals import t_interval
from desim.statistics.two_knees import FEWEST_LOADS, knees_of

_SHOWN = (1, 2, 4, 8, 11, 16, 22, 30)  # robots: rows of the table
# Groups of fleets that are compared: one robot; the paper's fastest fleet in the maze, 11, with two
# neighbours on each side; the largest ones. And the paper's outlier with its neighbours.
_ONE, _ELEVEN, _LARGEST = (1,), range(9, 14), range(26, 31)
_COMPARED = {"9 to 13 robots, of 1": (_ELEVEN, _ONE), "26 to 30, of 9 to 13": (_LARGEST, _ELEVEN),
             "26, of 25 and 27": ((26,), (25, 27))}
_SEEN = 2  # seeds whose runs had been looked at when the groups were chosen
_LONG_S = 900.0  # in the zigzag: robots came back from its far end for what was left near the start
# Values of a run, by the label of their axis.
_FIGURE_6 = {"CPU, %": itemgetter("mean_cpu_percent"), "RAM, %": itemgetter("mean_ram_percent"),
             "a robot receives, kB/s": itemgetter("mean_rx_kBps"),
             "a robot sends, kB/s": itemgetter("mean_tx_kBps")}
_FIGURE_7 = {"exploration time, s": time_s,
             "way of all robots, m": itemgetter("exploration_cost_m"),
             "efficiency, m² a metre": itemgetter("exploration_efficiency_m2_per_m"),
             "map quality": itemgetter("map_quality")}
_LEAST = {"map quality": 0.95}  # of an axis that does not begin at 0
_NEAR = 1  # robots more or fewer: neighbours of a fleet, over which its time is averaged


def means(runs, value) -> tuple[list[int], list[float]]:
    """Numbers of robots, and the mean of ``value`` over the runs of each."""
    sizes = sorted(levels(runs, "robots"))
    return sizes, [float(np.mean([value(run) for run in runs if run["robots"] == size]))
                   for size in sizes]


def fastest(runs) -> tuple[int, float]:
    """The fleet with the shortest time, and that time, s: a mean over it and its neighbours."""
    near = {size: np.mean([time_s(run) for run in runs if abs(run["robots"] - size) <= _NEAR])
            for size in levels(runs, "robots")}
    best = min(near, key=near.__getitem__)
    return best, float(near[best])


def without_a_seed(runs) -> str:
    """The smallest and the largest fleet that is the fastest if one of the seeds is left out."""
    seeds = levels(runs, "seed")
    if len(seeds) < 2:
        return ""
    found = [fastest([run for run in runs if run["seed"] != seed])[0] for seed in seeds]
    return f" ({min(found)} to {max(found)})"


def knees(runs) -> str:
    """The fleets from which on more robots pay off less or more, each with its 95 % interval, and
    the changes of time a robot between them. Only seeds with a run of each fleet are looked at."""
    sizes = levels(runs, "robots")
    whole = [run for seed in levels(runs, "seed")
             for own in [[run for run in runs if run["seed"] == seed]] if len(own) == len(sizes)
             for run in own]
    if len(sizes) < FEWEST_LOADS or not whole:
        return "–"
    found = knees_of([run["robots"] for run in whole], [time_s(run) for run in whole],
                     blocks=[run["seed"] for run in whole])
    if not found:
        return "none"
    return f"{found[0].slope_before:+.1f}" + "".join(
        f"; from {knee.at:.1f} ({knee.low:.1f} to {knee.high:.1f}) on {knee.slope_after:+.1f}"
        for knee in found)


def times(by_terrain) -> None:
    """Print times by fleet and terrain, and how many runs did not know 99 % in time; then ways."""
    for title, cell in ("| robots |", time_cell), ("\n| way, km, by robots |", way_km):
        print(title, " | ".join(by_terrain), "|")
        print("|---" * (1 + len(by_terrain)) + "|")
        for size in _SHOWN:
            cells = [cell([run for run in runs if run["robots"] == size])
                     for runs in by_terrain.values()]
            print(f"| {size} |", " | ".join(cells), "|")


def facts(by_terrain) -> None:
    """Print of each terrain the fastest fleet, the knees, and how busy its computers are."""
    print("\n| terrain | fastest fleet (without one seed): mean with its neighbours, s "
          "| each robot more adds, s, and knees | CPU, %: mean, most |")
    print("|---" * 4 + "|")
    for terrain, runs in by_terrain.items():
        (best, best_s), cpu = fastest(runs), [run["mean_cpu_percent"] for run in runs]
        print(f"| {terrain} | {best}{without_a_seed(runs)}: {best_s:.0f} | {knees(runs)} | "
              f"{np.mean(cpu):.0f}, {max(cpu):.0f} |")


def long_runs(runs) -> None:
    """Print how many runs of the zigzag take long, with which fleets, and how long the others."""
    took = sorted(map(time_s, runs))
    long = [f"{time:.0f}" for time in took if time > _LONG_S]
    fleets = Counter(run["robots"] for run in runs if time_s(run) > _LONG_S)
    print(f"\n{len(long)} of {len(runs)} runs of the zigzag took more than {_LONG_S:.0f} s ("
          + ", ".join(f"fleet of {size}: {count}" for size, count in sorted(fleets.items()))
          + f"): {', '.join(long)} s. The others took {took[0]:.0f} to "
          f"{max(time for time in took if time <= _LONG_S):.0f} s.")


def log_times(runs, fleets) -> dict[int, float]:
    """The mean logarithm of the times of ``fleets`` by seed, for seeds with a run of each."""
    found = {}
    for seed in levels(runs, "seed"):
        own = [run for run in runs if run["seed"] == seed and run["robots"] in fleets]
        if len(own) == len(fleets):
            found[seed] = float(np.mean(np.log([time_s(run) for run in own])))
    return found


def pairs_of(times, others) -> list[tuple[float, float]]:
    """Times of equal seeds."""
    return [(times[seed], others[seed]) for seed in times if seed in others]


def groups(by_terrain) -> None:
    """Print the times of groups of fleets as shares of others', seed by seed: geometric means with
    95 % intervals and p of the paired t tests by Holm; then those of the seeds that had not been
    seen when the groups were chosen."""
    found = {}
    for terrain, runs in by_terrain.items():
        fresh = [run for run in runs if run["seed"] > _SEEN]
        for title, fleets in _COMPARED.items():
            every, alone = (pairs_of(*(log_times(those, group) for group in fleets))
                            for those in (runs, fresh))
            compared = paired(*zip(*every, strict=True)) if every else None
            found[terrain, title] = compared, t_interval([one - other for one, other in alone])
    tested = {name: one.t_p for name, (one, _) in found.items() if one and one.t_p is not None}
    adjusted = dict(zip(tested, holm(list(tested.values())), strict=True))
    texts = {name: (one.difference.quotient_text() + (
        f", p {adjusted[name]:.2g}" if name in adjusted else "") if one else "–",
        alone.quotient_text() or "–") for name, (one, alone) in found.items()}
    for column, title in enumerate(("terrain", f"seeds above {_SEEN}")):
        print(f"\n| {title} |", " | ".join(_COMPARED), "|")
        print("|---" * (1 + len(_COMPARED)) + "|")
        for terrain in by_terrain:
            print(f"| {terrain} |", " | ".join(texts[terrain, group][column]
                                               for group in _COMPARED), "|")


def beside(by_terrain, ideal) -> None:
    """Print the times of groups of fleets as shares of those of the campaign ``ideal``."""
    print("\n| terrain, as a share of ideal | 1 robot | 9 to 13 | 26 to 30 |")
    print("|---" * 4 + "|")
    for terrain, runs in by_terrain.items():
        shares = [t_interval([one - other for one, other in pairs_of(
            log_times(runs, group), log_times(ideal.get(terrain, []), group))]).quotient_text()
            for group in (_ONE, _ELEVEN, _LARGEST)]
        print(f"| {terrain} |", " | ".join(share or "–" for share in shares), "|")


def loads(by_terrain) -> None:
    """Print how good maps are, how safely robots drive, and how busy computers and network are, by
    fleet, over all terrains."""
    runs = [run for of_terrain in by_terrain.values() for run in of_terrain]
    print("\n| robots | map quality | safety | CPU, % | RAM, % | a robot receives, sends, kB/s "
          "| workstation, Mb/s both ways | fullest resource, % |")
    print("|---" * 8 + "|")
    for size in _SHOWN:
        own = [run for run in runs if run["robots"] == size]
        if not own:
            continue
        mean = {name: np.mean([run[name] for run in own]) for name in (
            "map_quality", "safety", "mean_cpu_percent", "mean_ram_percent", "mean_rx_kBps",
            "mean_tx_kBps", "hosts_workstation_rx_kBps", "hosts_workstation_tx_kBps")}
        workstation_kBps = mean["hosts_workstation_rx_kBps"] + mean["hosts_workstation_tx_kBps"]
        fullest, share = max(peaks(own).items(), key=itemgetter(1))
        print(f"| {size} | {mean['map_quality']:.3f} | {mean['safety']:.2f} | "
              f"{mean['mean_cpu_percent']:.0f} | {mean['mean_ram_percent']:.1f} | "
              f"{mean['mean_rx_kBps']:.0f}, {mean['mean_tx_kBps']:.0f} | "
              f"{workstation_kBps * 8 / 1000:.0f} | {fullest} {100 * share:.0f} |")


def peaks(runs) -> dict[str, float]:
    """The most of each resource that was in use for 5 s in any of the runs, as a share."""
    found: dict[str, float] = {}
    for run in runs:
        for key, peak in run.items():
            if key.startswith("saturation_") and key.endswith("_peak") and peak is not None:
                name = key.removeprefix("saturation_").removesuffix("_peak")
                found[name] = max(found.get(name, 0.0), peak)
    return found


def speed_mps(run) -> float:
    """The mean speed of the robots of a run."""
    return run["exploration_cost_m"] / run["robots"] / time_s(run)


def driving(by_terrain) -> None:
    """Print how fast robots drive in the mean, how their use of processors goes with it (the
    correlation of both, less the means of equal fleets), and how safely large fleets drive."""
    print("\n| terrain | mean speed, m/s: 1 robot | 9 to 13 | 26 to 30 | correlation with CPU "
          "| safety, 26 to 30 |")
    print("|---" * 6 + "|")
    for terrain, runs in by_terrain.items():
        by_group = [[speed_mps(run) for run in runs if run["robots"] in group]
                     for group in (_ONE, _ELEVEN, _LARGEST)]
        speeds = [f"{np.mean(group):.2f}" if group else "–" for group in by_group]
        sides = [less_fleet(runs, value) for value in (speed_mps, itemgetter("mean_cpu_percent"))]
        safety = [run["safety"] for run in runs if run["robots"] in _LARGEST]
        varies = all(np.ptp(side) for side in sides)
        print(f"| {terrain} |", " | ".join(speeds), "|",
              f"{np.corrcoef(*sides)[0, 1]:.2f}" if varies else "–", "|",
              f"{np.mean(safety):.2f} |" if safety else "– |")


def less_fleet(runs, value) -> list[float]:
    """The value of each run, less the mean over runs of fleets of that size."""
    mean = dict(zip(*means(runs, value), strict=True))
    return [value(run) - mean[run["robots"]] for run in runs]


def beside_zigzag(by_terrain) -> None:
    """Print the values of zigzag as shares of those of the other terrains, geometric means over
    runs of equal fleets and seeds, and the least and the most of a single fleet. Runs of one seed
    may depend on each other, so that the 95 % intervals are over the means of seeds."""
    names = {"time": time_s, "CPU": itemgetter("mean_cpu_percent"),
             "RAM": itemgetter("mean_ram_percent"), "received": itemgetter("mean_rx_kBps"),
             "sent": itemgetter("mean_tx_kBps")}
    print("\n| zigzag, as a share of |", " | ".join(names), "|")
    print("|---" * (1 + len(names)) + "|")
    own = {(run["robots"], run["seed"]): run for run in by_terrain["zigzag"]}
    for terrain, runs in by_terrain.items():
        pairs = [(own[run["robots"], run["seed"]], run) for run in runs
                 if (run["robots"], run["seed"]) in own]
        if terrain != "zigzag" and pairs:
            print(f"| {terrain} |", " | ".join(share(pairs, value) for value in names.values()),
                  "|")
            print("| ... single fleets |", " | ".join(
                f"{min(shares):.2f} to {max(shares):.2f}" for value in names.values()
                for shares in [by_fleet(pairs, value)]), "|")


def share(pairs, value) -> str:
    """The geometric mean of the quotients of ``pairs`` of runs, with its 95 % interval."""
    by_seed: dict[int, list[float]] = {}
    for one, other in pairs:
        by_seed.setdefault(one["seed"], []).append(np.log(value(one) / value(other)))
    return t_interval([np.mean(own) for own in by_seed.values()]).quotient_text()


def by_fleet(pairs, value) -> list[float]:
    """The geometric mean of the quotients of ``pairs`` of runs for each size of the fleet."""
    shares: dict[int, list[float]] = {}
    for one, other in pairs:
        shares.setdefault(one["robots"], []).append(np.log(value(one) / value(other)))
    return [float(np.exp(np.mean(own))) for own in shares.values()]


def figure(by_terrain, ideal, values, path: Path) -> None:
    """Draw ``values`` by fleet and terrain: lines through means, single runs as dots, and thin
    lines for the means of ``ideal``."""
    from matplotlib import pyplot

    shown, grid = pyplot.subplots(2, 2, figsize=(11, 7), sharex=True, layout="constrained")
    for panel, (label, value) in zip(grid.flat, values.items(), strict=True):
        for number, (terrain, runs) in enumerate(by_terrain.items()):
            colour = f"C{number}"
            panel.plot(*means(runs, value), color=colour, label=terrain)
            panel.plot([run["robots"] for run in runs], [value(run) for run in runs], ".", ms=3,
                       color=colour)
            panel.plot(*means(ideal.get(terrain, []), value), color=colour, lw=0.7)
        panel.set(ylabel=label, ylim=(_LEAST.get(label, 0), None))
        panel.grid(alpha=0.3)
    for panel in grid[1]:
        panel.set_xlabel("robots")
    grid[0, 0].legend()
    shown.savefig(path, dpi=90)
    pyplot.close(shown)


def read(campaign: Path) -> dict:
    """The runs of a campaign, by terrain."""
    runs = parquet.read_table(campaign / "runs.parquet").to_pylist()
    return {terrain: [run for run in runs if run["terrain"] == terrain]
            for terrain in levels(runs, "terrain")}


def main(campaign: Path, *ideal: Path) -> None:
    by_terrain, without = read(campaign), read(ideal[0]) if ideal else {}
    times(by_terrain)
    facts(by_terrain)
    groups(by_terrain)
    if without:
        beside(by_terrain, without)
    loads(by_terrain)
    driving(by_terrain)
    if "zigzag" in by_terrain:
        long_runs(by_terrain["zigzag"])
        beside_zigzag(by_terrain)
    figure(by_terrain, {}, _FIGURE_6, campaign / "figure6.png")
    figure(by_terrain, without, _FIGURE_7, campaign / "figure7.png")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))

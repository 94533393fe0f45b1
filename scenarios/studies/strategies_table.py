"""Tables and a figure that compare strategies, from the campaign of strategies.yaml.

    python scenarios/studies/strategies_table.py results/strategies

Prints Markdown and writes strategies.png beside runs.parquet.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
from paired_times import logarithms, time_s  # beside this file

from desim.statistics.comparisons import Paired, holm
from desim.statistics.intervals import t_interval

REFERENCE = "nearest_frontier"


def strategy_kB(run):
    """kB delivered of what strategies publish, and of the state of the team that they read."""
    families = run.metrics["messages_by_topic"]
    return 1e-3 * sum(fates["bytes"] for family, fates in families.items()
                      if "/strategy/" in family or family.endswith("/team_state"))


def times_of(runs, strategy) -> dict[tuple[str, int], float]:
    """The time by terrain and seed."""
    return {(run["terrain"], run["seed"]): time_s(run) for run in runs
            if run["strategy"] == strategy}


def compared_with(first, second) -> Paired:
    """The logarithms of two strategies' times, pair by pair."""
    return logarithms(first, second, [key for key in first if key in second])


def times_by_strategy(runs) -> dict[str, dict[tuple[str, int], float]]:
    """The times of each strategy, by terrain and seed."""
    return {name: times_of(runs, name) for name in dict.fromkeys(run["strategy"] for run in runs)}


def beside_reference(runs) -> dict[str, tuple[Paired, float]]:
    """Each strategy compared with the reference, and p of the paired t test by Holm."""
    times = times_by_strategy(runs)
    pairs = {name: compared_with(own, times[REFERENCE]) for name, own in times.items()
             if name != REFERENCE}
    adjusted = holm([pair.t_p or 1.0 for pair in pairs.values()])
    return {name: (pairs[name], p) for name, p in zip(pairs, adjusted, strict=True)}


def shares(runs) -> None:
    """Print each strategy's time as a share of the reference's, by network and fleet: geometric
    means over terrains and seeds with 95 % intervals, a star where p is below 0.05."""
    print("| strategy |", " | ".join(f"{network}, {robots} robots"
                                     for network, robots in settings(runs)), "|")
    print("|---" * (1 + len(settings(runs))) + "|")
    columns = [beside_reference(of_setting(runs, setting)) for setting in settings(runs)]
    for name in columns[0]:
        print(f"| `{name}` |", " | ".join(
            pair.difference.quotient_text() + ("*" if p < 0.05 else "")
            for pair, p in (column[name] for column in columns)), "|")


def table(runs) -> None:
    """Mean times by terrain, and each strategy's time as a share of the reference's: geometric
    mean over terrains and seeds, its 95 % interval, p of the paired t test by Holm."""
    terrains = list(dict.fromkeys(run["terrain"] for run in runs))
    times, pairs = times_by_strategy(runs), beside_reference(runs)
    print("| strategy |", " | ".join(f"{terrain}, s" for terrain in terrains),
          "| late | share of nearest's time | p | d_z | MB | kB |")
    print("|---" * (len(terrains) + 7) + "|")
    for name, own in times.items():
        mine = [run for run in runs if run["strategy"] == name]
        cells = [t_interval([own[key] for key in own if key[0] == terrain]).text()
                 for terrain in terrains]
        late = sum(run["exploration_time_s"] is None for run in mine)
        compared = ["1", "", ""]
        if name in pairs:
            pair, p = pairs[name]
            compared = [pair.difference.quotient_text(), f"{p:.2g}", f"{pair.cohen_dz:.1f}"]
        sent = [f"{np.mean([run[key] for run in mine]):.2g}"
                for key in ("coordination_MB", "strategy_kB")]
        print(f"| `{name}` |", " | ".join(cells + [str(late) if late else ""] + compared + sent),
              "|")


def settings(runs) -> list[tuple[str, int]]:
    """The networks and the sizes of fleets that there are runs of."""
    return sorted({(run["network"], run["robots"]) for run in runs})


def of_setting(runs, setting: tuple[str, int]):
    """The runs of a network and a size of the fleet."""
    return [run for run in runs if (run["network"], run["robots"]) == setting]


def expectations(runs) -> None:
    """Sentences of the literature as paired comparisons: the share of time for each network and
    size, and the number of pairs in which the first one was faster and slower."""
    print("\n| expected to be no slower | than |",
          " | ".join(f"{network}, {robots}" for network, robots in settings(runs)), "|")
    print("|---" * (2 + len(settings(runs))) + "|")
    for first, second in (("greedy_assignment", REFERENCE), ("hungarian", REFERENCE),
                          ("minpos", REFERENCE), ("voronoi", REFERENCE), ("market", REFERENCE),
                          ("centralized", REFERENCE), ("minpos", "greedy_assignment"),
                          ("hungarian", "greedy_assignment"), (REFERENCE, "random_frontier")):
        cells = []
        for setting in settings(runs):
            some = of_setting(runs, setting)
            pair = compared_with(times_of(some, first), times_of(some, second))
            cells.append(f"{pair.difference.quotient_text()}, {pair.below}:{pair.above}")
        print(f"| `{first}` | `{second}` |", " | ".join(cells), "|")


def figure(runs, path: Path) -> None:
    """Exploration times, a panel for each terrain, a row for each strategy."""
    from matplotlib import pyplot

    terrains = list(dict.fromkeys(run["terrain"] for run in runs))
    strategies = list(dict.fromkeys(run["strategy"] for run in runs))
    marks = {("lan", 4): ("o", "none", "C0"), ("lan", 8): ("o", "C0", "C0"),
             ("radio", 4): ("s", "none", "C1"), ("radio", 8): ("s", "C1", "C1")}
    shown, panels = pyplot.subplots(1, len(terrains), figsize=(12, 5), sharey=True,
                                    layout="constrained")
    for panel, terrain in zip(panels, terrains, strict=True):
        for network, robots in settings(runs):
            marker, face, edge = marks[network, robots]
            means = [np.mean([time_s(run) for run in runs if (run["strategy"], run["terrain"],
                     run["network"], run["robots"]) == (name, terrain, network, robots)])
                     for name in strategies]
            panel.plot(means, range(len(strategies)), marker, mfc=face, mec=edge,
                       label=f"{network}, {robots} robots")
        panel.set(title=terrain, xlabel="exploration time, s", xlim=(0, None))
        panel.grid(alpha=0.3)
    panels[0].set_yticks(range(len(strategies)), strategies)
    panels[0].invert_yaxis()
    panels[0].legend(fontsize="small")
    shown.savefig(path, dpi=110)


def main(campaign: Path) -> None:
    runs = parquet.read_table(campaign / "runs.parquet").to_pylist()
    shares(runs)
    for network, robots in settings(runs):
        print(f"\n**{network}, {robots} robots**\n")
        table(of_setting(runs, (network, robots)))
    expectations(runs)
    figure(runs, campaign / "strategies.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]))

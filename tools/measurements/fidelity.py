"""Does the radio's fidelity change the results of thirty robots? ``field_30`` on every rung.

    python tools/measurements/fidelity.py [--seeds N] [--set KEY=VALUE ...]

Prints the tables of docs/studies/ladder.md. The load is what the robots send, with headers and
repetitions of the transport, but without those of the radio.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections import Counter
from pathlib import Path
from typing import Any

from desim.monitor.summary import summarize
from desim.scenario.load import load
from desim.simulation.simulation import Simulation

FILE = Path(__file__).resolve().parents[2] / "scenarios" / "field_30.yaml"
RUNGS = ("ideal", "disk", "walls", "mac", "multihop")
SIZE = 30
COLUMNS = ("rung", "explored after", "seeds", "delivered", "dropped messages", "lost frames",
           "Mb/s a robot", "air busy", "real-time factor")


def run(fidelity: str, seed: int, overrides: list[str]) -> dict[str, Any]:
    """A run's summary, with the frames that were lost by reason and the CPU time."""
    simulation = Simulation(
        load(FILE, [f"network.fidelity={fidelity}", *overrides], seed).scenario)
    begin_s = time.process_time()
    outcome = simulation.run()
    cpu_s = time.process_time() - begin_s
    medium, = simulation.graph.media
    summary = summarize(simulation.monitor, outcome.simulated_ns)
    return {**summary, "cpu_s": cpu_s,
            "simulated_s": outcome.simulated_ns / 1e9, "sent_bytes": sum(medium.tx_bytes),
            "frames": medium.intended, "lost": medium.dropped,
            "busy": summary["utilisation"][medium.name]}


def line(fidelity: str, runs: list[dict[str, Any]]) -> tuple[str, ...]:
    times_s = sorted(run["exploration_time_s"] or float("inf") for run in runs)
    total, dropped, lost = Counter(), Counter(), Counter()
    for one in runs:
        dropped.update(one["messages_dropped"])
        lost.update(one["lost"])
        total.update({key: one[key] for key in (
            "messages_sent", "messages_delivered", "cpu_s", "simulated_s", "sent_bytes", "frames")})
    return (fidelity, f"{statistics.median(times_s):.0f} s",
            f"{times_s[0]:.0f} to {times_s[-1]:.0f} s",
            f"{total['messages_delivered'] / total['messages_sent']:.1%}",
            shares(dropped, total["messages_sent"]), shares(lost, total["frames"]),
            f"{total['sent_bytes'] * 8e-6 / total['simulated_s'] / SIZE:.2f}",
            busy([run["busy"] for run in runs]), f"{total['simulated_s'] / total['cpu_s']:.0f}")


def busy(shares: list[dict[str, float] | None]) -> str:
    """The mean over hosts and runs, and the busiest host's."""
    if None in shares:
        return "-"
    mean, most = (statistics.mean(share[key] for share in shares) for key in ("mean", "max"))
    return f"{mean:.1%}, at most {most:.1%}"


def shares(counts: Counter[str], of: int) -> str:
    return ", ".join(f"{reason} {count / of:.1%}"
                     for reason, count in sorted(counts.items())) or "none"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=5, help="runs of each rung (default: 5)")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE",
                        help="laid over the scenario, as with desim run")
    arguments = parser.parse_args()
    print("|", " | ".join(COLUMNS), "|")
    print("|---" * len(COLUMNS) + "|")
    for fidelity in RUNGS:
        runs = [run(fidelity, seed, arguments.set) for seed in range(1, arguments.seeds + 1)]
        print("|", " | ".join(line(fidelity, runs)), "|", flush=True)


if __name__ == "__main__":
    main()

"""A table of what cameras do to commands, from the campaign of commands.yaml, and its metrics.

    python scenarios/studies/commands_table.py results/commands

Prints Markdown: for each load, queue and mark the means over the runs of the commands' delay, the
share of them that is lost, and the pictures that arrive from a robot.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet

import desim


def command_p50_s(run: desim.Run) -> float | None:
    """Half of the commands that arrive do so within this time."""
    return _delay_s(run, 50)


def command_p99_s(run: desim.Run) -> float | None:
    """99 % of the commands that arrive do so within this time."""
    return _delay_s(run, 99)


def commands_lost(run: desim.Run) -> float | None:
    """The share of commands that do not arrive."""
    fates = _sent(run, "/cmd")["fate"]
    return float(np.mean(fates == "dropped")) if len(fates) else None


def pictures_hz(run: desim.Run) -> float:
    """Whole pictures a second from a robot."""
    sent = _sent(run, "/camera")
    robots = len(set(sent["source"].tolist())) or 1
    return float(np.sum(sent["fate"] == "delivered")) / robots / run.metrics["simulated_s"]


def _sent(run: desim.Run, topic: str) -> dict[str, np.ndarray]:
    table = run.table("messages")
    chosen = np.array([name.endswith(topic) for name in table["topic"].tolist()])
    return {name: table[name][chosen] for name in ("source", "fate", "latency_ns")}


def _delay_s(run: desim.Run, share: int) -> float | None:
    sent = _sent(run, "/cmd")
    delays_ns = sent["latency_ns"][sent["fate"] == "delivered"]
    return float(np.percentile(delays_ns, share)) / 1e9 if len(delays_ns) else None


def row(key: tuple[str, str, str], runs: list[dict[str, object]]) -> str:
    """The means of one way."""
    def mean(name: str) -> float:
        return float(np.mean([run[name] for run in runs]))

    return (f"| {' | '.join(key)} | {1e3 * mean('command_p50_s'):.1f} ms "
            f"| {1e3 * mean('command_p99_s'):.0f} ms | {100 * mean('commands_lost'):.1f} % "
            f"| {mean('pictures_hz'):.1f} Hz |")


def main(campaign: Path) -> None:
    runs = parquet.read_table(campaign / "runs.parquet").to_pylist()
    names = "cameras", "queue", "marks"
    print("| cameras | queue | marked | command, p50 | p99 | lost | pictures |")
    print("|---" * 7 + "|")
    for key in dict.fromkeys(tuple(str(run[name]) for name in names) for run in runs):
        print(row(key, [run for run in runs if tuple(str(run[name]) for name in names) == key]))


if __name__ == "__main__":
    main(Path(sys.argv[1]))

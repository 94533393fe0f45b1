"""What does one more robot cost? CPU time of a simulated second against the size of the fleet.

    python tools/bench.py fleets [--figure FILE]

``broadcast``: a warehouse with 50 m2 for each robot, 802.11 radios, changed tiles by broadcast
every 10 s: scenarios/field_30.yaml in a generated warehouse, with starts everywhere.
``unicast``: the 80 m maze, everything over one switched LAN, whole maps to each other robot every
5 s, as in scenarios/maze_30.yaml. Simulated seconds 2 to 7; each run is a process of its own.
"""

from __future__ import annotations

import json
import math
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from desim.engine.garbage import rare_collections
from desim.scenario.load import load
from desim.simulation.simulation import Simulation
from desim.units import NS_PER_S

ROOT = Path(__file__).resolve().parents[2]
BROADCAST, UNICAST = "broadcast", "unicast"
SIZES = {BROADCAST: (10, 30, 100, 300, 1000), UNICAST: (10, 30, 100, 200)}
BEGIN_S, END_S = 2, 7  # ten robots know their hall after 10 s
ROOM_M2 = 50.0  # of each robot
LEAST_M = 34.0  # of a hall from the docks to the other side, for one row of racks
RUNS = 3  # of each fleet, in turns; the cheapest counts

Row = dict[str, object]


def overrides(kind: str, robots: int) -> tuple[str, list[str]]:
    """The scenario's file, and what differs from it."""
    common = [f"fleet.size={robots}", "stop.explored=100 %"]
    if kind == UNICAST:
        return "maze_30.yaml", [*common, "fleet.start={columns: 5, from: [-39 m, 39 m], "
                                         "step: [1.5 m, -1.8 m], snap: true}"]
    area_m2 = ROOM_M2 * robots
    height_m = max(math.sqrt(area_m2 / 1.5), LEAST_M)
    hall = f"[{area_m2 / height_m:.1f} m, {height_m:.1f} m]"
    return "field_30.yaml", [
        *common, f"environment.terrain={{warehouse: {{size: {hall}, seed: 3}}}}",
        "fleet.start={apart: 1 m}", "robot.mapping.resolution=0.4 m",
        "network.media.air.update=500 ms", "coordination.exchange.period=10 s",
        "coordination.exchange.via=broadcast"]


def measure(kind: str, robots: int) -> dict[str, float]:
    """One run in this process: CPU ms of a simulated second, events and messages that arrive in
    it, and the peak of memory in MB."""
    file, changes = overrides(kind, robots)
    simulation = Simulation(load(ROOT / "scenarios" / file, changes).scenario)
    simulation.graph.start()
    with rare_collections():
        simulation.kernel.run(BEGIN_S * NS_PER_S)
        before, begin_s = _counts(simulation), time.process_time()
        simulation.kernel.run(END_S * NS_PER_S)
        cpu_s = time.process_time() - begin_s
        after = _counts(simulation)
    events, arrived = ((now - then) / (END_S - BEGIN_S)
                       for now, then in zip(after, before, strict=True))
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return {"ms": 1e3 * cpu_s / (END_S - BEGIN_S), "events": events, "arrived": arrived,
            "peak_mb": peak_mb}


def _counts(simulation: Simulation) -> tuple[int, int]:
    simulation.graph.catch_up()
    arrived = sum(topic.counts.delivered for topic in simulation.graph.topics.values()
                  if topic.name.startswith("/map_exchange/"))
    return simulation.kernel.events, arrived


def fleets() -> list[Row]:
    """CPU time of a simulated second by the size of the fleet, the best of three in turns; with the
    exponent from one size to the next, and of a line through the logarithms of all."""
    turns = [{(kind, robots): _apart(kind, robots) for kind, sizes in SIZES.items()
              for robots in sizes} for _ in range(RUNS)]
    rows: list[Row] = []
    for kind, sizes in SIZES.items():
        best = [min((turn[kind, robots] for turn in turns), key=lambda run: run["ms"])
                for robots in sizes]
        costs = [run["ms"] for run in best]
        steps = ["", *(round(exponent(list(sizes[k:k + 2]), costs[k:k + 2]), 2)
                       for k in range(len(sizes) - 1))]
        for robots, run, step in zip(sizes, best, steps, strict=True):
            rows.append({"what": f"{kind}, {robots}", "robots": robots,
                         "ms a simulated s": round(run["ms"], 1),
                         "us a robot": round(1e3 * run["ms"] / robots),
                         "times real time": round(1e3 / run["ms"], 2), "exponent": step,
                         "events a s": round(run["events"]), "maps a s": round(run["arrived"]),
                         "peak MB": round(run["peak_mb"])})
        rows.append({**dict.fromkeys(rows[0], ""), "what": f"{kind}, fitted",
                     "exponent": round(exponent(list(sizes), costs), 2)})
    return rows


def exponent(sizes: list[int], costs: list[float]) -> float:
    """Of the power law nearest to ``costs`` in logarithms (least squares)."""
    slope, _ = np.polyfit(np.log(sizes), np.log(costs), 1)
    return float(slope)


def draw(rows: list[Row], path: Path) -> None:
    """The costs of ``fleets`` on two logarithmic axes, and the line that the aim allows."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    axes = figure.subplots()
    for kind, marker in zip(SIZES, "os", strict=True):
        mine = [row for row in rows if str(row["what"]).startswith(kind)]
        points = np.array([(row["robots"], row["ms a simulated s"]) for row in mine[:-1]], float)
        axes.loglog(*points.T, marker=marker, label=f"{kind}: exponent {mine[-1]['exponent']}")
        if kind == BROADCAST:
            axes.loglog(points[:, 0], points[0, 1] * (points[:, 0] / points[0, 0])**1.2,
                        linestyle=":", color="gray", label="exponent 1.2")
    axes.axhline(1e3, linewidth=0.8, color="gray")
    axes.annotate("real time", (10, 1e3), xytext=(0, 3), textcoords="offset points", color="gray")
    axes.set(xlabel="robots", ylabel="CPU ms of a simulated second")
    axes.grid(which="both", alpha=0.25)
    axes.legend()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)


def _apart(kind: str, robots: int) -> dict[str, float]:
    """``measure`` in a process of its own."""
    found: dict[str, float] = json.loads(subprocess.run(
        [sys.executable, __file__, kind, str(robots)], check=True, capture_output=True,
        text=True).stdout)
    return found


if __name__ == "__main__":
    json.dump(measure(sys.argv[1], int(sys.argv[2])), sys.stdout)

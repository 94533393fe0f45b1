"""Why do robots stand? Their reasons, by stretches of time of a run.

    python tools/measurements/standing.py SCENARIO [--set KEY=VALUE ...] [--seed N ...]

Twice a simulated second it reads the state of bodies and of navigation, which changes no run. It
prints, by stretches of time, the mean speed, the goals set and reached a second, the number of
places that robots drive to (goals within 2 m are one), and the share of robots that stand, by
reason. Then the share of way in convoy: driven within 4 m behind a teammate that drove the same
way.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections import Counter
from typing import Any

import numpy as np

from desim.engine.kernel import Phase
from desim.robot.navigation.move_base import MoveBase
from desim.scenario.load import load
from desim.simulation.simulation import Simulation

EVERY_NS = 500_000_000
STANDS_MPS = 0.05
CONVOY_M = 4.0
ONE_PLACE_M = 2.0
CONVOY_RAD = math.pi / 4.0
REASONS = ("no goal", "turns", "recovery", "blocked", "yields", "pushes", "other")


class Watch:
    """Notes of one simulation: a row each half second."""

    def __init__(self, simulation: Simulation) -> None:
        self.simulation = simulation
        self.bases: dict[str, MoveBase] = {}
        self.counts: Counter[str] = Counter()  # of trace rows by kind
        self.rows: list[dict[str, float]] = []
        self._places = simulation.world.snapshot().poses.copy()
        self._way_m = self._convoy_m = 0.0
        for plan in simulation.plan:
            host = simulation.graph.host(plan.name)
            host.software = self._catching(host.software)

    def _catching(self, make: Any) -> Any:
        def made(host: Any) -> Any:
            nodes = make(host)
            bases = [node for node in nodes if isinstance(node, MoveBase)]
            if bases:  # not on the monitor's host
                self.bases[host.name] = bases[0]
            return nodes
        return made

    def process(self) -> Any:
        while True:
            yield EVERY_NS
            self._sample()

    def _sample(self) -> None:
        poses, before = self.simulation.world.snapshot().poses, self._places
        moved_m = np.hypot(*(poses[:, :2] - before[:, :2]).T)
        self._follow(poses, moved_m)
        row = {"speed": float(moved_m.mean()) * 1e9 / EVERY_NS,
               "places": float(self._goal_places())}
        reasons: Counter[str] = Counter()
        for robot, name in enumerate(self.simulation.world.robots):
            if moved_m[robot] < STANDS_MPS * EVERY_NS / 1e9:
                reasons[self._reason(name, poses[robot, 2] - before[robot, 2])] += 1
        row |= {reason: float(reasons[reason]) for reason in REASONS}
        self.simulation.trace.flush()
        row |= {kind: float(self.counts[kind]) for kind in
                ("goal", "goal_reached", "goal_aborted", "recovery", "collision")}
        self.counts.clear()
        self.rows.append(row)
        self._places = poses.copy()

    def _goal_places(self) -> int:
        """The number of goals that are not near to one that was counted before."""
        found: list[tuple[float, float]] = []
        for base in self.bases.values():
            at = base._goal and (base._goal.x_m, base._goal.y_m)
            if at and all(math.dist(at, other) > ONE_PLACE_M for other in found):
                found.append(at)
        return len(found)

    def _reason(self, name: str, turned_rad: float) -> str:
        base = self.bases.get(name)
        if base is None or base._goal is None:
            return "no goal"
        if base._spin is not None or base._retreat_until_ns:
            return "recovery"
        if abs(math.remainder(turned_rad, 2 * math.pi)) > 0.1:
            return "turns"
        local = base._local
        if base._steering._state[0]["blocked"]:  # of the dynamic window
            return "blocked"
        if local.costmap.layer[0]["yield_m"] - local.arrays.setup[0]["safe_m"] < 0.1:
            return "yields"
        return "pushes" if local.speed_mps > 0.2 else "other"

    def _follow(self, poses: np.ndarray, moved_m: np.ndarray) -> None:
        """Add up the way driven, and that of it behind a teammate."""
        moving = moved_m > 0.3 * EVERY_NS / 1e9
        for i in np.flatnonzero(moving):
            away = poses[:, :2] - poses[i, :2]
            far_m = np.hypot(*away.T)
            bearing = np.arctan2(away[:, 1], away[:, 0]) - poses[i, 2]
            turned = poses[:, 2] - poses[i, 2]
            ahead = np.cos(bearing) > math.cos(CONVOY_RAD)
            alike = np.cos(turned) > math.cos(CONVOY_RAD)
            near = (far_m > 0.0) & (far_m < CONVOY_M) & ahead & alike & moving
            self._way_m += float(moved_m[i])
            self._convoy_m += float(moved_m[i]) if near.any() else 0.0

    def convoy_share(self) -> float:
        return self._convoy_m / max(self._way_m, 1e-9)

    def rows_of_trace(self, rows: np.ndarray) -> None:
        for row in rows:
            self.counts[self.simulation.names[int(row["kind"])]] += 1


def watched(path: str, overrides: list[str], seed: int) -> dict[str, Any]:
    box: list[Watch] = []
    simulation = Simulation(load(path, overrides, seed).scenario,
                            trace_sink=lambda rows: box[0].rows_of_trace(rows))
    watch = Watch(simulation)
    box.append(watch)
    simulation.kernel.process(watch.process(), Phase.OBSERVE, 2**30)
    begin_s = time.process_time()
    outcome = simulation.run()
    simulation.trace.flush()
    whole = Counter()
    for row in watch.rows:
        whole.update(row)
    return {"seed": seed, "time_s": outcome.simulated_ns / 1e9, "stop": outcome.stop_reason,
            "cpu_s": time.process_time() - begin_s, "rows": watch.rows,
            "convoy": watch.convoy_share(), "way_m": watch._way_m,
            **{kind: int(whole[kind]) for kind in
               ("goal", "goal_reached", "goal_aborted", "recovery", "collision")}}


def table(rows: list[dict[str, float]], robots: int) -> None:
    edges = [0, 5, 10, 15, 20, 25, 30, 45, 60, 90, 120, 180, 300, 600, 2000]
    print(f"{'s':>9} {'m/s':>5} {'goals/s':>7} {'reached':>7} {'places':>6} {'stand%':>6}  "
          + " ".join(f"{reason:>8}" for reason in REASONS))
    for low, high in zip(edges, edges[1:], strict=False):
        part = rows[2 * low:2 * high]
        if not part:
            break
        def mean(key: str, part: list[dict[str, float]] = part) -> float:
            return sum(row[key] for row in part) / len(part)
        shares = [100 * mean(reason) / robots for reason in REASONS]
        print(f"{low:>4}-{high:<4} {mean('speed'):5.2f} {2 * mean('goal'):7.1f} "
              f"{2 * mean('goal_reached'):7.1f} {mean('places'):6.1f} {sum(shares):6.0f}  "
              + " ".join(f"{share:8.1f}" for share in shares))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("scenario")
    parser.add_argument("--set", action="append", default=[], dest="overrides")
    parser.add_argument("--seed", type=int, action="append")
    parser.add_argument("--brief", action="store_true", help="a line for each seed")
    parser.add_argument("--json")
    arguments = parser.parse_args()
    results = []
    for seed in arguments.seed or [1]:
        result = watched(arguments.scenario, arguments.overrides, seed)
        robots = load(arguments.scenario, arguments.overrides, seed).scenario.fleet.size
        if not arguments.brief:
            table(result["rows"], robots)
        early = result["rows"][:50]
        print(f"seed {seed}: {result['time_s']:.0f} s ({result['stop']}), "
              f"goals {result['goal']} reached {result['goal_reached']} "
              f"aborted {result['goal_aborted']}, recoveries {result['recovery']}, "
              f"collisions {result['collision']}, way {result['way_m']:.0f} m, "
              f"in convoy {100 * result['convoy']:.0f} %, "
              f"first 25 s {np.mean([row['speed'] for row in early]):.2f} m/s, "
              f"CPU {result['cpu_s']:.1f} s", flush=True)
        results.append(result)
    if arguments.json:
        with open(arguments.json, "w") as file:
            json.dump(results, file)


if __name__ == "__main__":
    main()

"""How fast is desim on this machine? `python tools/bench.py [--json] [part ...]`.

`python tools/bench.py fleets --figure FILE` draws the cost of a robot more, too.

`python tools/bench.py compare REV [--turns N] [part ...]` runs this tree and a commit in turns and
prints what this tree costs as a share of that commit, with 95 % intervals.

`python tools/bench.py history [REV ...]` measures commits and adds what they cost to
`docs/benchmarks.csv`; without a commit it prints what is there.

`python tools/bench.py calls [--check | --write] [--functions N] [NAME ...]` counts Python calls of
workloads, and `python tools/bench.py instructions [NAME ...]` their machine instructions.

Every other figure is CPU time of one core after compilation; of short runs it is the best of
several, because other processes on the machine can only slow a run down.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import simpy
from benchmarks import air, calls, history, instructions, revisions
from benchmarks.beacons import beacons
from benchmarks.campaign import finished, overhead
from benchmarks.fleets import draw, fleets
from benchmarks.message import messages
from benchmarks.robots import PARTS_COLUMN, measuring, scans
from benchmarks.startup import startup
from benchmarks.wander import Wander, build, raster_maze
from rich.console import Console
from rich.table import Table

from desim.engine.kernel import Kernel, Phase, pair

TOOLS = Path(__file__).resolve().parent
_scratch = tempfile.TemporaryDirectory()

Row = dict[str, object]


def machine() -> Row:
    """The machine and the versions that the figures were measured with."""
    cpu = platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        models = [line.partition(":")[2].strip() for line in info.read_text().splitlines()
                  if line.startswith("model name")]
        cpu = models[0] if models else cpu
    packages = {name: version(name) for name in ("desim", "simpy", "numpy", "numba")}
    return {"cpu": cpu, "cores": os.cpu_count(), "system": platform.platform(),
            "python": platform.python_version(), **packages}


# ------------------------------------------------------------------------------------------ kernel

EVENTS = 200_000


def _simpy_timeouts() -> float:
    env, left = simpy.Environment(initial_time=0), EVENTS

    def fire(_):
        nonlocal left
        left -= 1
        if left:
            env.timeout(1).callbacks.append(fire)

    env.timeout(1).callbacks.append(fire)
    start = time.process_time()
    env.run()
    return time.process_time() - start


def _simpy_process() -> float:
    env = simpy.Environment(initial_time=0)

    def life():
        for _ in range(EVENTS):
            yield env.timeout(1)

    env.process(life())
    start = time.process_time()
    env.run()
    return time.process_time() - start


def _kernel_calls() -> float:
    kernel, left, entity = Kernel(), EVENTS, pair(2**32 - 5, 2**31)

    def fire(_):
        nonlocal left
        left -= 1
        if left:
            kernel.after(1, Phase.CONTROL, entity, fire)

    kernel.after(1, Phase.CONTROL, entity, fire)
    start = time.process_time()
    kernel.run(EVENTS)
    return time.process_time() - start


def _kernel_process() -> float:
    kernel = Kernel()

    def life():
        for _ in range(EVENTS):
            yield 1

    kernel.process(life(), Phase.CONTROL, 0)
    start = time.process_time()
    kernel.run(EVENTS)
    return time.process_time() - start


def _kernel_tickers() -> float:
    kernel, robots = Kernel(), 1000

    def tick(k):
        pass

    for robot in range(robots):
        kernel.ticker(10, Phase.CONTROL, robot, tick, start_ns=robot * 10**5)
    start = time.process_time()
    kernel.run(EVENTS // robots * 10**8 - 1)
    return time.process_time() - start


def kernel() -> list[Row]:
    """Events per second beside bare SimPy, taken in turns in the same run."""
    runs = {"SimPy: Timeout with a callback": _simpy_timeouts,
            "SimPy: one process yielding timeouts": _simpy_process,
            "desim: callback with its key": _kernel_calls,
            "desim: one generator process": _kernel_process,
            "desim: 1000 tickers": _kernel_tickers}
    best = dict.fromkeys(runs, float("inf"))
    for _ in range(7):
        for name, run in runs.items():
            best[name] = min(best[name], run())
    bare = best["SimPy: Timeout with a callback"]
    return [{"what": name, "Mevents/s": round(EVENTS / cpu_s / 1e6, 3),
             "of bare SimPy": round(bare / cpu_s, 2)} for name, cpu_s in best.items()]


# ------------------------------------------------------------------------------- laser, workload W

FLEETS = (1, 10, 30, 100)
LASER_S = 1.0  # of CPU time a figure


def _walls() -> list[tuple[str, object]]:
    """The two kinds of walls: the maze as geometry, and as an image of 0.2 m a cell."""
    return [("geometric", "maze"), ("raster", raster_maze(Path(_scratch.name)))]


def laser() -> list[Row]:
    """Laser beams per second: the fleet of W after 20 s of wandering, scanned again and again."""
    rows = []
    for walls, terrain in _walls():
        for robots in (1, 30):
            fleet = Wander(build(robots, terrain))
            fleet.seconds(20)
            snapshot, scans, spent_s = fleet.world.snapshot(), 0, 0.0
            start = time.process_time()
            while spent_s < LASER_S:
                ranges = fleet.world.scan(snapshot, fleet.all, scans)
                scans += 1
                spent_s = time.process_time() - start
            rows.append({"what": f"{walls}, {robots} robots", "Mray/s": round(
                scans * ranges.size / spent_s / 1e6, 1), "us a scan": round(
                1e6 * spent_s / scans / robots, 2)})
    return rows


def w() -> list[Row]:
    """Workload W: times real time, median of five stretches; N robots that sense and wander."""
    rows = []
    for walls, terrain in _walls():
        row: Row = {"what": walls}
        for robots in FLEETS:
            fleet = Wander(build(robots, terrain))
            fleet.seconds(5)
            simulated_s = max(2, 600 // robots)
            factors = [simulated_s / fleet.seconds(simulated_s) for _ in range(5)]
            row[f"N={robots}"] = round(statistics.median(factors), 1)
        rows.append(row)
    return rows


# ----------------------------------------------------------------------------------------- network

NS3 = {"30 saturated 802.11g stations": 0.88, "30 x 20 kB at 2/s": 4.31,  # reference/ns3, s7_speed
       # 4 s more of the runs behind ``netmodels.validation.access_points``, on this machine.
       "access point, 30 up": 1.35, "access point, 30 down": 1.12,
       "access point, 30 both": 1.29}


def network() -> list[Row]:
    """Radio: simulated seconds per CPU second through the whole medium, the best of three runs."""
    runs = {"30 saturated 802.11g stations": (lambda: air.saturated(30, 5), 5),
            "30 x 20 kB at 2/s": (lambda: air.messages(30, 2, 20), 20),
            **{f"access point, 30 {direction}": (
                partial(air.under_an_access_point, direction, 30), 30)
               for direction in ("up", "down", "both")}}
    rows = []
    for name, (run, simulated_s) in runs.items():
        factor = simulated_s / min(run() for _ in range(3))
        rows.append({"what": name, "simulated s per CPU s": round(factor, 1), "ns-3": NS3[name],
                     "times ns-3": round(factor / NS3[name], 1)})
    return rows


# --------------------------------------------------------------------------------------- scenarios

SCENARIOS = {"hello": ["hello.yaml"], "maze_8": ["maze_30.yaml", "--set", "fleet.size=8"],
             "maze_30": ["maze_30.yaml"]}


def scenarios() -> list[Row]:
    """desim run to the end, the best of three; and the CPU time by part, of one more run."""
    rows = []
    for name, (file, *options) in SCENARIOS.items():
        what = [str(TOOLS.parent / "scenarios" / file), *options]
        run = min((manifest_of(what, repetition) for repetition in range(3)),
                  key=lambda manifest: manifest["cpu_s"])
        parts = json.loads(output_of(str(TOOLS / "profile_run.py"), "--json", *what))
        rows.append({"what": name, "simulated s": round(run["simulated_s"], 1),
                     "CPU s": run["cpu_s"], "times real time": run["real_time_factor"],
                     "peak MB": run["peak_memory_mb"], "events": run["events"],
                     "parts, % of CPU": ", ".join(f"{part} {percent:g}" for part, percent
                                                  in parts["parts_percent"].items())})
    return rows


MIDDLEWARE = {"direct": ["model=direct"], "ros1": ["model=ros1"],
              "dds, fastdds": ["model=dds"], "dds, cyclonedds": ["model=dds", "preset=cyclonedds"],
              "zenoh": ["model=zenoh"]}
PRESETS = ("fkie_1_3_groovy", "fkie_1_3")


def middleware() -> list[Row]:
    """maze_30 to the end under each middleware, and fleets with a master each that split in two and
    meet again; the best of three, in turns."""
    maze = [str(TOOLS.parent / "scenarios" / "maze_30.yaml")]
    runs = {name: [*maze, *(argument for one in settings
                            for argument in ("--set", f"middleware.{one}"))]
            for name, settings in MIDDLEWARE.items()}
    cut = str(TOOLS.parent / "scenarios" / "multimaster_disconnect.yaml")
    runs |= {f"multimaster_disconnect, {preset}": [cut, "--set", f"middleware.preset={preset}"]
             for preset in PRESETS}
    turns = [{name: manifest_of(what, 0) for name, what in runs.items()} for _ in range(3)]
    best = {name: min((turn[name] for turn in turns), key=lambda run: run["cpu_s"])
            for name in runs}
    return [{"what": name, "simulated s": round(run["simulated_s"], 1), "CPU s": run["cpu_s"],
             "times real time": run["real_time_factor"], "events": run["events"],
             "of direct": "" if name not in MIDDLEWARE else round(
                 best["direct"]["real_time_factor"] / run["real_time_factor"], 2)}
            for name, run in best.items()]


# Aims of maze_30 with each localization, times real time.
LOCALIZATIONS = {"ground_truth": "", "scan_matching": "at least 20", "gmapping": "at least 8"}


def robots() -> list[Row]:
    """SLAM: CPU ms a processed scan, the best of three, by kernel; maze_30 with it, by part."""
    runs: list[Row] = []  # first, as memory is that of this process at least
    maze = str(TOOLS.parent / "scenarios" / "maze_30.yaml")
    for kind, aim in LOCALIZATIONS.items():
        what = [maze, "--set", f"robot.localization={kind}"]
        measuring(f"maze_30, {kind}: two runs")
        run = manifest_of(what, 0)
        parts = json.loads(output_of(str(TOOLS / "profile_run.py"), "--json", *what))
        percents = {part: round(percent) for part, percent in parts["parts_percent"].items()}
        runs.append({"what": f"maze_30, {kind}", "aim": aim,
                     "times real time": run["real_time_factor"],
                     "simulated s": round(run["simulated_s"], 1), "peak MB": run["peak_memory_mb"],
                     PARTS_COLUMN: ", ".join(f"{part} {percent}" for part, percent
                                             in percents.items() if percent)})
    return scans(TOOLS.parent.parent / "shared" / "reference") + runs


def campaign() -> list[Row]:
    """Cost of a campaign beside its runs: CPU of it and its workers, start included."""
    scratch = Path(_scratch.name)
    return [overhead(scratch), *finished(scratch, 200, 500), *finished(scratch, 10_000, 10)]


def manifest_of(what: list[str], repetition: int) -> dict[str, Any]:
    """The manifest of a run in a process of its own."""
    out = Path(_scratch.name) / f"run {repetition}"
    output_of("-m", "desim.cli", "run", *what, "--quiet", "--out", str(out))
    newest = max(out.glob("*/*/manifest.json"), key=lambda path: path.stat().st_mtime_ns)
    return json.loads(newest.read_text())


def output_of(*arguments: str) -> str:
    return subprocess.run([sys.executable, *arguments], check=True, capture_output=True,
                          text=True).stdout


# ------------------------------------------------------------------------------------------ report

# Scenarios early: a process that is started reports no less memory than the one that starts it.
PARTS: dict[str, Callable[[], list[Row]]] = {"kernel": kernel, "scenarios": scenarios,
                                             "middleware": middleware,
                                             "robots": robots, "message": messages, "laser": laser,
                                             "w": w, "network": network, "beacons": beacons,
                                             "campaign": campaign,
                                             "startup": startup, "fleets": fleets}


def show(title: str, rows: list[Row]) -> None:
    """One part as a table; not all rows need have all columns."""
    table = Table(title=title, title_justify="left")
    columns = dict.fromkeys(column for row in rows for column in row)
    for column in columns:
        table.add_column(column, justify="left" if column == "what" else "right")
    for row in rows:
        table.add_row(*(str(row.get(column, "")) for column in columns))
    Console(width=120).print(table)


def compare_with(arguments: list[str]) -> None:
    """``compare REV [part ...]``."""
    parser = argparse.ArgumentParser(prog="bench.py compare", description=revisions.__doc__)
    parser.add_argument("revision", metavar="REV", help="a commit, as git names it")
    parser.add_argument("parts", nargs="*", metavar="part",
                        help=f"of {', '.join(PARTS)}; default: scenarios, message")
    parser.add_argument("--turns", type=int, default=5, help="pairs of measurements (default 5)")
    wanted = parser.parse_intermixed_args(arguments)
    refuse_unknown(parser, wanted.parts)
    for part, ratios in revisions.compare(wanted.revision, wanted.parts or ["scenarios", "message"],
                                        wanted.turns):
        show(f"{part}: CPU time here / CPU time at {wanted.revision}", [
            {"what": ratio.what, "ratio": f"{ratio.mean:.3f}",
             "95 % interval": f"{ratio.low:.3f} to {ratio.high:.3f}", "turns": ratio.turns}
            for ratio in ratios])


def history_of(arguments: list[str]) -> None:
    """``history [REV ...]``."""
    parser = argparse.ArgumentParser(prog="bench.py history", description=history.__doc__)
    parser.add_argument("revisions", nargs="*", metavar="REV", help="commits, as git names them")
    parser.add_argument("--turns", type=int, default=3, help="measurements of each (default 3)")
    wanted = parser.parse_args(arguments)
    if wanted.revisions:
        simpy_us = min(_simpy_timeouts() for _ in range(3)) / EVENTS * 1e6
        history.add(time.strftime("%Y-%m-%d"), str(machine()["cpu"]), simpy_us,
                    history.measure(wanted.revisions, wanted.turns))
    rows = history.table(history.read())
    if not rows:
        raise SystemExit(f"history: no measurements in {history.FILE} yet; name a commit")
    show("CPU s of a simulated second, us of a message", rows)


def calls_of(arguments: list[str]) -> None:
    """``calls [--check | --write] [--functions N] [NAME ...]``."""
    parser = argparse.ArgumentParser(prog="bench.py calls", description=calls.__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    add_workloads(parser)
    do = parser.add_mutually_exclusive_group()
    do.add_argument("--check", action="store_true", help="fail above 1 %% more than calls.csv")
    do.add_argument("--write", action="store_true", help="write the counts into calls.csv")
    parser.add_argument("--functions", type=int, default=0, metavar="N",
                        help="list the N functions and events with most calls, too")
    wanted = parser.parse_args(arguments)
    found = {name: calls.count(name) for name in wanted.names or calls.WORKLOADS}
    totals = {name: counted.total for name, counted in found.items()}
    show(f"Python calls of {calls.UNTIL_S} s", [
        {"what": name, "calls": total, "a second": round(total / calls.UNTIL_S, 1),
         "in calls.csv": calls.committed().get(name, "")} for name, total in totals.items()])
    for name, counted in found.items() if wanted.functions else ():
        show(f"{name}: calls a second by event", calls.event_rows(counted, wanted.functions))
        show(f"{name}: calls a second of a function", calls.function_rows(counted,
                                                                         wanted.functions))
    if wanted.write:
        calls.commit(totals)
    complaints = calls.too_many(totals) if wanted.check else []
    if complaints:
        raise SystemExit("\n".join(complaints))


def instructions_of(arguments: list[str]) -> None:
    """``instructions [--from SECONDS] [--to SECONDS] [NAME ...]``."""
    parser = argparse.ArgumentParser(prog="bench.py instructions", description=instructions.__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    add_workloads(parser)
    parser.add_argument("--from", dest="start_s", type=float, default=5, metavar="SECONDS")
    parser.add_argument("--to", dest="end_s", type=float, default=10, metavar="SECONDS")
    wanted = parser.parse_args(arguments)
    for name in wanted.names or calls.WORKLOADS:
        show(f"{name}: million instructions a simulated second, {wanted.start_s:g} to "
             f"{wanted.end_s:g} s", instructions.rows(name, wanted.start_s, wanted.end_s))


def add_workloads(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("names", nargs="*", metavar="NAME", type=a_workload,
                        help=f"of {'; '.join(calls.WORKLOADS)}; default: all")


def a_workload(name: str) -> str:
    if name not in calls.WORKLOADS:
        raise argparse.ArgumentTypeError(f"unknown workload {name!r}; known: "
                                         f"{'; '.join(calls.WORKLOADS)}")
    return name


def refuse_unknown(parser: argparse.ArgumentParser, parts: list[str]) -> None:
    unknown = sorted(name for name in parts if name not in PARTS)
    if unknown:
        parser.error(f"unknown part {', '.join(unknown)}; known: {', '.join(PARTS)}")


def main() -> None:
    commands = {"compare": compare_with, "history": history_of, "calls": calls_of,
                "instructions": instructions_of}
    if sys.argv[1:] and sys.argv[1] in commands:
        commands[sys.argv[1]](sys.argv[2:])
        return
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", metavar="part",
                        help=f"of {', '.join(PARTS)}; default: all")
    parser.add_argument("--json", action="store_true", help="JSON instead of tables")
    parser.add_argument("--figure", type=Path, metavar="FILE", help="draw the part fleets, too")
    arguments = parser.parse_args()
    refuse_unknown(parser, arguments.parts)
    result: dict[str, object] = {"machine": machine()}
    for name in arguments.parts or PARTS:
        result[name] = rows = PARTS[name]()
        if arguments.figure is not None and name == "fleets":
            draw(rows, arguments.figure)
        if not arguments.json:
            show((PARTS[name].__doc__ or name).splitlines()[0], rows)
    if arguments.json:
        json.dump(result, sys.stdout, indent=2)
        print()
    else:
        print(", ".join(f"{key} {value}" for key, value in result["machine"].items()))


if __name__ == "__main__":
    main()

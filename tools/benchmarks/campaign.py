"""What does a campaign cost besides its runs? For `tools/bench.py campaign`."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from pathlib import Path

from benchmarks.many_runs import make
from desim.campaign.design.design import load_design
from desim.campaign.design.plan import Plan

HELLO = Path(__file__).resolve().parents[2] / "scenarios" / "hello.yaml"
TINY = """\
name: tiny
base: {base}
set: {{stop.elapsed: 100 ms, robot.laser.beams: 20}}
parameters: {{robots: {{key: fleet.size, values: [1, 2]}}}}
iterations: {iterations}
"""
MANY = """\
name: many
base: {base}
set: {{stop.elapsed: 100 ms}}
parameters:
  robots: {{key: fleet.size, values: [1, 2]}}
  range: {{key: robot.laser.max_range, from: 1 m, to: 50 m, count: {ranges}}}
iterations: {iterations}
"""


def overhead(scratch: Path, runs: int = 1000) -> dict[str, object]:
    """Tiny runs by one worker: CPU of the whole campaign but for what its runs say they took."""
    design = scratch / "tiny.yaml"
    design.write_text(TINY.format(base=HELLO, iterations=runs // 2))
    cpu_s, wall_s = _swept(design, scratch / "tiny")
    own_s = sum(json.loads(line)["cost"]["cpu_s"] for line in
                (scratch / "tiny" / "index.jsonl").read_text().splitlines())
    return _row(f"{runs} tiny runs, 1 job", cpu_s, wall_s, round(own_s / runs * 1e3, 1),
                round((cpu_s - own_s) / runs * 1e3, 1))


def finished(scratch: Path, vectors: int, iterations: int) -> list[dict[str, object]]:
    """A campaign whose runs are all finished: to its table, and to its report."""
    design = scratch / "many.yaml"
    design.write_text(MANY.format(base=HELLO, ranges=vectors // 2, iterations=iterations))
    out = scratch / f"many_{vectors}"
    count = make(Plan(load_design(design)), out)
    return [_row(f"{what} {count} finished runs of {vectors} vectors", *measured) for what, measured
            in (("resume", _swept(design, out)), ("report", _used("report", str(out))))]


def _row(what: str, cpu_s: float, wall_s: float, own_ms: object = "",
         overhead_ms: object = "") -> dict[str, object]:
    return {"what": what, "CPU s": round(cpu_s, 1), "wall s": round(wall_s, 1),
            "ms a run": own_ms, "overhead ms a run": overhead_ms}


def _swept(design: Path, out: Path) -> tuple[float, float]:
    return _used("sweep", str(design), "--out", str(out), "--jobs", "1")


def _used(*command: str) -> tuple[float, float]:
    """Seconds of CPU of a command, workers included, and of the clock."""
    def used_s() -> float:
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime

    before_s, begin_s = used_s(), time.perf_counter()
    subprocess.run([sys.executable, "-m", "desim.cli", *command, "--quiet"], check=True)
    return used_s() - before_s, time.perf_counter() - begin_s

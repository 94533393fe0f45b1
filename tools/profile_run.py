"""Where does the CPU time of a run go? `python tools/profile_run.py scenarios/maze_30.yaml`.

Samples the innermost frame that is desim's own about every millisecond of CPU time. A sample
weighs the CPU time since the last one, so that a long kernel call counts in full although Python
sees the signal only at its end.
"""

from __future__ import annotations

import argparse
import json
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

from rich.console import Console
from rich.table import Table

import desim

ROOT = Path(desim.__file__).resolve().parent.parent
EVERY_S = 0.001
ENTRY = 4  # the last offset in a function's code at which it has only just begun

# The first prefix that fits names the part.
PARTS = [
    ("desim/world/lidar", "laser"),
    ("desim/world", "world"),
    ("desim/simulation/drivers", "drivers"),
    ("desim/simulation/world_events", "drivers"),
    ("desim/robot/sharing", "sharing"),
    ("desim/robot/mapping/robot_map.py:RobotMap.receive", "sharing"),
    ("desim/robot/mapping/robot_map", "grids"),
    ("desim/robot/mapping/tiles", "grids"),
    ("desim/robot/navigation", "navigation"),
    ("desim/robot/coordination", "exploration"),
    ("desim/robot", "mapping"),
    ("desim/middleware", "middleware"),
    ("desim/engine/kernel.py", "kernel"),
    ("desim/engine/trace.py", "trace"),
    ("desim/monitor", "monitor"),
    ("desim/network", "network"),
    ("netmodels", "network"),
    ("desim", "other"),
]


class Profile:
    """CPU seconds by part, and by function (file:name)."""

    def __init__(self) -> None:
        self.parts: Counter[str] = Counter()
        self.functions: Counter[str] = Counter()

    def start(self) -> None:
        self._last_s = time.process_time()

    def sample(self, _signal: int, frame: FrameType | None) -> None:
        now_s = time.process_time()
        spent_s, self._last_s = now_s - self._last_s, now_s
        # Python looks at signals where a function begins: the time was the caller's then.
        if frame is not None and frame.f_lasti <= ENTRY:
            frame = frame.f_back
        while frame is not None:
            code = frame.f_code
            path = code.co_filename.removeprefix(f"{ROOT}/")
            function = f"{path}:{code.co_qualname}"
            for prefix, part in PARTS:
                if function.startswith(prefix):
                    self.parts[part] += spent_s
                    self.functions[function] += spent_s
                    return
            frame = frame.f_back
        self.parts["other"] += spent_s


@contextmanager
def sampling(profile: Profile) -> Iterator[None]:
    """Samples while the block runs."""
    profile.start()
    before = signal.signal(signal.SIGPROF, profile.sample)
    signal.setitimer(signal.ITIMER_PROF, EVERY_S, EVERY_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def measure(path: str, overrides: list[str], until: str | None) -> dict[str, object]:
    """Run a scenario as ``desim run`` does, into a folder that is thrown away. Parts are those of
    the time in which the clock ran (``clock_cpu_s``), without building and writing."""
    if until is not None:
        overrides = [*overrides, f"stop.elapsed={until}"]
    loaded = desim.load(path, overrides)
    profile = Profile()
    with tempfile.TemporaryDirectory() as out:
        run = desim.run(loaded, out=out, watch=lambda *_: sampling(profile))
        manifest, metrics = run.manifest, run.metrics
    total_s = sum(profile.parts.values())
    return {
        "scenario": loaded.scenario.name,
        **{key: manifest[key] for key in ("simulated_s", "cpu_s", "real_time_factor",
                                          "peak_memory_mb", "events", "digest")},
        "stop_reason": metrics["stop_reason"],
        "clock_cpu_s": round(total_s, 3),
        "parts_percent": {part: round(100 * spent_s / total_s, 1)
                          for part, spent_s in profile.parts.most_common()},
        "functions_percent": {name: round(100 * spent_s / total_s, 1)
                              for name, spent_s in profile.functions.most_common(25)},
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenario")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--until", metavar="DURATION", help="of simulated time, e.g. 60s")
    parser.add_argument("--json", action="store_true", help="JSON instead of tables")
    arguments = parser.parse_args()
    result = measure(arguments.scenario, arguments.set, arguments.until)
    if arguments.json:
        json.dump(result, sys.stdout, indent=2)
        print()
        return
    for title in ("parts_percent", "functions_percent"):
        table = Table(title=title, title_justify="left", show_header=False)
        for name, percent in result.pop(title).items():
            table.add_row(name, f"{percent:.1f}")
        Console(width=120).print(table)
    print(", ".join(f"{key} {value}" for key, value in result.items()))


if __name__ == "__main__":
    main()

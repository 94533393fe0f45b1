"""What do robots' own nodes cost? A scan that SLAM processes, by kernel.

On a made log of a ring of corridors as wide as the maze's, and, where the reference data are
present, on MIT-CSAIL with every second beam and with openslam's setting.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import NamedTuple
from unittest.mock import patch

from desim.compiler.kernel import CompiledKernel
from desim.engine.streams import Streams
from desim.imports.slam_logs.carmen import read_carmen
from desim.imports.slam_logs.laser_log import LaserLog
from desim.imports.slam_logs.slam_trial import play
from desim.ports import Pose2D
from desim.robot.slam import particle_filter, shared_maps
from desim.robot.slam.kinds import SLAM
from desim.robot.slam.settings import SlamSettings

ROOT = Path(__file__).resolve().parents[2]
REAL_LOG = Path("slam") / "mit-csail.log.gz"  # of the reference data
WARM_UP, TURNS = 30, 3
OPENSLAM = "295 ms"  # reference/slam: C++, 30 particles, 361 beams, cells of 5 cm, this log
AIMS = {"scan_matching": "at most 0.5", "gmapping": "at most 2"}  # ms, with 180 beams and 0.2 m
PARTS_COLUMN = "parts, % of CPU"

Row = dict[str, object]


class Setting(NamedTuple):
    """A log, and the width of a cell to map it with."""

    name: str
    log: LaserLog
    resolution_m: float


def made_ring() -> LaserLog:
    """Once around a block in corridors 8 m wide, with the laser of the maze: 180 beams, 26 m."""
    sys.path.append(str(ROOT / "tests"))
    from slam_logs import Laser, made_log, ring, way

    return made_log(ring(60.0, 50.0, 8.0),
                    way([(4, 4), (56, 4), (56, 46), (4, 46), (4, 4)], step_m=0.25),
                    Laser(180, 190.0, 26.0))


def every_second_beam(log: LaserLog) -> LaserLog:
    """180 beams of 361, 1 degree apart."""
    return log._replace(ranges=log.ranges[:, :-1:2].copy(),
                        laser=log.laser._replace(increment_rad=2.0 * log.laser.increment_rad))


def settings(reference: Path) -> list[Setting]:
    """The logs that are measured: one or, with ``reference`` data, three."""
    found = [Setting("made ring, 180 beams, 0.2 m", made_ring(), 0.2)]
    if (reference / REAL_LOG).exists():
        real = read_carmen(reference / REAL_LOG)
        found += [Setting("MIT-CSAIL, 180 beams, 0.2 m", every_second_beam(real), 0.2),
                  Setting("MIT-CSAIL, 361 beams, 0.05 m", real, 0.05)]
    return found


def scans(reference: Path) -> list[Row]:
    """CPU ms a processed scan, the best of three plays, and the share of each kernel."""
    return [row for setting in settings(reference) for row in map(partial(_row, setting), SLAM)]


def measuring(what: str) -> None:
    """Say what is measured now: it takes up to minutes."""
    print(f"measuring {what}", file=sys.stderr, flush=True)


def _row(setting: Setting, kind: str) -> Row:
    measuring(f"{setting.name}, {kind}: {TURNS} plays")
    log = setting.log
    chosen = SlamSettings(resolution_m=setting.resolution_m, laser=log.laser)
    new = partial(SLAM[kind], chosen, Streams(1).key("slam"))
    play(new(), log.first(WARM_UP), time.process_time)  # compiles
    played = [play(new(), log, time.process_time).cpu_s for _ in range(TURNS)]
    best_s = min(played, key=lambda cpu_s: float(cpu_s.sum()))
    ms = round(1e3 * float(best_s.mean()), 3)
    row: Row = {"what": f"{kind}, {setting.name}", "ms a scan": ms}
    if setting.resolution_m == 0.2:
        row["aim"] = AIMS[kind]
    elif kind == "gmapping":
        row["openslam"] = OPENSLAM
    return row | {PARTS_COLUMN: parts(new, log)}


def parts(new: Callable[[], particle_filter.ParticleSlam], log: LaserLog) -> str:
    """The share of each kernel in the time of processed scans; Python is what is left."""
    with timed_kernels() as spent_s:
        whole_s = 0.0
        slam = new()
        for odometry, ranges in zip(log.odometry, log.ranges, strict=True):
            if slam.advance(Pose2D(*odometry.tolist())):
                begin_s = time.process_time()
                slam.process(ranges)
                whole_s += time.process_time() - begin_s
    spent_s["Python"] = whole_s - sum(spent_s.values())
    percents = {name: round(100 * cpu_s / whole_s) for name, cpu_s in spent_s.most_common()}
    return ", ".join(f"{name} {percent}" for name, percent in percents.items() if percent)


@contextmanager
def timed_kernels() -> Iterator[Counter[str]]:
    """The CPU seconds by name of the kernels that SLAM calls meanwhile."""
    spent_s: Counter[str] = Counter()

    def timed(kernel: CompiledKernel) -> Callable[..., object]:
        def called(*arguments: object) -> object:
            begin_s = time.process_time()
            answer = kernel.function(*arguments)
            spent_s[kernel.__name__] += time.process_time() - begin_s
            return answer
        return called

    patches = [patch.dict(vars(module), {name: timed(value) for name, value in vars(module).items()
                                         if isinstance(value, CompiledKernel)})
               for module in (particle_filter, shared_maps)]
    for each in patches:
        each.start()
    try:
        yield spent_s
    finally:
        for each in patches:
            each.stop()

"""Measures the script of a replay's frames in Chromium, without a window.

    python tools/replay_frames.py RUN [RUN] [--from 10] [--seconds 8] [--speed 2]

It plays the replay of one run or two and prints the milliseconds of script per frame.
docs/replay.md has figures.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
from pathlib import Path

from devtools import Browser, chromium

from desim.api import recording_of
from desim.report.replay.page import write
from desim.results.run import Run


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN")
    parser.add_argument("--from", dest="begin_s", type=float, default=10.0)
    parser.add_argument("--seconds", type=float, default=8.0, help="how long it plays")
    parser.add_argument("--speed", type=float, default=2.0)
    arguments = parser.parse_args()
    if chromium() is None:
        raise SystemExit("there is no Chromium")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        page = Path(folder) / "replay.html"
        write([recording_of(Run(run)) for run in arguments.runs], page)
        print(f"page: {page.stat().st_size / 1e6:.2f} MB")
        with Browser(Path(folder) / "profile") as browser:
            browser.open(page)
            browser.value(f"desimReplay.at({arguments.begin_s})")
            frames_ms = sorted(browser.value(
                f"desimReplay.measured({arguments.speed}, {arguments.seconds})"))
    print(f"{len(frames_ms)} frames: mean {statistics.mean(frames_ms):.1f} ms, median "
          f"{statistics.median(frames_ms):.1f} ms, 95 % below "
          f"{frames_ms[int(0.95 * len(frames_ms))]:.1f} ms, longest {frames_ms[-1]:.1f} ms")


if __name__ == "__main__":
    main()

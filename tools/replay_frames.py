"""Measures the script of a replay's frames in Chromium, without a window.

    python tools/replay_frames.py RUN [RUN] [--from 10] [--seconds 8] [--speed 2]

It plays the replay of one run or two and prints the milliseconds of script per frame. Then it steps
through the same seconds, at 60 frames a second of the viewer's time, several times and prints the
least that each frame took: what other processes of the machine took meanwhile is not in it.
docs/replay.md has figures.
"""

from __future__ import annotations

import argparse
import os
import statistics
import tempfile
from collections.abc import Sequence
from pathlib import Path

from devtools import Browser, chromium

from desim.api import recording_of
from desim.report.replay.page import write
from desim.results.run import Run

FRAME_S = 1 / 60
PASSES = 4
# Frames from an instant on, drawn as while it plays, each in a frame of the browser.
STEPPED = """(async (beginS, stepS, count) => {
    const { app } = desimReplay, times = [];
    app.player.playing = false;
    for (let k = 0; k < count; k++) {
        await new Promise((resolve) => requestAnimationFrame(resolve));
        app.player.seek(beginS + k * stepS);
        app.player.playing = true;
        times.push(desimReplay.draw());
        app.player.playing = false;
    }
    return times; })"""


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
        print(f"page: {page.stat().st_size / 1e6:.2f} MB; load {os.getloadavg()[0]:.1f}")
        with Browser(Path(folder) / "profile") as browser:
            browser.open(page)
            browser.value(f"desimReplay.at({arguments.begin_s})")
            show("played", browser.value(
                f"desimReplay.measured({arguments.speed}, {arguments.seconds})"))
            count = int(arguments.seconds / FRAME_S)
            passes = [browser.value(f"{STEPPED}({arguments.begin_s}, {arguments.speed * FRAME_S}, "
                                    f"{count})") for _ in range(PASSES)]
            show(f"least of {PASSES}", list(map(min, *passes)))


def show(how: str, frames_ms: Sequence[float]) -> None:
    """Print the mean and the ranks of the frames' times."""
    ranked = sorted(frames_ms)
    print(f"{how}: {len(ranked)} frames: mean {statistics.mean(ranked):.1f} ms, "
          f"median {statistics.median(ranked):.1f} ms, "
          f"95 % below {ranked[int(0.95 * len(ranked))]:.1f} ms, longest {ranked[-1]:.1f} ms")


if __name__ == "__main__":
    main()

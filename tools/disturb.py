"""Does a campaign survive being killed? `python tools/disturb.py [--times 20] [--seed 1]`.

At a random moment, in turns: the campaign is killed (SIGKILL), one of its workers is killed, or its
disk is filled up to a few kilobytes (a small tmpfs; left out where none can be mounted). Then the
campaign is started again. After each of these no finished run may be lost or made again and no file
may be damaged; in the end ``runs.parquet`` must have the same bytes as that of an undisturbed
campaign. Otherwise the exit code is 1, and the fault is printed.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pyarrow.parquet as pq

from desim.results.run import Run

SCENARIO = """\
name: small
environment: {terrain: {size: [12 m, 12 m], drawing: {cell: 4 m, lines: [
  "+--+--+--+", "|     |  |", "+  +  +  +", "|  |     |",
  "+  +--+  +", "|        |", "+--+--+--+"]}}}
fleet: {size: 2, start: {from: [-4 m, 4 m], step: [2 m, 0 m]}}
stop: {elapsed: 1 s}
"""
DESIGN = """\
name: disturbed
base: small.yaml
parameters: {robots: {key: fleet.size, values: [1, 2, 3]}}
iterations: %d
"""
DISK_BYTES = 64 * 2**20
JOBS = 2


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--times", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--runs", type=int, default=300)
    arguments = parser.parse_args()
    # In the background of a shell it is ignored, and so it would be by the campaigns.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    with tempfile.TemporaryDirectory() as folder, disk(Path(folder) / "disk") as full:
        (Path(folder) / "small.yaml").write_text(SCENARIO)
        design = Path(folder) / "design.yaml"
        design.write_text(DESIGN % -(-arguments.runs // 3))
        reference = Path(folder) / "undisturbed"
        finish(started(design, reference), 0)
        campaign = Campaign(design, Path(folder) / "disk" / "out", reference)
        kinds = ["campaign", "worker", "disk"] if full else ["campaign", "worker"]
        stream = random.Random(arguments.seed)
        for number in range(arguments.times):
            kind = kinds[number % len(kinds)]
            campaign.disturb(kind, stream)
            print(f"{number + 1:3} {kind:8} {len(campaign.finished):4} of {campaign.total} runs "
                  "finished, none lost, none damaged", flush=True)
        campaign.complete()
    if not full:
        print("no tmpfs could be mounted here: the disk was never full")
    print("the same runs.parquet")
    return 0


class Campaign:
    """The disturbed campaign; ``finished`` are the times at which its runs ended, by run id."""

    def __init__(self, design: Path, out: Path, reference: Path) -> None:
        self._design, self._out, self._reference = design, out, reference
        self._digests = {run.name: Run(run).manifest["digest"]
                         for run in (reference / "runs" / "small").iterdir()}
        self.total = len(self._digests)
        self.finished: dict[str, int] = {}

    def disturb(self, kind: str, stream: random.Random) -> None:
        """Start the campaign, harm it, await its end, and check what is left."""
        process = started(self._design, self._out)
        try:
            self._harm(process, kind, stream)
        finally:
            process.kill()
        self._check()

    def _harm(self, process: subprocess.Popen, kind: str, stream: random.Random) -> None:
        if kind != "campaign" or stream.random() < 0.7:  # else while it starts
            self._await(process, stream.randrange(1, max(self.total // 30, 2)))
        time.sleep(stream.random() * (0.05 if kind != "campaign" else 0.5))
        if kind == "campaign":
            process.kill()
            finish(process, -signal.SIGKILL)
        elif kind == "worker":
            kill_one_of(children(process.pid), stream)
            self._await(process, 3)  # it goes on
            process.send_signal(signal.SIGINT)
            finish(process, 130, 0)
        else:
            with filled(self._out.parent, stream.randrange(200_000)):
                finish(process, 2, 0)

    def complete(self) -> None:
        """Finish the campaign, undisturbed."""
        finish(started(self._design, self._out), 0)
        self._check()
        require(len(self.finished) == self.total, "runs are missing")
        require((self._out / "runs.parquet").read_bytes() ==
                (self._reference / "runs.parquet").read_bytes(), "another runs.parquet")

    def _await(self, process: subprocess.Popen, more: int) -> None:
        """Wait until some more runs are finished, or all of them."""
        wanted = min(len(self._runs()) + more, self.total)
        while process.poll() is None and len(self._runs()) < wanted:
            time.sleep(0.002)

    def _runs(self) -> list[Path]:
        folder = self._out / "runs" / "small"
        return [path for path in folder.iterdir() if "." not in path.name] if folder.exists() \
            else []

    def _check(self) -> None:
        now = {run.name: (run / "manifest.json").stat().st_mtime_ns for run in self._runs()}
        for run_id, time_ns in self.finished.items():
            require(run_id in now, f"{run_id} is lost")
            require(now[run_id] == time_ns, f"{run_id} was made again")
        for path in self._runs():
            run = Run(path)
            require(run.manifest["digest"] == self._digests[path.name], f"{path}: another digest")
            require(bool(run.metrics) and run.map is not None and run.truth is not None,
                    f"{path}: incomplete")
            for table in path.glob("*.parquet"):
                pq.read_table(table)
        if (self._out / "runs.parquet").exists():
            pq.read_table(self._out / "runs.parquet")
        index = self._out / "index.jsonl"
        for line in (index.read_bytes() if index.exists() else b"").split(b"\n")[:-1]:
            json.loads(line)
        self.finished = now


def started(design: Path, out: Path) -> subprocess.Popen:
    return subprocess.Popen(
        [sys.executable, "-m", "desim.cli", "sweep", str(design), "--out", str(out),
         "--jobs", str(JOBS), "--quiet"], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
        text=True)


def finish(process: subprocess.Popen, *codes: int) -> None:
    """Wait for its end, which has one of these exit codes and never a traceback."""
    workers = children(process.pid) if process.poll() is None else []
    _, errors = process.communicate()
    require(process.returncode in codes, f"exit code {process.returncode}: {errors}")
    require("Traceback" not in errors, errors)
    for worker in workers:
        while Path(f"/proc/{worker}").exists():  # it leaves when it sees that nobody listens
            time.sleep(0.002)


def children(pid: int) -> list[int]:
    try:
        return [int(child) for child in
                Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    except OSError:
        return []


def kill_one_of(pids: list[int], stream: random.Random) -> None:
    if pids:
        try:
            os.kill(stream.choice(pids), signal.SIGKILL)
        except ProcessLookupError:
            return


@contextmanager
def disk(folder: Path) -> Iterator[bool]:
    """A small disk, if one can be mounted."""
    folder.mkdir()
    mounted = not subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={DISK_BYTES}", "tmpfs",
                                  str(folder)], capture_output=True).returncode
    try:
        yield mounted
    finally:
        if mounted:
            subprocess.run(["umount", "--lazy", str(folder)], check=True)


@contextmanager
def filled(folder: Path, left_bytes: int) -> Iterator[None]:
    """The disk without room for more."""
    ballast = folder / "ballast"
    with open(ballast, "wb", buffering=0) as file:
        try:
            while True:
                file.write(bytes(2**16))
        except OSError:
            file.truncate(max(file.tell() - left_bytes, 0))
    try:
        yield
    finally:
        ballast.unlink()


def require(holds: bool, text: str) -> None:
    if not holds:
        sys.exit(f"WRONG: {text}")


if __name__ == "__main__":
    sys.exit(main())

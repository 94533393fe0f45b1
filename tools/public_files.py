"""Do public files of other programs still give what docs/public_files.csv says?

    python tools/public_files.py FOLDER [--only WORD] [--write]

FOLDER has each repository as OWNER+NAME, with the files at their paths: `git clone
https://github.com/OWNER/NAME FOLDER/OWNER+NAME`, and `git checkout` of the table's commit. Each
row's command runs in its repository's folder, and what has changed is printed. --only takes the
rows that have a word, --write keeps what is found now in the table. Rows without a file are counted
and skipped. Exit code 1 if a finding has changed.
"""

from __future__ import annotations

import argparse
import csv
import json
import shlex
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

TABLE = Path(__file__).resolve().parent.parent / "docs" / "public_files.csv"
# -P: no module comes from the repository in whose folder it runs.
DESIM = (sys.executable, "-P", "-c", "from desim.cli import app; app()")
LONGEST = 160  # letters of a refusal in the table
SECONDS = 900  # a command that takes longer counts as one that found nothing


def found_by(command: str, folder: Path) -> str:
    """The finding of a command that runs in a folder, in a few words."""
    words = shlex.split(command)
    with TemporaryDirectory() as results:
        more = {"map": ["--json"], "robot": ["--json"], "import": ["--out", results],
                "slam": ["--json", "--to", f"{results}/map.png"]}[words[0]]
        try:
            done = subprocess.run([*DESIM, *words, *more], cwd=folder, capture_output=True,
                                  text=True, check=False, timeout=SECONDS)
        except subprocess.TimeoutExpired:
            return f"nothing in {SECONDS} s"
    if done.returncode:
        text = done.stderr.replace(f"{folder.resolve()}/", "").strip()
        return f"exit code {done.returncode}: {text.splitlines()[0][:LONGEST] if text else ''}"
    if words[0] == "import":
        return done.stdout.splitlines()[0]
    known = json.loads(done.stdout)
    return {"map": of_terrain, "robot": of_robot, "slam": of_log}[words[0]](known)


def of_terrain(known: dict) -> str:
    """Size, free ground and doors of a terrain."""
    doors = f", {known['doors']} doors" if known["doors"] else ""
    return (f"{known['width_m']:.4g} x {known['depth_m']:.4g} m, {known['free_m2']:.4g} m2 free"
            f"{doors}")


def of_robot(known: dict) -> str:
    """Body, speeds and lasers of a robot; of a robot without them the keys that are read."""
    read = {key: value for key, (value, _) in known["read"].items()}
    parts = []
    if "footprint" in read:
        spans = [sorted(float(corner[axis].split()[0]) for corner in read["footprint"])
                 for axis in (0, 1)]
        parts.append(" x ".join(f"{span[-1] - span[0]:.3g}" for span in spans) + " m")
    parts += [f"{key} {short(read[key])}" for key in ("radius", "max_speed", "max_turn")
              if key in read]
    lasers = {key.rpartition(".")[0] for key in read if key.startswith("robot.laser")}
    parts += [f"{laser.rpartition('.')[2]} {short(read.get(f'{laser}.max_range', ''))}".strip()
              for laser in sorted(lasers)]
    return ", ".join(parts or read)


def of_log(known: dict) -> str:
    """The number of processed scans of a log."""
    return f"{known['processed']} scans processed"


def short(value: str) -> str:
    """A quantity with three digits."""
    number, _, unit = value.partition(" ")
    return f"{float(number):.3g} {unit}" if number else ""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run all rows whose files are there, and print those whose finding has changed."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--table", type=Path, default=TABLE)
    parser.add_argument("--only", default="", metavar="WORD")
    parser.add_argument("--write", action="store_true")
    given = parser.parse_args(arguments)
    with given.table.open(newline="") as file:
        rows = list(csv.DictReader(file))
    chosen = [row for row in rows if given.only in ",".join(row.values())]
    changed = skipped = 0
    for row in chosen:
        folder = given.folder / row["repository"].replace("/", "+", 1)
        if not (folder / row["path"]).exists():
            skipped += 1
            continue
        found = found_by(row["command"], folder)
        if found != row["found"]:
            changed += 1
            print(f"{row['repository']}: desim {row['command']}\n  was  {row['found']}\n"
                  f"  now  {found}", flush=True)
            row["found"] = found
    print(f"{len(chosen)} rows, {changed} changed, {skipped} without a file")
    if given.write:
        with given.table.open("w", newline="") as file:
            writer = csv.DictWriter(file, rows[0], lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
    return int(changed > 0)


if __name__ == "__main__":
    sys.exit(main())

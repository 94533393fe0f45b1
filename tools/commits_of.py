"""Which commits have the source that made a run? Prints them, the newest first.

    python tools/commits_of.py SOURCE [--among N]

SOURCE is what a run's manifest and the column ``desim`` of a campaign's table and of the
leaderboard name it by. It is sought among the last N commits that changed desim or netmodels (200),
one second for each, up to the oldest of a row of commits that have it. A run with a plug-in of
somebody else has a source that no commit has. Exit code 1 if none is found.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("desim", "netmodels")
ASK = "import netmodels; from desim.results.identity import source; print(source(('netmodels',)))"


def git(*arguments: str) -> bytes:
    """The output of git in the checkout."""
    return subprocess.run(["git", "-C", str(ROOT), *arguments], check=True,
                          capture_output=True).stdout


def source_of(commit: str) -> str:
    """The hash of a commit's source, as that commit itself computes it; empty where it has none."""
    with TemporaryDirectory() as folder:
        subprocess.run(["tar", "-x", "-C", folder], input=git("archive", commit, *PACKAGES),
                       check=True)
        return subprocess.run([sys.executable, "-c", ASK], cwd=folder, text=True,
                              capture_output=True, check=False,
                              env={**os.environ, "PYTHONPATH": folder}).stdout.strip()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("source", metavar="SOURCE")
    parser.add_argument("--among", metavar="N", type=int, default=200)
    arguments = parser.parse_args()
    found = 0
    for line in git("log", f"-n{arguments.among}", "--format=%h %cs %s", "--",
                    *PACKAGES).decode().splitlines():
        if source_of(line.partition(" ")[0]) == arguments.source:
            print(line, flush=True)
            found += 1
        elif found:
            break
    return int(not found)


if __name__ == "__main__":
    sys.exit(main())

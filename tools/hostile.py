"""No file of a stranger runs code, takes much, or ends a command with a traceback.

    python tools/hostile.py [--count 200] [--first 0]

Each hostile file or folder (``hostile_files.py``) meets commands that read it, each in a process
with limits and an audit hook (``guarded.py``). A table of the outcomes is printed; the exit code is
1 if one is wrong.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

from guarded import CPU_S, MEMORY_BYTES, measured

HERE = Path(__file__).parent


def play(numbers: range) -> tuple[Counter[tuple[str, str]], list[str]]:
    """Outcomes by kind, and a line for each that is wrong."""
    counts: Counter[tuple[str, str]] = Counter()
    wrong, most_bytes, most_s = [], 0, 0.0
    with tempfile.TemporaryDirectory(prefix="desim_hostile_") as top:
        base_bytes = measured(Path(top), ["--version"], 0).memory_bytes
        for number in numbers:
            with tempfile.TemporaryDirectory(dir=top) as name:
                folder = Path(name)
                (folder / "out").mkdir()
                kind, commands = json.loads(subprocess.run(
                    [sys.executable, str(HERE / "hostile_files.py"), name, str(number)],
                    stdout=subprocess.PIPE, check=True).stdout)
                for words in commands:
                    end = measured(folder, words, base_bytes)
                    most_bytes = max(most_bytes, end.memory_bytes)
                    most_s = max(most_s, end.cpu_s)
                    counts[kind, end.wrong or f"exit {end.code}"] += 1
                    if end.wrong:
                        wrong.append(
                            f"{number} {kind}: {end.wrong}, exit {end.code}, {end.cpu_s:.1f} s, "
                            f"{end.memory_bytes / 1e6:.0f} MB: {end.said[-300:].strip()}")
                        print(wrong[-1], flush=True)
    print(f"at most {most_s:.1f} s of CPU (limit {CPU_S}), {most_bytes / 1e6:.0f} MB above a "
          f"command at rest (limit {MEMORY_BYTES / 1e6:.0f})")
    return counts, wrong


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--first", type=int, default=0)
    arguments = parser.parse_args()
    counts, wrong = play(range(arguments.first, arguments.first + arguments.count))
    for (kind, end), count in sorted(counts.items()):
        print(f"{kind:12} {end:12} {count:4}")
    return 1 if wrong else 0


if __name__ == "__main__":
    raise SystemExit(main())

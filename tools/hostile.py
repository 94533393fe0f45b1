"""No file or folder of a stranger runs code, takes much, changes others, or ends in a traceback.

Each hostile file or folder (``hostile_files.py``) meets commands that read it, each in a process
with limits and an audit hook (``guarded.py``). ``tools/fuzz.py hostile`` plays them.
"""

from __future__ import annotations

import subprocess
import tempfile
from collections import Counter
from pathlib import Path

from guarded import CPU_S, MEMORY_BYTES, Guard
from hostile_files import KINDS as _KINDS

KINDS = [*_KINDS]


def play(kinds: list[str], numbers: range) -> int:
    """Play these cases and print those that are wrong, the outcomes by kind, and what was most;
    returns the number of wrong ones. A number stands for one kind."""
    counts: Counter[tuple[str, str]] = Counter()
    most: dict[str, tuple[float, int]] = dict.fromkeys(kinds, (0.0, 0))
    with tempfile.TemporaryDirectory(prefix="desim_hostile_") as top, Guard() as guard:
        for number in numbers:
            kind = kinds[number % len(kinds)]
            folder = Path(top) / "case"
            for words in guard.made(folder, kind, number):
                end = guard.measured(folder, words)
                most[kind] = (max(most[kind][0], end.cpu_s), max(most[kind][1], end.memory_bytes))
                counts[kind, end.wrong or f"exit {end.code}"] += 1
                if end.wrong:
                    print(f"--only {kind} --first {number} --count 1: {' '.join(words)}: "
                          f"{end.wrong}, exit {end.code}, {end.cpu_s:.1f} s, "
                          f"{end.memory_bytes / 1e6:.0f} MB: {end.said[-500:].strip()}", flush=True)
            subprocess.run(["rm", "-rf", str(folder)], check=True)  # it may be too deep for Python
    for (kind, end), count in sorted(counts.items()):
        print(f"{kind:16} {end:12} {count:4}")
    for kind, (cpu_s, memory_bytes) in most.items():
        print(f"{kind:16} at most {cpu_s:4.1f} s of CPU (limit {CPU_S}), {memory_bytes / 1e6:3.0f} "
              f"MB above a command at rest (limit {MEMORY_BYTES / 1e6:.0f})")
    return sum(count for (_, end), count in counts.items() if not end.startswith("exit "))


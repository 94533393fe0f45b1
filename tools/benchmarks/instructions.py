"""How many machine instructions does a simulated second take, and where?

    python tools/bench.py instructions [--from SECONDS] [--to SECONDS] [NAME ...]

A run is made under valgrind's callgrind, which counts from the window's start to its end. Kernels
are compiled for a generic processor. It needs valgrind with its headers, and a C compiler.
"""

from __future__ import annotations

import ctypes
import os
import re
import shutil
import subprocess
import sys
import tempfile
from bisect import bisect_left
from collections import Counter
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MOST = 40  # rows of a table
SWITCH = """\
#include <valgrind/callgrind.h>
void start(void) { CALLGRIND_START_INSTRUMENTATION; }
void stop(void) { CALLGRIND_STOP_INSTRUMENTATION; }
"""
_SWITCH = "switch.so"
_FARTHEST = 1 << 16  # bytes from the beginning of a kernel's code to its entry
_NAME = re.compile(r"\((\d+)\)(?: (.*))?")


def rows(workload: str, start_s: float, end_s: float) -> list[dict[str, object]]:
    """Million instructions a simulated second by object, then by function."""
    for program in ("valgrind", "cc"):
        if shutil.which(program) is None:
            raise SystemExit(f"instructions: {program} is not installed (apt install valgrind gcc)")
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        subprocess.run(["cc", "-shared", "-fPIC", "-x", "c", "-", "-o", scratch / _SWITCH],
                       input=SWITCH, text=True, check=True)
        _run([], scratch, workload, start_s, end_s)  # compiles the kernels
        profile = scratch / "callgrind.out"
        kernels = _run(["valgrind", "--tool=callgrind", "--instr-atstart=no",
                        f"--callgrind-out-file={profile}"], scratch, workload, start_s, end_s)
        spent = parse(profile.read_text(encoding="utf-8", errors="replace"), kernels)
    scale = 1e6 * (end_s - start_s)
    objects: Counter[str] = Counter()
    for (binary, _), count in spent.items():
        objects[binary] += count
    return [{"what": "all", "M a second": round(spent.total() / scale, 2)},
            *({"what": binary, "M a second": round(count / scale, 2)}
              for binary, count in objects.most_common(8)),
            *({"what": f"{binary}: {function}", "M a second": round(count / scale, 2)}
              for (binary, function), count in spent.most_common(MOST))]


def _run(valgrind: list[str], scratch: Path, workload: str, start_s: float, end_s: float
         ) -> dict[int, str]:
    """Run a workload in a process of its own; the kernels' names by their addresses."""
    done = subprocess.run(
        [*valgrind, sys.executable, __file__, workload, str(start_s), str(end_s), str(scratch)],
        cwd=ROOT,
        capture_output=True, text=True,
        env=os.environ | {"PYTHONPATH": f"{ROOT}:{ROOT / 'tools'}", "PYTHONHASHSEED": "0",
                          "XDG_CACHE_HOME": str(scratch), "NUMBA_CPU_NAME": "generic"})
    if done.returncode:
        raise SystemExit(f"instructions: {workload} failed:\n{done.stderr[-2000:]}")
    return {int(address): name for address, name in
            (line.split(" ", 1) for line in done.stdout.splitlines())}


def parse(profile: str, kernels: dict[int, str]) -> Counter[tuple[str, str]]:
    """Instructions of functions themselves, by object and function, of callgrind's format
    ("Callgrind Format Specification" in valgrind's manual): names are given once and stand as
    numbers after that. ``kernels``: their names by the addresses of their entries."""
    names: dict[tuple[str, str], str] = {}
    spent: Counter[tuple[str, str]] = Counter()
    binary = function = ""
    is_call = False
    entries = sorted(kernels)

    def kernel(address: str) -> str:
        """The kernel to which code without a name belongs: its entry comes behind it."""
        place = int(address.partition("'")[0], 16)  # '2 is behind a function that calls itself
        k = bisect_left(entries, place)
        near = k < len(entries) and entries[k] - place < _FARTHEST
        return kernels[entries[k]] if near else address

    def named(kind: str, text: str) -> str:
        match = _NAME.match(text)
        if match is None:
            return text
        number, name = match.groups()
        return names.setdefault((kind, number), name or "?")

    for line in profile.splitlines():
        key, _, value = line.partition("=")
        if key in ("ob", "cob"):
            found = named("ob", value)
            binary = found if key == "ob" else binary
        elif key in ("fn", "cfn"):
            found = named("fn", value)
            if key == "fn":
                function = kernel(found) if found.startswith("0x") else found
        elif key == "calls":
            is_call = True
        elif line[:1].isdigit() or line[:1] in ("+", "-", "*"):
            if not is_call:
                spent[binary.rpartition("/")[2], function] += int(line.split()[1])
            is_call = False
    return spent


def main() -> None:
    """Run a workload and print the addresses of its kernels."""
    from desim.compiler import machine_code
    addresses: dict[int, str] = {}
    load_function = machine_code._function

    def remembered(address: int, name: str):
        addresses[address] = name
        return load_function(address, name)

    machine_code._function = remembered
    machine_code.cpu = lambda: "generic"  # valgrind's processor is another
    run(*sys.argv[1:])
    for address, kernel in addresses.items():
        print(address, kernel)


def run(workload: str, start_s: str, end_s: str, scratch: str) -> None:
    """Run a workload, counted in the window. Its modules are imported here, when kernels load as
    ``main`` says."""
    import desim
    from benchmarks.calls import load
    from desim.engine.kernel import Phase
    from desim.units import NS_PER_S
    switch = ctypes.CDLL(str(Path(scratch) / _SWITCH))

    @contextmanager
    def counting(simulation, _):
        for at_s, turn in ((start_s, switch.start), (end_s, switch.stop)):
            simulation.kernel.at(int(float(at_s) * NS_PER_S), Phase.WORLD, 0,
                                 lambda _, turn=turn: turn())
        yield

    with tempfile.TemporaryDirectory() as out:
        desim.run(load(workload, float(end_s) + 0.02), out=out, watch=counting)


if __name__ == "__main__":
    main()

"""The program in the guest that computes without end, found from outside.

Each process of the guest is a process of this machine, which has the guest's memory where the guest
has it: below its top lie the process's arguments and environment.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

_PROC = Path("/proc")
_LAST_BYTES = 1 << 17  # of a process's memory: arguments and environment are there
_TOP = 0x7FC0000000  # of a process's memory in the guest (arch/um: TASK_SIZE)
_TRIES = 200
# Strings: the processor's name, the arguments, variables until that which says the host.
_STRINGS = re.compile(rb"(?:x86_64\0)?((?:[ -~]+\0)+?)(?:\w+=[ -~]*\0)*?DESIM_HOST=(\w+)")


def busy_program(guest: int) -> str | None:
    """The arguments and the host of a real program that runs now in the guest whose process is
    ``guest``; None if none was seen running."""
    for _ in range(_TRIES):
        for process in _running_below(guest):
            found = _STRINGS.search(_end_of_memory(process))
            if found:
                arguments, host = found[1].split(b"\0"), found[2]
                return f"{b' '.join(arguments).decode()}on {host.decode()}"
    return None


def _running_below(guest: int) -> Iterator[Path]:
    """The guest's processes that run now."""
    for process in _PROC.glob("[0-9]*"):
        try:
            state, parent = (process / "stat").read_text("utf-8").rpartition(")")[2].split()[:2]
        except OSError:  # it has ended
            continue
        if state == "R" and parent == str(guest):
            yield process


def _end_of_memory(process: Path) -> bytes:
    """The last part of a process's memory, what of it is there."""
    parts = []
    try:
        with (process / "mem").open("rb", buffering=0) as memory:
            for line in (process / "maps").read_text("utf-8").splitlines():
                first, last = (int(bound, 16) for bound in line.split()[0].split("-"))
                if first >= _TOP - _LAST_BYTES and last <= _TOP:
                    memory.seek(first)
                    parts.append(memory.read(last - first))
    except OSError:  # it has ended, or may not be read
        return b""
    return b"".join(parts)

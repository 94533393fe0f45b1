"""The program in the guest that computes without end, found among this machine's processes."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from desim.loop import busy_program as module
from desim.loop.busy_program import busy_program

GUEST = 4711
VARIABLES = b"PATH=/bin\0DESIM_HOST=base\0HOME=/h\0\0"


class Processes:
    """A /proc of our own, whose processes have their memory in ordinary files."""

    def __init__(self, root):
        self._root = root

    def add(self, number, memory, state="R", parent=GUEST, name="a ) b", offset=0x100):
        folder = self._root / str(number)
        folder.mkdir()
        (folder / "stat").write_text(f"{number} ({name}) {state} {parent} 0 0")
        first = module._TOP - module._LAST_BYTES + offset
        with (folder / "mem").open("wb") as file:
            file.seek(first)
            file.write(memory)
        (folder / "maps").write_text(
            f"00400000-00500000 r-xp 0 00:00 0 /bin/x\n{first:x}-{first + len(memory):x} rw-p 0\n"
            f"{module._TOP:x}-{module._TOP + 4096:x} rw-p 0 [stack]\n")


@pytest.fixture
def processes(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "_PROC", tmp_path)
    return Processes(tmp_path)


@pytest.mark.parametrize("memory", [
    b"python3\0spin.py\0--fast\0" + VARIABLES,
    b"\x01\x02x86_64\0python3\0spin.py\0--fast\0" + VARIABLES,
    bytes(range(32)) + b"\xff\x80python3\0spin.py\0--fast\0DESIM_HOST=base\0"])
def test_the_arguments_and_the_host_are_those_at_the_top_of_its_memory(processes, memory):
    processes.add(10, memory)
    assert busy_program(GUEST) == "python3 spin.py --fast on base"


def test_who_sleeps_or_is_no_child_of_the_guest_is_not_named(processes):
    processes.add(10, b"sleeper\0" + VARIABLES, state="S")
    processes.add(11, b"other\0" + VARIABLES, parent=GUEST + 1)
    processes.add(12, b"kernel thread without a program\0PATH=/bin\0")
    assert busy_program(GUEST) is None
    processes.add(13, b"culprit\0" + VARIABLES)
    assert busy_program(GUEST) == "culprit on base"


def test_one_that_ends_meanwhile_is_passed_over(processes, tmp_path):
    processes.add(10, b"gone\0" + VARIABLES)
    (tmp_path / "10" / "maps").unlink()
    (tmp_path / "11").mkdir()  # its stat has gone
    (tmp_path / "self").mkdir()
    assert busy_program(GUEST) is None


def test_running_children_of_this_process_are_found(monkeypatch):
    """Their memory is where the machine has it, and not where the guest would."""
    busy = subprocess.Popen([sys.executable, "-c", "while True: pass"])
    try:
        found = False
        for _ in range(1000):
            found = any(int(path.name) == busy.pid for path in module._running_below(os.getpid()))
            if found:
                break
        assert found
    finally:
        busy.kill()
        busy.wait()

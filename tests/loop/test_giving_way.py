"""A thread that finds a lock taken gives way, and learns the same as otherwise."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from desim.loop import giving_way

PROGRAM = """
import ctypes
libc, mutex = ctypes.CDLL(None), ctypes.create_string_buffer(40)
print(libc.pthread_mutex_trylock(mutex), libc.pthread_mutex_trylock(mutex))
with open("/proc/self/status") as status:
    print(next(line.split()[1] for line in status if line.startswith("voluntary")))
for _ in range(100):
    libc.pthread_mutex_trylock(mutex)
with open("/proc/self/status") as status:
    print(next(line.split()[1] for line in status if line.startswith("voluntary")))
"""


def said(**env: str) -> list[int]:
    done = subprocess.run([sys.executable, "-c", PROGRAM], env={**os.environ, **env}, check=True,
                          capture_output=True, text=True)
    return [int(word) for word in done.stdout.split()]


def test_a_failed_try_gives_way(tmp_path):
    """Each does, unless its sleep of 1 ns is over before the thread is off the processor."""
    library = giving_way.build(tmp_path)
    if library is None:
        pytest.skip("gcc is not installed; desim loop doctor says how to get it")
    free, taken, before, after = said(LD_PRELOAD=str(library))
    assert (free, taken) == (0, 16)  # EBUSY
    assert after - before > 50


def test_without_it_nothing_gives_way():
    free, taken, before, after = said(LD_PRELOAD="")
    assert (free, taken) == (0, 16)
    assert after - before < 50


def test_a_machine_without_compiler(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert giving_way.build(tmp_path) is None

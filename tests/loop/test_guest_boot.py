"""The script that a guest begins with: what of this machine it sees."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from desim.errors import InputError
from desim.loop.guest import _hidden, _init
from desim.loop.order import Order
from desim.scenario.schema.loop import Loop


@pytest.mark.parametrize(("path", "mounted"), [
    ("/home/u/scenarios", None), ("/tmpfile", None), ("/", None), ("/tmp/a", "/tmp/a"),
    ("/tmp/a/b/c", "/tmp/a"), ("/dev/shm/x", "/dev/shm"), ("/run/user", "/run/user")])
def test_what_the_guest_hides_is_mounted_with_what_lies_beside_it(path, mounted):
    assert _hidden(path) == mounted


def test_the_guest_keeps_folders_of_its_own():
    with pytest.raises(InputError) as refused:
        _hidden("/tmp")
    assert str(refused.value) == (
        "/tmp is a folder of the guest's own, in memory; allowed for scenarios and programs, and "
        "to start desim in: a folder below it, or elsewhere")


def test_all_that_a_run_reads_and_writes_is_mounted_once(monkeypatch):
    monkeypatch.chdir("/usr")
    loop = Loop(programs=[{"host": "a", "run": "x", "folder": "/tmp/pro grams/in"},
                          {"host": "b", "run": "x", "folder": "/tmp/pro grams"},
                          {"host": "c", "run": "x", "folder": "/home/u"}])
    script = _init(Order("/tmp/it's/s.yaml", [], None, "/home/u/out", "desim"), Path("/tmp/order"),
                   loop, {"NUMBA_CACHE_DIR": "/c", "HOME": "/home/o'x", "SECRET": "1"})
    mounts = [shlex.split(line.split("; ")[1])[-1] for line in script.splitlines()
              if "hostfs" in line]
    assert [path for path in mounts if not path.startswith("/tmp/pytest")] == [
        "/c", "/home/u/out", "ro,/tmp/it's", "/tmp/order", "ro,/tmp/pro grams"]
    (command,) = [line for line in script.splitlines() if line.startswith("env ")]
    words = shlex.split(command)
    assert "HOME=/home/o'x" in words and "cd /usr" in script
    assert not any("SECRET" in word for word in words)

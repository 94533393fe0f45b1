"""A child process of a campaign, whatever it does to its parent, and the processes that it leaves.
"""

import os
import select
import signal
import subprocess
import sys
from multiprocessing.connection import wait

import pytest

from desim.operating_system import child_on_linux, guard_on_linux
from desim.operating_system.child_on_linux import LinuxChild

pytestmark = pytest.mark.skipif(not child_on_linux.IS_HERE, reason="other systems have less")

# It leaves a process in a session of its own, says which, and does what it is sent.
CHILD = """
import os, signal, sys, time
from desim.operating_system.children import connection_to_parent

connection = connection_to_parent(sys.argv[1])
if os.fork():
    os.wait()
else:
    os.setsid()
    if os.fork():
        os._exit(0)
    os.write(1, b"%d" % os.getpid())
    time.sleep(600)
exec(connection.recv())
time.sleep(600)
"""
PARENT = """
import time
from multiprocessing.connection import wait
from desim.operating_system.child_on_linux import LinuxChild

child = LinuxChild("of_mine")
wait(child.signs)
print(child.printed(99).decode(), flush=True)
time.sleep(600)
"""


@pytest.fixture(autouse=True)
def of_mine(tmp_path, monkeypatch):
    (tmp_path / "of_mine.py").write_text(CHILD)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))


def begun() -> tuple[LinuxChild, int]:
    """A child, and the process that it has left."""
    child = LinuxChild("of_mine")
    wait(child.signs)
    return child, int(child.printed(99))


def is_there(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


TO_PARENT = "os.kill(os.getppid(), signal.{})"


@pytest.mark.parametrize("deed, cause", [
    *((TO_PARENT.format(name), f"it sent {name} to its parent")
      for name in ("SIGTERM", "SIGINT", "SIGHUP", "SIGUSR1", "SIGRTMIN")),
    ("os.kill(0, signal.SIGTERM)", "it sent SIGTERM to its parent"),
    ("os.system(f'kill -HUP {os.getppid()}')", "SIGHUP was sent to its parent"),
    ("os._exit(3)", "exit code 3"),
    ("os.kill(os.getpid(), signal.SIGSEGV)", "SIGSEGV"),
    ("os.kill(os.getpid(), 40)", "signal 40")])
def test_its_death_has_a_cause_and_what_it_left_dies_with_it(deed, cause):
    child, left = begun()
    child.connection.send(deed)
    wait(child.signs[:2])
    assert child.end() == cause
    assert not is_there(left)


def test_what_it_left_dies_when_it_is_ended():
    child, left = begun()
    assert child.end() == "SIGKILL"
    assert not is_there(left)


def test_a_parent_that_it_has_stopped_ends_it():
    child, left = begun()
    child.connection.send(TO_PARENT.format("SIGSTOP") + "\nos.write(1, b'done')")
    wait(child.signs)
    assert child.printed(99) == b"done"
    assert child.end() == "SIGKILL"
    assert not is_there(left)


def test_a_parent_that_it_has_killed_takes_it_along():
    child, left = begun()
    child.connection.send(TO_PARENT.format("SIGKILL"))
    wait(child.signs[:2])
    assert child.end() == "SIGKILL"
    os.kill(left, signal.SIGKILL)  # this alone stays: docs/security.md


def test_what_it_left_dies_with_the_campaign():
    with subprocess.Popen([sys.executable, "-c", PARENT], stdout=subprocess.PIPE) as parent:
        left = os.pidfd_open(int(parent.stdout.readline()))
        parent.kill()
    assert select.select([left], [], [], 60)[0]
    os.close(left)


def test_children_in_other_sessions_are_seen():
    child, left = begun()
    child.connection.send(
        "from desim.operating_system.resources import children\nos.write(1, b'%r' % children())")
    wait(child.signs)
    assert child.printed(99) == b"[%d]" % left
    child.end()


def test_a_guard_does_not_wait_for_what_it_may_not_kill(monkeypatch):
    def refused(*_):
        raise PermissionError

    monkeypatch.setattr(guard_on_linux, "children", lambda: [os.getpid()])
    monkeypatch.setattr(os, "kill", refused)
    guard_on_linux._kill_children()

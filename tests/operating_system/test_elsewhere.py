"""desim on a machine without what only Linux or POSIX has. It is simulated: no other is here."""

import json
import ntpath
import os
import signal
import subprocess
import sys
from multiprocessing.connection import wait
from pathlib import Path

import pytest

from desim.api import run
from desim.files import content_below, plain_parts
from desim.operating_system import child_elsewhere, child_on_linux, folders

ELSEWHERE = Path(__file__).with_name("elsewhere")
UNTIL = "20s"
# Text is not UTF-8 unless one says so.
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ELSEWHERE), "LC_ALL": "C", "PYTHONUTF8": "0",
               "PYTHONCOERCECLOCALE": "0"}


@pytest.fixture(scope="module")
def desim(tmp_path_factory):
    """Calls a command of desim, which must succeed; returns what it prints."""
    folder = tmp_path_factory.mktemp("elsewhere")

    def call(*words):
        done = subprocess.run([sys.executable, "-m", "desim.cli", *words], cwd=folder, text=True,
                              capture_output=True, env=ENVIRONMENT)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout
    call.folder = folder
    return call


@pytest.fixture(scope="module")
def ran(desim):
    """The folder of a run of hello."""
    desim("new", "hello")
    desim("run", "hello.yaml", "--until", UNTIL)
    folder, = (desim.folder / "results" / "hello").iterdir()
    return folder


def test_what_is_taken_away_is_gone():
    code = ("import os, signal, select, subprocess, multiprocessing.connection\n"
            "import desim.operating_system.children as c; print(c.begun.__module__)\n"
            "for name in 'fcntl', 'resource':\n"
            "    try: __import__(name); print(name)\n"
            "    except ImportError: pass\n"
            "print(os.path.exists('/proc/self'), hasattr(os, 'pidfd_open'), hasattr(os, 'killpg'))")
    done = subprocess.run([sys.executable, "-c", code], text=True, capture_output=True, check=True,
                          env=ENVIRONMENT)
    assert done.stdout == "desim.operating_system.child_elsewhere\nFalse False False\n"
    assert child_on_linux.IS_HERE and child_elsewhere.__name__ in done.stdout


def test_a_run_has_the_same_digest(ran, desim, tmp_path):
    manifest = json.loads((ran / "manifest.json").read_text())
    assert manifest["peak_memory_mb"] is None
    here = run(desim.folder / "hello.yaml", out=tmp_path, overrides=[f"stop.elapsed={UNTIL}"])
    assert manifest["digest"] == here.manifest["digest"]


def test_its_folder_is_read(ran, desim):
    assert "whole" in desim("check", str(ran))
    desim("view", str(ran), "--no-open")
    assert "desimReplay" in (ran / "replay.html").read_text("utf-8")


def test_a_campaign_is_made_by_two_workers_and_reported(desim):
    desim("new", "hello")
    desim("sweep", "hello.yaml", "--vary", "fleet.size=1,2", "--set", "stop.elapsed=5s",
          "--seeds", "1", "--jobs", "2", "--out", "campaign")
    rows = (desim.folder / "campaign" / "index.jsonl").read_text("utf-8").splitlines()
    assert [json.loads(row)["status"] for row in rows] == ["finished"] * 2
    assert "whole" in desim("check", "campaign")
    desim("report", "campaign")
    assert (desim.folder / "campaign" / "report" / "report.html").is_file()


def test_a_file_is_opened_below_its_folder_alone(tmp_path, monkeypatch):
    monkeypatch.setattr(folders, "_HOLDS_FOLDERS", False)
    (tmp_path / "a" / "b").mkdir(parents=True)
    (tmp_path / "a" / "b" / "c").write_text("c")
    (tmp_path / "a" / "up").symlink_to(tmp_path / "a")
    (tmp_path / "a" / "b" / "link").symlink_to("c")
    assert content_below(tmp_path / "a", "b/c", 9) == b"c"
    for name in "up/b/c", "b/link":
        with pytest.raises(OSError) as caught:
            content_below(tmp_path / "a", name, 9)
        assert caught.value.strerror == "is a symbolic link, which desim does not follow"
    with pytest.raises(IsADirectoryError):
        content_below(tmp_path, "a/b", 9)


@pytest.mark.parametrize("name", ["..\\outside", "C:outside", "\\outside", "b\\c"])
def test_names_of_windows_lead_nowhere(monkeypatch, name):
    assert plain_parts(name) == [name]  # here it is a name like any other
    monkeypatch.setattr(os, "path", ntpath)
    with pytest.raises(OSError, match="is no name of a file in a folder"):
        plain_parts(name)


IN_TURN = """
import sys
from pathlib import Path
from desim.operating_system.locks import Lock
lock = Lock(Path("lock"))
print("held", flush=True)
sys.stdin.read()
"""


def test_a_lock_is_of_one_process_until_its_death(desim):
    ask = ("from pathlib import Path\nfrom desim.operating_system.locks import Lock, Taken\n"
           "try: Lock(Path('lock')).remove_file(); print('free')\nexcept Taken: print('taken')")

    def asked():
        return subprocess.run([sys.executable, "-c", ask], cwd=desim.folder, env=ENVIRONMENT,
                              text=True, capture_output=True, check=True).stdout

    with subprocess.Popen([sys.executable, "-c", IN_TURN], cwd=desim.folder, env=ENVIRONMENT,
                          text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as holder:
        assert holder.stdout.readline() == "held\n"
        assert asked() == "taken\n"
        holder.kill()
        holder.wait()
        assert asked() == "free\n"
    assert not (desim.folder / "lock").exists()


CHILD = """
import sys, time
from desim.operating_system.children import connection_to_parent
connection = connection_to_parent(sys.argv[1])
print("begun", flush=True)
connection.send(connection.recv() + 1)
time.sleep(600)
"""


@pytest.fixture
def child(tmp_path, monkeypatch):
    """A child of CHILD, as elsewhere."""
    (tmp_path / "of_mine.py").write_text(CHILD)
    monkeypatch.setenv("PYTHONPATH", f"{ELSEWHERE}{os.pathsep}{tmp_path}")
    return child_elsewhere.PlainChild("of_mine")


def test_a_child_answers_and_is_seen_to_die(child):
    child.connection.send(1)
    assert wait(child.signs) == [child.connection] and child.connection.recv() == 2
    assert child.printed(100) == b"begun\n" and child.printed(100) == b""
    os.kill(child._process.pid, signal.SIGKILL)
    assert wait(child.signs[1:]) == child.signs[1:]
    assert child.end() == "SIGKILL"
    assert not os.path.exists(child._path)


def test_a_child_dies_with_its_parent(child):
    child._process.stdin.close()  # as the system does when the parent is gone
    assert wait(child.signs[1:]) == child.signs[1:]
    assert child.end() == "exit code 1"


def test_a_child_that_never_asks_for_its_connection_is_dead(tmp_path, monkeypatch):
    (tmp_path / "not_mine.py").write_text("")
    monkeypatch.setenv("PYTHONPATH", f"{ELSEWHERE}{os.pathsep}{tmp_path}")
    child = child_elsewhere.PlainChild("not_mine")
    assert wait(child.signs[1:]) == child.signs[1:]
    assert child.end() == "exit code 0"

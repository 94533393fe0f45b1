"""Real programs in the guest: small ones over plain sockets. Skipped where there is no guest."""

from __future__ import annotations

import os

import pytest
from loop_guests import Program, busy_machine, played, refuse_without_guest, said

from desim.errors import InputError, ModelError
from desim.loop import virtual
from desim.loop.supervision import Watcher
from desim.results.run import Run
from desim.results.status import RunStatus

SENDER = """
import os, socket, sys, time
out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
began = time.monotonic()
print("began", flush=True)
extra = open("extra", "rb").read()
try:
    stream = socket.create_connection(("other", 8000), timeout=2)
except OSError as error:
    stream = None
    print("no stream:", error, flush=True)
for number in range(50):
    out.sendto(b"%d " % number + extra[:extra[0]], ("other", 9000))
    if stream is not None and number % 5 == 0:
        stream.sendall(os.urandom(8))
    time.sleep(0.1)
"""
RECEIVER = """
import socket, threading
server = socket.create_server(("", 8000))
def serve():
    while True:
        stream, _ = server.accept()
        threading.Thread(target=drain, args=[stream], daemon=True).start()
def drain(stream):
    try:
        while got := stream.recv(100):
            print("stream", got.hex(), flush=True)
    except OSError:
        pass
threading.Thread(target=serve, daemon=True).start()
box = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
box.bind(("", 9000))
while True:
    print("got", box.recv(1000).split()[0].decode(), flush=True)
"""
FAILING = "print('it fails', flush=True)\nraise SystemExit(3)\n"
WAKING = "import time\nwhile True: time.sleep(0.01)\n"
PROGRAMS = [Program("other", RECEIVER), Program("base", SENDER), Program("base", FAILING)]
# The cut is from 2 s to 3 s, and after it base is down for a second.
KEYS = """\
network:
  media:
    air:
      model: radio
      rate: 24 Mb/s
      rules: [{rule: loss, probability: 100 %, topics: [/udp/9000], from: 2 s, until: 3 s}]
faults: [{at: 4 s, host: base, down_for: 1 s}]
stop: {elapsed: 7 s}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    refuse_without_guest()
    folder = tmp_path_factory.mktemp("guest runs")
    (folder / "extra").write_bytes(b"\x05" * 64)
    return folder


@pytest.fixture(scope="module")
def news():
    """The news of ``run``."""
    return []


@pytest.fixture(scope="module")
def run(folder, news):
    return played(folder, KEYS, PROGRAMS, watcher=Watcher(lambda *_: None, news.append))


def test_frames_go_over_the_medium_and_rules_cut_them(run):
    got = [int(line.split()[1]) for line in said(run, "other", 0) if line.startswith("got")]
    assert got[:15] == list(range(15))
    before, after = set(range(19)), set(range(31, 38))
    assert before | after <= set(got) and not set(range(21, 29)) & set(got[:40])
    assert any(line.startswith("stream") for line in said(run, "other", 0))


def test_a_fault_ends_the_programs_and_they_begin_anew(run):
    assert said(run, "base", 1).count("began") == 2
    assert said(run, "base", 2) == ["it fails"] * 2


def test_the_manifest_says_how_programs_ended_and_on_which_clock(run):
    loop = run.manifest["loop"]
    assert run.manifest["clock"] == "virtual"
    assert {(end["host"], end["log"]): end["code"] for end in loop["programs"]} == {
        ("other", "other.0.log"): None, ("base", "base.1.log"): None, ("base", "base.2.log"): 3}
    assert {end["log"]: end["at_s"] for end in loop["programs"]}["base.1.log"] is None
    assert loop["frames"] > 50
    assert loop["lateness"]["max_us"] < 10
    assert run.manifest["reclaimed_pages"] == 0


def test_a_program_that_fails_is_reported_at_once(run, news):
    """It fails when it starts, and again when its host is up again."""
    ends = [end["at_s"] for end in run.manifest["loop"]["programs"] if end["code"] == 3]
    assert [int(at_s) for at_s in ends] == [0, 5]
    assert news == [f"base         $DESIM_PYTHON p2.py: exit code 3 at {at_s:.3f} s"
                    for at_s in ends]


def test_a_run_is_repeated_with_a_busy_machine_and_elsewhere_too(run, folder, tmp_path,
                                                                 monkeypatch):
    """In a folder with a package that is called as desim's own."""
    before = run.manifest["digest"]
    (tmp_path / "desim").mkdir()
    (tmp_path / "desim" / "__init__.py").write_text("raise ImportError('not this one')\n")
    monkeypatch.chdir(tmp_path)
    with busy_machine(2):
        assert played(folder, KEYS, PROGRAMS).manifest["digest"] == before


def test_another_seed_gives_another_run(run, folder):
    assert played(folder, KEYS, PROGRAMS, seed=2).manifest["digest"] != run.manifest["digest"]


def test_chance_of_this_machine_would_be_seen(run, folder):
    """The twin: a file that differs from run to run changes what is sent, and so the digest."""
    (folder / "extra").write_bytes(bytes([20]) + os.urandom(63))
    try:
        assert played(folder, KEYS, PROGRAMS).manifest["digest"] != run.manifest["digest"]
    finally:
        (folder / "extra").write_bytes(b"\x05" * 64)


# Its end is far off, and every second until then is work.
LONG = {"programs": [*PROGRAMS, Program("other", WAKING)], "changes": ("stop.elapsed=3600 s",)}


def test_ctrl_c_ends_a_run_in_good_order_and_nobody_else_writes_it_meanwhile(folder):
    refused = []

    def meanwhile(second: int, _: int) -> None:
        if second and not refused:  # all programs run, whose files ``played`` writes
            with pytest.raises(InputError) as error:
                played(folder, KEYS, **LONG)
            refused.append(str(error.value))
        if second >= 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as stopped:
        played(folder, KEYS, **LONG, watcher=Watcher(meanwhile, lambda _: None))
    kept = Run(str(stopped.value))
    assert kept.manifest["status"] == RunStatus.INTERRUPTED
    assert 2 <= kept.manifest["simulated_s"] < 3600
    assert "began" in said(kept, "base", 1) and "got 3" in said(kept, "other", 0)
    assert "another process is writing this run; wait for it" in refused[0]


def test_a_program_that_never_sleeps_is_named(folder, monkeypatch):
    monkeypatch.setattr(virtual, "STUCK_S", 8.0)
    with pytest.raises(ModelError) as raised:
        played(folder, "stop: {elapsed: 5 s}\n",
               [Program("base", "import time\ntime.sleep(1.5)\nwhile True: pass\n")])
    assert str(raised.value).startswith("the simulated clock has stood at 1 s for 8 s: a program "
                                        "computes without end and never sleeps (")
    assert "p0.py on base" in str(raised.value)


def test_want_of_memory_is_noted(folder):
    short = played(folder, KEYS, PROGRAMS, memory_mb=220, changes=("stop.elapsed=3 s",))
    assert short.manifest["reclaimed_pages"] > 0


def test_a_full_memory_of_the_guest_is_said(folder):
    with pytest.raises(ModelError, match=r"^the guest's memory is full \(600 MB\), and Linux has "
                                         "killed "):
        played(folder, "stop: {elapsed: 5 s}\n", [Program(
            "base", "keep = []\nwhile True: keep.append(b'x' * 10_000_000)\n")], memory_mb=600)

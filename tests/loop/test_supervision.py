"""The supervision of the process beside the programs: Ctrl-C, and an end without an answer."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from desim.errors import ModelError
from desim.loop import supervision
from desim.loop.order import Order
from desim.loop.supervision import Supervisor, Watcher, carried_out
from desim.units import NS_PER_S

# The folder of the order is the first argument.
BEGUN = "import json, pathlib, sys, time\nfolder = pathlib.Path(sys.argv[1])\n" \
        "(folder / 'progress').write_text('1')\n"
OBEDIENT = BEGUN + ("while not (folder / 'stop').exists(): time.sleep(0.01)\n"
                    "(folder / 'answer.json').write_text(json.dumps([130, '/kept', '', '']))\n")
DEAF = BEGUN + "while True: time.sleep(1)\n"
TALKING = BEGUN + ("(folder / 'news').write_text('one\\ntwo\\nthr')\ntime.sleep(0.3)\n"
                   "(folder / 'news').write_text('one\\ntwo\\nthree\\n')\n")
BROKEN = "import pathlib, sys\n" \
         "(pathlib.Path(sys.argv[1]) / 'output').write_text('\\n'.join(map(str, range(20))))\n"


def supervised(code: str, on_progress=lambda *_: None, on_news=lambda _: None) -> subprocess.Popen:
    """Carry out an order by the program ``code``. Returns its process, which has ended."""
    processes = []

    def start(folder: Path) -> subprocess.Popen:
        processes.append(subprocess.Popen([sys.executable, "-c", code, str(folder)],
                                          start_new_session=True))
        return processes[0]

    try:
        carried_out(Order("s.yaml", [], None, "out", "desim loop"), 5 * NS_PER_S, Supervisor(
            start, lambda *_: None, lambda said: None), Watcher(on_progress, on_news))
    finally:
        assert processes[0].poll() is not None
    return processes[0]


def interrupt(*_: object) -> None:
    raise KeyboardInterrupt


def test_ctrl_c_lets_the_run_end_in_good_order():
    with pytest.raises(KeyboardInterrupt, match="^/kept$"):
        supervised(OBEDIENT, interrupt)


def test_what_does_not_end_is_killed(monkeypatch):
    monkeypatch.setattr(supervision, "GRACE_S", 0.1)
    with pytest.raises(KeyboardInterrupt, match="^$"):
        supervised(DEAF, interrupt)


def test_an_end_without_an_answer_shows_the_last_lines():
    with pytest.raises(ModelError) as raised:
        supervised(BROKEN)
    assert str(raised.value).splitlines() == [
        "the process beside the programs ended without an answer; its last lines:",
        *map(str, range(12, 20))]


def test_each_line_of_news_comes_once_and_whole():
    heard = []
    with pytest.raises(ModelError):  # it has no answer
        supervised(TALKING, on_news=heard.append)
    assert heard == ["one", "two", "three"]

"""``desim run --live`` as a user meets it: a page under load, a page that stays, an end in CI."""

from __future__ import annotations

import http.client
import os
import pty
import signal
import subprocess
import sys

from devtools import Browser, load


def command(repository, out, *words):
    return [sys.executable, "-m", "desim.cli", "run", str(repository / "scenarios" / "hello.yaml"),
            "--live", "--quiet", "--out", str(out), *words]


# From a second of the run on: who is up, whether there are plans, and maps.
SEEN = """new Promise((resolve) => { const wait = () => {
    const { app } = desimReplay, run = app.runs[0], { timeS } = app.player;
    if (timeS < AT) { setTimeout(wait, 10); return; }
    resolve([[...run.upAt(timeS).robots], run.plan.length > 0, run.growth !== null]);
    }; wait(); })"""


def test_robots_are_up_on_a_busy_machine(browser_here, repository, tmp_path):
    """Chromium, the run and two busy processes on one computer; seen early, later, at the end."""
    with Browser(tmp_path / "profile") as browser, load(), subprocess.Popen(
            command(repository, tmp_path, "--until", "4 s", "--pace", "1"),
            stdout=subprocess.PIPE, text=True) as run:
        said, _, url = run.stdout.readline().strip().rpartition(" ")
        browser.open(url)
        seen = [browser.value(SEEN.replace("AT", str(at_s))) for at_s in (0.4, 2, 4)]
        browser.value("""new Promise((resolve) => { const wait = () =>
            desimReplay.playing() ? setTimeout(wait, 10) : requestAnimationFrame(resolve);
            wait(); })""")  # the last chunk is there
        head = browser.value("document.querySelector('#about').textContent")
        last = run.stdout.read()
        (folder,) = (tmp_path / "hello").iterdir()
        assert browser.complaints == []
    assert said == "live at"
    assert seen == [[[1, 1, 1], True, True]] * 3
    assert head == "seed 1  ·  testbed  ·  elapsed"
    assert last == f"its replay: desim view {folder}\n" and run.returncode == 0


def test_at_a_terminal_the_page_stays_until_ctrl_c(repository, tmp_path):
    ours, its = pty.openpty()
    run = subprocess.Popen(command(repository, tmp_path, "--until", "1 s"), stdin=its, stdout=its,
                           stderr=its, env={**os.environ, "DISPLAY": "", "WAYLAND_DISPLAY": ""})
    os.close(its)
    with run, os.fdopen(ours, "rb", buffering=0) as terminal:
        said = b""
        while b"until Ctrl-C" not in said:
            said += terminal.read(1024)
        first, replay, stays = said.decode().splitlines()
        url = first.removeprefix("live at ")
        connection = http.client.HTTPConnection(url[7:-1], timeout=10)
        connection.request("GET", "/")
        assert connection.getresponse().status == 200
        connection.close()
        run.send_signal(signal.SIGINT)
        assert run.wait() == 0
    (folder,) = (tmp_path / "hello").iterdir()
    assert replay == f"its replay: desim view {folder}"
    assert stays == f"the page stays at {url} until Ctrl-C"

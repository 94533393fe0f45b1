"""Plug-ins that harm their process: each bad run is a row, and all others are as in a clean sweep.

Each harm comes in the constructor (``made``) and in a callback (``asked``)."""

from designs import written
from typer.testing import CliRunner

from desim.campaign.folder.index import read
from desim.cli import app

HARM = {
    "hang": "while True: pass",
    "forks": "os.fork() or time.sleep(600)",
    "forks_and_exits": "(os.fork() or time.sleep(600)) and os._exit(3)",
    "exits": "os._exit(0)",
    "quits": "sys.exit('bye')",
    "interrupts": "raise KeyboardInterrupt",
    "moves": "os.chdir('/')",
    "leaks": "LEAK.append(np.ones(40_000_000))",
    "prints": "os.write(1, b'x' * 5_000_000)",
    "patches": "np.sqrt = lambda *a: 0; np.seterr(all='raise')",
    "settles": "os.environ['TZ'] = 'x'; os.umask(0o077)",
    "ignores": "signal.signal(signal.SIGUSR1, signal.SIG_IGN)",
    "closes": "os.closerange(3, 256)",
}
LATE = "ended after 15 s of clock time (limits.wall)"
FAILS = {"hang": LATE, "forks_and_exits": "its process died 2 times (exit code 3)",
         "exits": "its process died 2 times (exit code 0)", "quits": "sys.exit() was called",
         "interrupts": "raised KeyboardInterrupt"}
ANY = {"closes", "patches"}  # what becomes of these is theirs; the others' runs are the point


def module() -> str:
    lines = ["import os, signal, sys, time", "import numpy as np",
             "from desim.ports import Params as P", "LEAK = []"]
    for name, code in HARM.items():
        for where, (made, asked) in {"made": (code, "pass"), "asked": ("pass", code)}.items():
            lines += [f"class {name}_{where}:", "    class Params(P): pass",

                      f"    def __init__(self, params=None): {made}" if ":" not in made else
                      f"    def __init__(self, params=None):\n        {made}",
                      "    def choose(self, context):", f"        {asked}", "        return None"]
    for name in ("first", "second", "third"):
        lines += [f"class {name}:", "    class Params(P): pass",
                  "    def __init__(self, params=None): pass",
                  "    def choose(self, context): return None"]
    return "\n".join(lines) + "\n"


STARTING = """
from desim.ports import Params as P
class Never:
    class Params(P): pass
    def __init__(self, params): raise ValueError("no")
    def choose(self, context): return None
"""
GOOD = ["first", "second", "third"]


def swept(out, names, *options):
    """The rows by strategy, and the exit code and output of a sweep of these strategies."""
    folder = out.parent
    (folder / "hostile.py").write_text(module())
    values = ", ".join(f"'hostile:{name}'" for name in names)
    file = written(folder, "iterations: 1\nlimits: {wall: 15 s}\n"
                           "stop: {elapsed: 1 s}\nparameters: {s: {key: "
                           f"coordination.strategy, values: [{values}]}}}}\n")
    done = CliRunner().invoke(app, ["sweep", str(file), "--out", str(out), *options])
    listed = CliRunner().invoke(app, ["sweep", str(file), "--out", str(out),
                                      "--dry-run"]).output if not options else done.output
    rows = read(out / "index.jsonl")[0]
    named = {line.split()[0]: line.split("hostile:")[1].split(",")[0]
             for line in listed.splitlines() if "hostile:" in line and "iteration" in line}
    return {named[run_id]: row for run_id, row in rows.items() if run_id in named}, done


def test_each_bad_run_is_a_row_and_all_others_are_those_of_a_clean_sweep(tmp_path):
    clean, done = swept(tmp_path / "clean", GOOD)
    assert done.exit_code == 0, done.output
    bad = [f"{name}_{where}" for name in HARM for where in ("made", "asked")]
    names = [*GOOD[:1], *bad[:12], *GOOD[1:2], *bad[12:], *GOOD[2:]]
    rows, done = swept(tmp_path / "bad", names)
    assert done.exit_code == 1 and "Traceback" not in done.output, done.output
    assert set(rows) == set(names)
    assert {name: rows[name]["digest"] for name in GOOD} == {
        name: clean[name]["digest"] for name in GOOD}
    for name in bad:
        kind = name.rpartition("_")[0]
        if kind not in ANY:
            assert FAILS.get(kind, "") in rows[name].get("error", ""), (name, rows[name])
            assert (rows[name]["status"] == "failed") == (kind in FAILS), (name, rows[name])
    logs = list((tmp_path / "bad" / "output").iterdir())
    assert logs and all(log.stat().st_size < 70_000 for log in logs)


def test_a_dry_run_names_what_cannot_start(tmp_path):
    (tmp_path / "starting.py").write_text(STARTING)
    file = written(tmp_path, "parameters: {s: {key: coordination.strategy, values: "
                             "[nearest_frontier, 'starting:Never']}}\niterations: 6\n")
    done = CliRunner().invoke(app, ["sweep", str(file), "--dry-run", "--out", str(tmp_path / "o")])
    assert done.exit_code == 1, done.output
    assert "s=starting:Never: fails: " in done.output and "ValueError: no" in done.output


def test_a_folder_that_cannot_be_made_is_one_line(tmp_path):
    file = written(tmp_path, "iterations: 1\n")
    done = CliRunner().invoke(app, ["sweep", str(file), "--out", "/proc/new"])
    assert done.exit_code == 2
    assert done.output == ("/proc/new: cannot be a campaign's folder: No such file or directory; "
                           "choose another one with --out\n")

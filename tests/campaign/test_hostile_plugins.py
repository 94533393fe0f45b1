"""Plug-ins that harm their process: each bad run is a row, and all others are as in a clean sweep.

Each harm comes in the constructor (``made``) or in a callback (``asked``), in turn; what costs no
worker comes in both."""

from pathlib import Path

from designs import planned, written
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
    "leaks": "LEAK.append(np.ones(60_000_000))",
    "prints": "os.write(1, b'x' * 5_000_000)",
    "patches": "np.sqrt = lambda *a: 0; np.seterr(all='raise')",
    "settles": "os.environ['TZ'] = 'x'; os.umask(0o077)",
    "ignores": "signal.signal(signal.SIGUSR1, signal.SIG_IGN)",
    "closes": "os.closerange(3, 256)",
    "terminates": "os.kill(os.getppid(), signal.SIGTERM); time.sleep(600)",
    "hangs_up": "os.kill(os.getppid(), signal.SIGHUP); time.sleep(600)",
    "kills": "os.kill(os.getppid(), signal.SIGKILL); time.sleep(600)",
    "orphans": "leave_orphan()",
}
LATE = "ended after 12 s of clock time (limits.wall)"
FAILS = {"hang": LATE, "forks_and_exits": "its process died 2 times (exit code 3)",
         "exits": "its process died 2 times (exit code 0)", "quits": "sys.exit() was called",
         "interrupts": "raised KeyboardInterrupt",
         "terminates": "its process died 2 times (it sent SIGTERM to its parent)",
         "hangs_up": "its process died 2 times (it sent SIGHUP to its parent)",
         "kills": "its process died 2 times (SIGKILL)"}
CHEAP = {"quits", "interrupts", "prints"}
ANY = {"closes", "patches"}  # what becomes of these is theirs; the others' runs are the point
# A process in a session of its own, whose parent ends: init's, were it not for the guard.
ORPHAN = """
def leave_orphan():
    if not os.fork():
        os.setsid()
        orphan = os.fork()
        if not orphan:
            time.sleep(600)
        with open(__file__ + ".orphan", "w") as file:
            file.write(str(orphan))
        os._exit(0)
    os.wait()
"""


def module() -> str:
    lines = ["import os, signal, sys, time", "import numpy as np",
             "from desim.ports import Params as P", "LEAK = []", ORPHAN]
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


def swept(out, names):
    """The rows by strategy, and the exit code and output of a sweep of these strategies."""
    folder = out.parent
    (folder / "hostile.py").write_text(module())
    values = ", ".join(f"'hostile:{name}'" for name in names)
    text = ("iterations: 1\nlimits: {wall: 12 s}\nstop: {elapsed: 300 ms}\n"
            f"parameters: {{s: {{key: coordination.strategy, values: [{values}]}}}}\n")
    plan = planned(folder, text)
    done = CliRunner().invoke(app, ["sweep", str(written(folder, text)), "--out", str(out)])
    rows = read(out / "index.jsonl")[0]
    return {name: rows[plan.run_id(vector, 0)]
            for name, vector in zip(names, plan.vectors, strict=True)}, done


def test_each_bad_run_is_a_row_and_all_others_are_those_of_a_clean_sweep(tmp_path):
    clean, done = swept(tmp_path / "clean", GOOD)
    assert done.exit_code == 0, done.output
    bad = [f"{name}_{where}" for number, name in enumerate(HARM)
           for where in (("made", "asked") if name in CHEAP else (("made", "asked")[number % 2],))]
    names = [*GOOD[:1], *bad[:8], *GOOD[1:2], *bad[8:], *GOOD[2:]]
    rows, done = swept(tmp_path / "bad", names)
    assert done.exit_code == 1 and "Traceback" not in done.output, done.output
    assert {name: rows[name]["digest"] for name in GOOD} == {
        name: clean[name]["digest"] for name in GOOD}
    for name in bad:
        kind = name.rpartition("_")[0]
        if kind not in ANY:
            assert FAILS.get(kind, "") in rows[name].get("error", ""), (name, rows[name])
            assert (rows[name]["status"] == "failed") == (kind in FAILS), (name, rows[name])
    orphan = (tmp_path / "hostile.py.orphan").read_text()
    assert not Path("/proc", orphan).exists()
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


FEW = """
from desim.ports import Params as P
class Never:
    class Params(P): ""
    def __init__(self, params=None): raise ValueError("no")
    def choose(self, context): ""
"""


def test_a_dry_run_names_each_level_that_fails_though_no_probe_has_it(tmp_path):
    """Levels in pairs, so that no vector of a probe tells which of the two is to blame."""
    (tmp_path / "few.py").write_text(FEW)
    file = written(tmp_path, "parameters:\n  s: {key: coordination.strategy, values: "
                             "[nearest_frontier, random_frontier, 'few:Never']}\n"
                             "  robots: {key: fleet.size, values: [1, 2, 3, 9]}\niterations: 1\n")
    done = CliRunner().invoke(app, ["sweep", str(file), "--dry-run", "--out", str(tmp_path / "o")])
    fails = [line.partition(": fails: ") for line in done.output.splitlines() if "fails" in line]
    assert done.exit_code == 1
    assert [level for level, _, _ in fails] == ["s=few:Never", "robots=9"], done.output
    assert "ValueError: no" in fails[0][2] and "robot_" in fails[1][2]


def test_a_sweep_of_which_the_sample_fails_makes_the_others(tmp_path):
    """17 vectors or more are sampled: each second one, all of which fail."""
    (tmp_path / "half.py").write_text(FEW)
    (tmp_path / "o").mkdir()
    text = ("parameters:\n  beams: {key: robot.laser.beams, values: "
            f"{[*range(20, 30)]}}}\n  s: {{key: coordination.strategy, values: "
            "['half:Never', nearest_frontier]}\niterations: 1\n")
    done = CliRunner().invoke(app, ["sweep", str(written(tmp_path, text)), "--out",
                                    str(tmp_path / "o"), "--jobs", "1"])
    rows = read(tmp_path / "o" / "index.jsonl")[0].values()
    assert done.exit_code == 1, done.output
    assert sorted(row["status"] for row in rows) == ["failed"] * 10 + ["finished"] * 10


def test_a_sweep_of_which_all_levels_fail_does_not_start(tmp_path):
    (tmp_path / "none.py").write_text(FEW)
    file = written(tmp_path, "set: {coordination.strategy: 'none:Never'}\niterations: 1\n")
    done = CliRunner().invoke(app, ["sweep", str(file), "--out", str(tmp_path / "o")])
    assert done.exit_code == 2 and "base: a run fails at once: " in done.output
    assert not (tmp_path / "o").exists()


def test_a_relative_folder_is_the_drivers(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "moving.py").write_text(module())
    file = written(tmp_path, "iterations: 2\nset: {coordination.strategy: 'moving:moves_made'}\n")
    done = CliRunner().invoke(app, ["sweep", file.name, "--out", "here", "--jobs", "1"])
    assert done.exit_code == 0, done.output
    rows = read(tmp_path / "here" / "index.jsonl")[0]
    assert {path.name for path in (tmp_path / "here" / "runs" / "small").iterdir()} == set(rows)
    assert len(rows) == 2 and len(list((tmp_path / "here" / "output").iterdir())) == 2

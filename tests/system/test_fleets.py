"""Whole runs of each middleware while everything fails.

The fleet explores on, every message has a fate, who believes what can be looked at at any time, and
it all happens again the same way.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from io import StringIO

import numpy as np
import pytest
from fleets import CASES
from rich.console import Console
from runs import HERE, audited, built

from desim.commands.views import beliefs as report
from desim.monitor.meters.reachability import linked_at
from desim.monitor.summary import summarize
from desim.report.beliefs_figure import draw
from desim.results.beliefs import folded
from desim.results.traces import Rows
from desim.units import NS_PER_S


@pytest.fixture(scope="module")
def again():
    """The digests of some cases in a process with another hash seed."""
    return json.loads(subprocess.run(
        [sys.executable, str(HERE / "fleets.py")], capture_output=True, check=True,
        env={**os.environ, "PYTHONHASHSEED": "0"}).stdout)


@pytest.mark.parametrize("case", CASES)
def test_the_fleet_goes_on(case, again, tmp_path):
    rows: list[np.ndarray] = []
    run = built(*CASES[case], trace_sink=lambda batch: rows.append(batch.copy()))
    outcome = run.run()
    assert again.get(case, outcome.digest) == outcome.digest
    summary = summarize(run.monitor, outcome.simulated_ns)
    assert summary["exploration_time_s"] is not None
    # The halves are robots 0 and 1 and, when it starts, 2; robot_3 is dead. A master that comes
    # back empty does not tell those who stayed of robot_2, nor robot_2 of them.
    heard = 2 if case.startswith("ros") else 6
    assert (summary["resync_delay_s"]["pairs"], summary["resync_delay_s"]["resynced"]) == (6, heard)
    run.trace.flush()
    if run.monitor.links is not None:
        check_graph(run, Rows(np.concatenate(rows), run.names.items()), tmp_path)
    audited(run)


def check_graph(run, trace, folder):
    """Assert what ``desim graph`` shows at several instants; in the end nobody misses anything."""
    informed, links = run.graph.middleware.informed, run.monitor.links.table()
    for at_s in (0, 5, 11, 20, 40, 60):
        at_ns = at_s * NS_PER_S
        known = folded(trace, at_ns, informed, linked_at(links, at_ns))
        console = Console(file=StringIO(), width=200)
        report.show(known, console)
        shown = report.json_object(known)
        assert sum(shown["seen"].values()) == (sum(known.up.values()) * (len(known.up) - 1))
        if at_s == 20:
            assert shown["parts"] == [["base", "robot_0"], ["robot_1", "robot_2"]]
            draw(known, folder / "graph.png")
    beliefs = run.graph.context.beliefs
    assert (known.missing, known.ghosts) == (beliefs.missing, beliefs.ghosts)
    assert shown["parts"] == [["base", "robot_0", "robot_1", "robot_2"]]
    assert known.missing == 0 or type(run.graph.middleware).__name__ == "Ros1"

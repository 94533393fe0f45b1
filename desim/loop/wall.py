"""A run with real programs on the wall clock, in namespaces of this machine's own kernel."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path

from desim.loop.environment import path
from desim.loop.order import OUTPUT, Order
from desim.loop.supervision import Process, Supervisor, Watcher, carried_out
from desim.results.run import Run
from desim.scenario.schema.scenario import Scenario


def run_on_wall_clock(order: Order, scenario: Scenario, watcher: Watcher) -> Run:
    """Run ``order``, that of ``scenario``, as fast as time passes. Raises as ``carried_out`` does.
    """
    return carried_out(order, scenario.stop.elapsed_ns, Supervisor(
        _start, lambda process, reached, since_s: None, lambda said: None), watcher)


def _start(folder: Path) -> Process:
    """Start the process in network and mount namespaces of its own, where it may do what root may:
    all that it makes goes with it."""
    user = [] if os.geteuid() == 0 else ["--map-root-user"]
    inside = shlex.join([sys.executable, "-P", "-m", "desim.loop.inside", str(folder)])
    with (folder / OUTPUT).open("wb") as output:
        return subprocess.Popen(
            ["unshare", *user, "--net", "--mount", "--pid", "--fork", "--kill-child", "sh", "-c",
             f"mount -t tmpfs run /run && ip link set lo up && exec {inside}"],
            stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT,
            start_new_session=True, env={**os.environ, "PATH": path(os.environ)})

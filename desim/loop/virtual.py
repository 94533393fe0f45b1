"""A run with real programs in simulated time, in the guest."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

from desim.errors import ModelError
from desim.loop import guest
from desim.loop.busy_program import busy_program
from desim.loop.order import Order
from desim.loop.supervision import Process, Supervisor, Watcher, carried_out
from desim.results.folder import reserved
from desim.results.run import Run
from desim.scenario.schema.scenario import Scenario

STUCK_S = 120.0  # of computing without a second of simulated time


def run_virtually(order: Order, scenario: Scenario, kernel: Path, memory_mb: int,
                  watcher: Watcher) -> Run:
    """Run ``order``, that of ``scenario``, on the guest ``kernel`` with so much memory. Raises as
    ``carried_out`` does."""
    def failed(said: str) -> None:
        if killed := re.search(r"Out of memory: Killed process \d+ \((.*?)\)", said):
            raise ModelError(f"the guest's memory is full ({memory_mb} MB), and Linux has killed "
                             f"{killed[1]}; --memory gives it more")

    with reserved(order.out, scenario):
        return carried_out(order, scenario.stop.elapsed_ns, Supervisor(
            lambda folder: guest.boot(kernel, order, folder, scenario, memory_mb),
            partial(_stuck, memory_mb), failed), watcher)


def _stuck(memory_mb: int, process: Process, reached: str, since_s: float) -> None:
    if since_s > STUCK_S:
        busy = busy_program(process.pid) or "which one was not found"
        raise ModelError(f"the simulated clock has stood at {reached} s for {STUCK_S:.0f} s: a "
                         f"program computes without end and never sleeps ({busy}), or the guest's "
                         f"memory is too small ({memory_mb} MB; --memory)")

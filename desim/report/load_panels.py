"""The loads of robots' computers and interfaces over time: the plots of the paper's figure 6."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes

from desim.results.run import Run
from desim.scenario.robot_types import equipment_of

_WINDOW_S = 5.0  # the paper's robot log


def draw(panels: Sequence[Axes], run: Run, colours: dict[str, np.ndarray]) -> None:
    """Draw processors, memory, and the bytes received and sent a second in four ``panels``: of each
    robot in its colour of ``colours``, thin, and their mean in black. Rates are means of 5 s."""
    processors = [own.computer.processors for own in equipment_of(run.scenario)]
    limited = not np.isnan(run.robots["ram_percent"]).all()
    plots = (
        ("CPU [%]", _rates(run, "cpu_s", len(colours), 100.0 / np.array(processors))),
        ("RAM [%]", _levels(run, "ram_percent", len(colours))) if limited else
        ("RAM [MB]", _levels(run, "ram_mb", len(colours))),
        ("received [kB/s]", _rates(run, "rx_bytes", len(colours), 1e-3)),
        ("sent [kB/s]", _rates(run, "tx_bytes", len(colours), 1e-3)))
    for axes, letter, (label, (times_s, values)) in zip(panels, "efgh", plots, strict=True):
        for colour, own in zip(colours.values(), values.T, strict=True):
            axes.plot(times_s, own, color=colour, linewidth=0.6, alpha=0.7)
        axes.plot(times_s, values.mean(axis=1), color="black", linewidth=1.4)
        axes.set(title=f"({letter}) {label}", xlabel="simulated time [s]", ylim=(0.0, None),
                 xlim=(0.0, max(run.metrics["simulated_s"], 1e-9)))
        axes.grid(alpha=0.3)


def _levels(run: Run, column: str, robots: int) -> tuple[np.ndarray, np.ndarray]:
    """Times [n] in s, and [n, robots] values of ``column``."""
    return run.robots["time_s"][::robots], run.robots[column].reshape(-1, robots)


def _rates(run: Run, column: str, robots: int, scale: float | np.ndarray
           ) -> tuple[np.ndarray, np.ndarray]:
    """Times [n] in s, and [n, robots] increases of ``column`` a second, times ``scale``."""
    times_s, totals = _levels(run, column, robots)
    ends = [0]
    for row, time_s in enumerate(times_s):
        if time_s - times_s[ends[-1]] >= _WINDOW_S:
            ends.append(row)
    rates = [scale * (totals[end] - totals[begin]) / (times_s[end] - times_s[begin])
             for begin, end in pairwise(ends)]
    return times_s[ends[1:]], np.reshape(rates, (-1, robots))

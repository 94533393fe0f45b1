"""The loads of robots' computers and interfaces over time: the plots of the paper's figure 6."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from matplotlib.figure import FigureBase

from desim.results.run import Run
from desim.scenario.names import robot_names
from desim.scenario.robot_types import equipment_of

_WINDOW_S = 5.0  # the paper's robot log


def draw(figure: FigureBase, run: Run, colours: dict[str, np.ndarray]) -> None:
    """Draw panels of processors, memory, and the bytes received and sent a second: of each robot in
    its colour of ``colours``, and their mean and standard deviation. Rates are means of 5 s. The
    panel of memory is left out where the cost model knows none."""
    plots = _plots(run, len(colours))
    panels = figure.subplots(1, len(plots))
    for axes, letter, (label, (times_s, values)) in zip(panels, "efgh", plots, strict=False):
        for colour, own in zip(colours.values(), values.T, strict=True):
            axes.plot(times_s, own, color=colour, linewidth=0.6, alpha=0.7)
        mean, deviation = np.nanmean(values, axis=1), np.nanstd(values, axis=1)
        axes.fill_between(times_s, mean - deviation, mean + deviation, color="black", alpha=0.15,
                          linewidth=0)
        axes.plot(times_s, mean, color="black", linewidth=1.4)
        axes.set(title=f"({letter}) {label}", xlabel="simulated time [s]", ylim=(0.0, None),
                 xlim=(0.0, max(run.metrics["simulated_s"], 1e-9)))
        axes.grid(alpha=0.3)
    figure.suptitle("Loads of the robots (thin: each; black: mean; grey: standard deviation)",
                    fontsize=11)


def _plots(run: Run, robots: int) -> list[tuple[str, tuple[np.ndarray, np.ndarray]]]:
    """Titles, with times [n] in s and [n, robots] values."""
    processors = np.array([own.computer.processors for own in equipment_of(run.scenario)])
    kilo = np.where(np.isin(robot_names(run.scenario), run.scenario.robot.passive), np.nan, 1e-3)
    memory = []
    if "ram_mb" in run.robots:
        limited = not np.isnan(run.robots["ram_percent"]).all()
        memory = [("RAM [%]", _levels(run, "ram_percent", robots)) if limited else
                  ("RAM [MB]", _levels(run, "ram_mb", robots))]
    return [("CPU [%]", _rates(run, "cpu_s", robots, 100.0 / processors)), *memory,
            ("received [kB/s]", _rates(run, "rx_bytes", robots, kilo)),
            ("sent [kB/s]", _rates(run, "tx_bytes", robots, kilo))]


def _levels(run: Run, column: str, robots: int) -> tuple[np.ndarray, np.ndarray]:
    """Times [n] in s, and [n, robots] values of ``column``."""
    return run.robots["time_s"][::robots], run.robots[column].reshape(-1, robots)


def _rates(run: Run, column: str, robots: int, scale: np.ndarray
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

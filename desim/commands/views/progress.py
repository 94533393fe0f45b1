"""The progress of a run, shown by a thread of its own.

The thread reads counters: the simulation neither knows of it nor waits for it.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.live import Live
from rich.text import Text

from desim.api import Watch
from desim.commands.views.bars import REFRESH_HZ
from desim.commands.views.fleet_map import FleetMap
from desim.monitor.traffic import totals
from desim.results.folder import RunFolder
from desim.simulation.simulation import Simulation
from desim.units import NS_PER_S

_MOST_COLUMNS, _MOST_ROWS = 76, 30  # of the map
_PANEL_LINES = 6
LINE_EVERY_S = 10.0  # elsewhere


class Gauge:
    """Reads a simulation's counters, and their growth since the reading before."""

    def __init__(self, simulation: Simulation, folder: RunFolder,
                 clock: Callable[[], float] = time.perf_counter) -> None:
        self._simulation, self._folder, self._clock = simulation, folder, clock
        self._before = (clock(), 0, 0, 0)

    def read(self) -> dict[str, float]:
        """The readings: time_s, explored, explored_union, factor (simulated over wall time),
        messages_per_s and bytes_per_s of simulated time, links that carried a message in the last
        second."""
        simulation = self._simulation
        monitor, traffic = simulation.monitor, totals(simulation.graph)
        now = (self._clock(), simulation.kernel.now_ns, traffic.delivered, traffic.bytes_on_air)
        wall_s, sim_ns, messages, size_bytes = (
            after - before for after, before in zip(now, self._before, strict=True))
        self._before = now
        coverage, sim_s = monitor.coverage, sim_ns / NS_PER_S
        return {"time_s": now[1] / NS_PER_S,
                "explored": coverage.share(max(coverage.known, default=0)),
                "explored_union": coverage.share(coverage.union_known),
                "factor": sim_s / wall_s if wall_s > 0.0 else 0.0,
                "messages_per_s": messages / sim_s if sim_s > 0.0 else 0.0,
                "bytes_per_s": size_bytes / sim_s if sim_s > 0.0 else 0.0,
                "links": self._folder.active_links(now[1] - NS_PER_S)}


def watching(console: Console) -> Watch:
    """A ``watch`` for ``desim.api.run``: a panel with a map on a terminal, else a line every 10 s.
    """
    @contextmanager
    def watch(simulation: Simulation, folder: RunFolder) -> Iterator[None]:
        gauge = Gauge(simulation, folder)
        if console.is_terminal:
            width, height = console.size
            fleet = FleetMap(simulation.monitor, min(width, _MOST_COLUMNS),
                             max(min(height - _PANEL_LINES, _MOST_ROWS), 1))
            with Live(console=console, refresh_per_second=REFRESH_HZ, transient=True,
                      get_renderable=lambda: Text("\n").join([_panel(gauge.read()), fleet.draw()])):
                yield
            return
        over = threading.Event()
        thread = threading.Thread(target=_lines, args=(console, gauge, over), daemon=True)
        thread.start()
        try:
            yield
        finally:
            over.set()
            thread.join()

    return watch


def _lines(console: Console, gauge: Gauge, over: threading.Event) -> None:
    while not over.wait(LINE_EVERY_S):
        now = gauge.read()
        console.print(f"{now['time_s']:7.1f} s simulated, {now['factor']:.1f} times real time "
                      f"(wall), explored {now['explored']:.1%}, "
                      f"{now['messages_per_s']:.0f} messages/s, "
                      f"{now['bytes_per_s'] / 1e6:.2f} MB/s, {now['links']} links",
                      highlight=False, soft_wrap=True)


def _panel(now: dict[str, float]) -> Text:
    # Plain text: a rich table would cost seven times as much at every refresh.
    return Text("\n".join((
        f"simulated      {now['time_s']:8.1f} s   {now['factor']:.1f} times real time (wall)",
        f"explored       {now['explored']:8.1%}     {_bar(now['explored'])}",
        f"by the union   {now['explored_union']:8.1%}     {_bar(now['explored_union'])}",
        f"network        {now['messages_per_s']:8.0f} messages/s, "
        f"{now['bytes_per_s'] / 1e6:.2f} MB/s, {now['links']} active links")), no_wrap=True)


def _bar(share: float) -> str:
    full = round(share * 40)
    return "█" * full + "░" * (40 - full)

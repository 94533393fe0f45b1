"""A running simulation in a browser or in Foxglove, beside what the terminal shows."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext

from desim.api import Watch
from desim.commands.browser import open_page
from desim.commands.output import say
from desim.report.live.watch import Served, live
from desim.results.folder import RunFolder
from desim.simulation.simulation import Simulation


def shown_live(beside: Watch | None, servers: Sequence[Served], pace: float | None) -> Watch:
    """A ``watch`` for ``desim.api.run``: ``servers``, and what ``beside`` shows."""
    def opened(url: str) -> None:
        say(f"live at {url}")
        if url.startswith("http:"):
            open_page(url)

    @contextmanager
    def watch(simulation: Simulation, folder: RunFolder) -> Iterator[None]:
        with live(simulation, folder, servers, opened, pace or math.inf), \
                beside(simulation, folder) if beside else nullcontext():
            yield

    return watch

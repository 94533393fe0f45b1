"""A running simulation in a browser or in Foxglove, beside what the terminal shows."""

from __future__ import annotations

import math
import signal
import socket
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, nullcontext, suppress

from desim.api import Watch
from desim.commands.browser import is_terminal, open_page
from desim.commands.output import say
from desim.report.live.watch import Served, live
from desim.results.folder import RunFolder
from desim.simulation.simulation import Simulation


@contextmanager
def shown_live(beside: Watch | None, servers: Sequence[Served], pace: float | None
               ) -> Iterator[Watch]:
    """A ``watch`` for ``desim.api.run``: ``servers``, and what ``beside`` shows. At a terminal a
    page stays until Ctrl-C, after all else in the context; elsewhere servers end with it."""
    with ExitStack() as stack:
        sinks, pages = [], []
        for server in servers:
            sink, url = stack.enter_context(server)
            sinks.append(sink)
            say(f"live at {url}")
            if url.startswith("http:"):
                pages.append(url)
                open_page(url)

        @contextmanager
        def watch(simulation: Simulation, folder: RunFolder) -> Iterator[None]:
            with live(simulation, folder, sinks, pace or math.inf), \
                    beside(simulation, folder) if beside else nullcontext():
                yield

        yield watch
        if pages and is_terminal():
            with suppress(KeyboardInterrupt):
                _stay(f"the page stays at {pages[0]} until Ctrl-C")


def _stay(why: str) -> None:
    """Say ``why``, and wait for Ctrl-C, which raises ``KeyboardInterrupt``. A lock would miss one
    that comes just before it begins to wait; a socket that signals write to does not."""
    ours, theirs = socket.socketpair()
    with ours, theirs:
        theirs.setblocking(False)
        before = signal.set_wakeup_fd(theirs.fileno(), warn_on_full_buffer=False)
        try:
            say(why)
            while True:
                ours.recv(1)
        finally:
            signal.set_wakeup_fd(before)

"""A running simulation for browsers: the replay page, and a chunk for it of each stretch."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager

from desim.report.live.feed import Sink
from desim.report.live.server import ChunkLog, LiveServer
from desim.report.live.stretch import RUNNING, Stretch
from desim.report.replay.bundle import bundle
from desim.report.replay.page import page


@contextmanager
def page_served(port: int = 0) -> Iterator[tuple[Sink, str]]:
    """The page of the run, for browsers. Raises ``InputError`` for a ``port`` that is taken."""
    log = ChunkLog()
    with LiveServer(page([]), log, port) as server:
        yield page_sink(log), server.url


def page_sink(log: ChunkLog) -> Sink:
    """Adds each stretch to ``log``, as a live page reads it (``assets/page/live.js``)."""
    def add(stretch: Stretch) -> None:
        about, columns = bundle(stretch)
        about["columns"] = columns.index
        log.add(json.dumps([about, columns.text(level=1)], allow_nan=False))
        if about["status"] != RUNNING:
            log.close()

    return add

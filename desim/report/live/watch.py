"""A running simulation that programs of this machine watch."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager

from desim.engine.kernel import Phase
from desim.errors import InputError
from desim.report.live.feed import LiveFeed, Sink
from desim.report.live.stretch import Stretches
from desim.results.folder import RunFolder
from desim.simulation.simulation import Simulation

_LAST = (1 << 64) - 1  # the entity after all others

# A server that runs until the context ends: what it serves, and its address.
Served = AbstractContextManager[tuple[Sink, str]]


@contextmanager
def live(simulation: Simulation, folder: RunFolder, sinks: Sequence[Sink],
         pace: float = math.inf) -> Iterator[None]:
    """Give a run to ``sinks`` while its clock runs, at most ``pace`` simulated seconds a second. In
    the end they have the whole run.

    Raises ``InputError`` for a run that keeps no recording.
    """
    if folder.recorder is None:
        raise InputError("a run with trace.keep none or messages has nothing to show while it goes "
                         "on; allowed: replay, all")
    feed = LiveFeed(Stretches(simulation, folder, folder.recorder), sinks, pace)
    simulation.kernel.ticker(1, Phase.OBSERVE, _LAST, feed.sample)
    yield
    feed.end()

"""The signal of a received message, as a radio's driver reports it: the power of its frames."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from desim.middleware.graph import Graph
from desim.middleware.message import Message
from desim.network.medium import Medium
from desim.network.surroundings import Surroundings
from desim.ports import HearsAntennas, Obstacles, PredictsSignal

Power = Callable[[], float | None]  # dBm


class LinkSignals:
    """The signals of messages between the hosts of ``graph``, which stand at ``place``."""

    def __init__(self, graph: Graph, place: Surroundings) -> None:
        self._graph, self._place = graph, place
        self._predicting = {medium for medium in graph.media
                            if isinstance(medium.model, HearsAntennas | PredictsSignal)}

    def at(self, receiver: str) -> Callable[[Message], Power | None] | None:
        """A function that returns the power at which ``receiver`` has received a message, which it
        reads now. It is that between the places of now, whenever it is computed. None if other
        hosts have forwarded the message. None instead of the function: no network model has
        signals."""
        return partial(self._of, self._graph.host(receiver).index) if self._predicting else None

    def _of(self, to: int, message: Message) -> Power | None:
        graph, from_ = self._graph, message.origin
        medium = graph.routes.at_present(from_, to, message.topic)
        if not isinstance(medium, Medium) or medium not in self._predicting:
            return None
        ends_m = self._place.positions(graph.kernel.now_ns).take((from_.index, to), axis=0)
        return partial(_power_dbm, medium.model, from_.index, to, ends_m, self._place.obstacles)


def _power_dbm(model: object, sender: int, receiver: int, ends_m: np.ndarray,
               obstacles: Obstacles) -> float | None:
    """The power of one host at another, at ``ends_m`` [2, 2] m with ``obstacles`` between them."""
    if isinstance(model, HearsAntennas):
        signal = model.link_signal(sender, receiver, ends_m, obstacles)
    elif isinstance(model, PredictsSignal):
        signal = model.signal(ends_m[0], ends_m[1:])
    else:
        return None
    return float(signal.power_dbm[0])

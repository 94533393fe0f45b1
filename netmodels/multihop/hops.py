"""The single hops underneath: a model of the air, and the context that it works in."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from operator import attrgetter
from typing import Any

import numpy as np

from desim import ports

# What became of a hop at some receivers; None: at all of whom nothing was said before.
Told = Callable[[Any, ports.Frame, Sequence[int] | None, ports.Deliver | ports.Drop], None]


class Hops:
    """Sends frames over one hop and says what became of them.

    Frames from above, which have a number of their own, may be sent as they are (``model.send``):
    what becomes of them is settled above. The others' numbers are negative.
    Hosts that are not ``up`` have no place.
    """

    def __init__(self, model: ports.NetworkModel, context: ports.Context, hosts: int) -> None:
        self._context = context
        self._model = model
        self.up = [True] * hosts
        self._last = 0
        self._open: dict[int, tuple[Told, Any, int]] = {}  # and receivers that are left
        self._places: np.ndarray | None = None
        self._seen: np.ndarray | None = None
        self.at, self.stream = context.at, context.stream

    now_ns = property(attrgetter("_context.now_ns"))
    obstacles = property(attrgetter("_context.obstacles"))

    def send(self, source: int, receivers: tuple[int, ...], size_bytes: int, segments: int,
             broadcast: bool, told: Told, arg: Any) -> None:
        """``told(arg, frame, receivers, verdict)`` hears of it: once of a unicast frame, of a
        broadcast as often as there are different fates."""
        self._last -= 1
        self._open[self._last] = told, arg, len(receivers)
        self._model.send(ports.Frame(self._last, source, receivers, size_bytes, segments,
                                     broadcast))

    def switched(self, host: int, up: bool) -> None:
        if self.up[host] != up:
            self.up[host] = up
            self._seen = None

    def positions(self, time_ns: int) -> np.ndarray:
        places = self._context.positions(time_ns)
        if places is not self._seen:
            self._seen, self._places = places, places
            if not all(self.up):
                self._places = places.copy()
                self._places[~np.array(self.up)] = np.nan
                self._places.flags.writeable = False
        return self._places

    def settle(self, frame: ports.Frame, receiver: int, verdict: Any) -> None:
        if frame.id > 0:
            self._context.settle(frame, receiver, verdict)
        else:
            self.settle_many(frame, (receiver,), verdict)

    def settle_many(self, frame: ports.Frame, receivers: Sequence[int] | None,
                    verdict: Any) -> None:
        if frame.id > 0:
            self._context.settle_many(frame, receivers, verdict)
            return
        if not frame.broadcast:
            told, arg, _ = self._open.pop(frame.id)
            told(arg, frame, frame.receivers, verdict)
            return
        if frame.id in self._open:  # else there is nobody left
            told, arg, left = self._open.pop(frame.id)
            left -= left if receivers is None else len(receivers)
            if left:
                self._open[frame.id] = told, arg, left
            told(arg, frame, receivers, verdict)

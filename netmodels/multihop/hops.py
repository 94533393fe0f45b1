"""The single hops underneath: a model of the air, and the context that it works in."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from operator import attrgetter
from typing import Any

import numpy as np

from desim import ports

# What became of a frame at some receivers of one hop.
Told = Callable[[Any, ports.Frame, Sequence[int], ports.Deliver | ports.Drop], None]


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
        self._open: dict[int, tuple[Told, Any, list[int]]] = {}  # and who is settled
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
        self._open[self._last] = told, arg, []
        frame = ports.Frame(self._last, source, receivers, size_bytes, segments, broadcast)
        delay_ns = self._model.send(frame)
        if delay_ns is not None:
            self.settle_many(frame, None, ports.Deliver(delay_ns))

    def switched(self, host: int, up: bool) -> None:
        if self.up[host] != up:
            self.up[host] = up
            self._seen = None

    def positions(self, time_ns: int) -> np.ndarray:
        places = self._context.positions(time_ns)
        if places is not self._seen:
            self._seen, self._places = places, places
            if not all(self.up):
                self._places = np.where(np.array(self.up)[:, None], places, np.nan)
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
        if frame.id not in self._open:
            return  # the rest is nobody
        told, arg, known = self._open[frame.id]
        if receivers is None:
            receivers = [receiver for receiver in frame.receivers if receiver not in known]
        known.extend(receivers)
        if len(known) == len(frame.receivers):
            del self._open[frame.id]
        told(arg, frame, receivers, verdict)

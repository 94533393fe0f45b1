"""The single hops underneath: a model of the air, and the context that it works in."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from operator import attrgetter
from typing import Any

import numpy as np

from desim import ports

# What became of a frame at some receivers of one hop, and which packets of a unicast train were
# lost on it (number to reason).
Told = Callable[[Any, ports.Frame, Sequence[int], ports.Deliver | ports.Drop, dict[int, str]],
                None]


class _Leg:
    """A frame of our own on the air: who wants to hear of it, and at which receivers it is settled;
    which of its packets are lost, of a broadcast by receiver."""

    __slots__ = ("told", "arg", "settled", "lost", "lacking")

    def __init__(self, told: Told, arg: Any) -> None:
        self.told, self.arg = told, arg
        self.settled: list[int] = []
        self.lost: dict[int, str] = {}
        self.lacking: dict[int, set[int]] = {}


class Hops:
    """Sends frames over one hop and says what became of them.

    Frames from above, which have a number of their own, may be sent as they are (``model.send``):
    what becomes of them is settled above. The others' numbers are negative.
    Hosts that are not ``up`` have no place. ``refuses`` are the model's.
    """

    def __init__(self, model: ports.NetworkModel, context: ports.Context, hosts: int) -> None:
        self._context = context
        self._model = model
        self.refuses = frozenset(getattr(model, "refuses", ()))
        self.up = [True] * hosts
        self._last = 0
        self._open: dict[int, _Leg] = {}
        self._places: np.ndarray | None = None
        self._seen: np.ndarray | None = None
        self.at, self.stream = context.at, context.stream
        self.judge_transmission, self.shared = context.judge_transmission, context.shared

    now_ns = property(attrgetter("_context.now_ns"))
    obstacles = property(attrgetter("_context.obstacles"))

    def send(self, source: int, receivers: tuple[int, ...], size_bytes: int, segments: int,
             broadcast: bool, told: Told, arg: Any) -> None:
        """``told(arg, frame, receivers, verdict, lost)`` hears of it: once of a unicast frame, of a
        broadcast as often as there are different fates."""
        self._last -= 1
        self._open[self._last] = _Leg(told, arg)
        frame = ports.Frame(self._last, source, receivers, size_bytes, segments, broadcast)
        delay_ns = self._model.send(frame)
        if delay_ns is not None:
            self.settle_many(frame, None, ports.Deliver(delay_ns))

    def flow(self, frame: ports.Frame) -> Hashable:
        """All that is sent here between the same hosts is one flow."""
        return (self._context.flow(frame) if frame.id > 0
                else ("hop", frame.source, frame.receivers))

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
        elif frame.id not in self._open:
            return  # the rest of a broadcast is nobody
        elif frame.broadcast:
            self._settle_broadcast(frame, receivers, verdict)
        else:
            self._settle_unicast(frame, verdict)

    def _settle_unicast(self, frame: ports.Frame, verdict: ports.Deliver | ports.Drop) -> None:
        leg = self._open[frame.id]
        if type(verdict) is ports.Drop and verdict.packets is not None:
            leg.lost |= dict.fromkeys(verdict.packets, verdict.reason)
            if len(leg.lost) < frame.segments:
                return
            verdict = ports.Drop(verdict.reason)
        del self._open[frame.id]
        leg.told(leg.arg, frame, frame.receivers, verdict, leg.lost)

    def _settle_broadcast(self, frame: ports.Frame, receivers: Sequence[int] | None,
                          verdict: ports.Deliver | ports.Drop) -> None:
        """Who lacks a packet has heard nothing."""
        leg = self._open[frame.id]
        if type(verdict) is ports.Drop and verdict.packets is not None:
            for receiver in receivers:
                leg.lacking.setdefault(receiver, set()).update(verdict.packets)
            receivers = [receiver for receiver in receivers
                         if len(leg.lacking[receiver]) == frame.segments]
        elif receivers is None:
            receivers = [receiver for receiver in frame.receivers if receiver not in leg.settled]
        leg.settled.extend(receivers)
        if len(leg.settled) == len(frame.receivers):
            del self._open[frame.id]
        leg.told(leg.arg, frame, [receiver for receiver in receivers
                                  if receiver not in leg.lacking], verdict, {})

"""The range-and-bearing boards of ARGoS."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from desim import ports
from desim.units import ByteSize, Length, Period, Ratio
from netmodels.compatible.obstruction import unobstructed
from netmodels.itemized import Itemized
from netmodels.random_loss import PairStreams

_TOO_LONG, _OVERWRITTEN = ports.Drop("too_long"), ports.Drop("overwritten")
_HIDDEN, _LOST = ports.Drop("obstructed"), ports.Drop("random_loss")


class ArgosRab(Itemized):
    """ARGoS' range-and-bearing medium (argos3, plugins/simulator/media/rab_medium and the sensor
    for it): in every tick each host nearer than ``range`` and in sight gets the one message that a
    sender has for all, unless it is dropped by chance.

    A message is of a fixed size: what is larger than ``size`` without its headers is ``too_long``.
    A sender has one at a time: another message before the tick is over takes its place
    (``overwritten``), whatever its receivers. At the end of the tick it is there, with the
    places and walls of that moment. Walls and people block the sight; a train is one message.

    Left out: robots that block the sight, distance and bearing that a receiver measures, with their
    noise, and that ARGoS repeats a message in every tick until there is another one. A host without
    a place gets and sends nothing.

    Capabilities: LimitsReach, Refuses, Itemizes.
    """

    class Params(ports.Params):
        range_m: Length = Field("3 m", gt=0, description="of a sender, rab_range (ARGoS: foot-bot, "
                                                         "Khepera IV)")
        size_bytes: ByteSize = Field("10 B", description="of a message, rab_data_size (ARGoS: "
                                                         "foot-bot)")
        headers_bytes: ByteSize = Field("46 B", description=(
            "of each packet, which do not count: there are none in ARGoS (Ethernet, IP, UDP)"))
        drop_probability: Ratio = Field(0.0, description="of a message at one receiver (ARGoS: "
                                                         "none)")
        tick_ns: Period = Field("100 ms", description="(ARGoS' examples: 10 ticks a second)")

    reasons = ("obstructed", "out_of_range", "out_of_reach", "overwritten", "random_loss",
               "too_long")
    refuses = ("too_long",)

    def __init__(self, params: Params) -> None:
        self._params = params
        self.reach_m = params.range_m

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self._context = context
        self._streams = PairStreams(context, "argos_rab", hosts)
        self._said: dict[int, ports.Frame] = {}  # by sender, in this tick

    def send(self, frame: ports.Frame) -> None:
        context, params = self._context, self._params
        if frame.size_bytes - frame.segments * params.headers_bytes > params.size_bytes:
            context.settle_many(frame, frame.receivers, _TOO_LONG)
            return
        if not self._said:
            context.at((context.now_ns // params.tick_ns + 1) * params.tick_ns, self._tick)
        before = self._said.get(frame.source)
        self._said[frame.source] = frame
        self._ledger.spent(frame, ports.TimePart.CONTENTION,
                           params.tick_ns - context.now_ns % params.tick_ns)
        if before is not None:
            context.settle_many(before, before.receivers, _OVERWRITTEN)

    def _tick(self, _: None) -> None:
        said, self._said = self._said, {}  # a settled frame may let its sender send again
        for source in sorted(said):
            self._settle(said[source])

    def _settle(self, frame: ports.Frame) -> None:
        context, params = self._context, self._params
        places = context.positions(context.now_ns)
        here, there = places[frame.source], places[list(frame.receivers)]
        near = np.hypot(*(there - here).T) < params.range_m  # False for NaN
        seen = unobstructed(context.obstacles, here, there)
        beyond = ports.Drop("out_of_reach" if frame.broadcast else "out_of_range")
        fates: dict[ports.Deliver | ports.Drop, list[int]] = {}
        for k, receiver in enumerate(frame.receivers):
            kept = self._streams(frame.source, receiver).random() >= params.drop_probability
            fate = (beyond if not near[k] else _HIDDEN if not seen[k]
                    else ports.Deliver(0) if kept else _LOST)
            fates.setdefault(fate, []).append(receiver)
        for fate, receivers in fates.items():
            context.settle_many(frame, receivers, fate)

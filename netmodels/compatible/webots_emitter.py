"""The emitters and receivers of Webots."""

from __future__ import annotations

from collections import deque
from typing import Literal

import numpy as np
from pydantic import Field

from desim import ports
from desim.units import NS_PER_S, BitRate, ByteSize, Length, Period
from netmodels.compatible.obstruction import unobstructed
from netmodels.itemized import Itemized

_FULL, _HIDDEN = ports.Drop("queue_full"), ports.Drop("obstructed")


class WebotsEmitter(Itemized):
    """Webots' Emitter and Receiver (its reference manual): a packet goes to all within ``range`` of
    its sender, at ``baud_rate``, out of a queue of ``buffer`` bytes.

    A packet takes bytes * ``byte_size`` / ``baud_rate`` behind those before it, at least a basic
    time step, and is there at the end of a step. One that would make more bytes wait than the
    buffer holds, what is being sent included, is refused (``queue_full``). Range, and
    for ``infra-red`` sight, are those when the packet has been sent; ``radio`` goes through
    walls and people. Nothing else is lost, nobody hinders anybody else. A train is one packet; all
    bytes are the frame's, headers included.

    The signal strength is Webots' 1 / distance^2, here as 0 dBm at 1 m. Left out: the cones of
    ``infra-red`` (a network does not know where hosts look), robots that block its sight, channels
    (media are), and the receiver's buffer, which our hosts empty at once. A host without a place
    gets and sends something only if the range is infinite.

    Capabilities: Refuses, Itemizes, PredictsSignal; with ``range``, LimitsReach.
    """

    class Params(ports.Params):
        type: Literal["radio", "infra-red"] = Field("radio", description="whether walls are in the "
                                                                         "way (Webots: radio)")
        range_m: Length | None = Field(None, gt=0, description="(Webots: null, infinite)")
        baud_rate_bps: BitRate | None = Field(None, description="(Webots: null, infinite)")
        byte_size: int = Field(8, ge=8, le=64, description="bits that a byte takes (Webots)")
        buffer_bytes: ByteSize | None = Field(None, description="of a sender (Webots: null, "
                                                                "unlimited)")
        step_ns: Period = Field("32 ms", description="basicTimeStep (Webots)")

    reasons = ("obstructed", "out_of_range", "out_of_reach", "queue_full")
    refuses = ("queue_full",)

    def __init__(self, params: Params) -> None:
        self._params = params
        if params.range_m is not None:
            self.reach_m = params.range_m

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self._context = context
        self._queues: list[deque[tuple[int, int]]] = [deque() for _ in hosts]  # ends, bytes

    def send(self, frame: ports.Frame) -> None:
        context, params, queue = self._context, self._params, self._queues[frame.source]
        now_ns, limit = context.now_ns, params.buffer_bytes
        while queue and queue[0][0] <= now_ns:
            queue.popleft()
        waiting = sum(size_bytes for _, size_bytes in queue)
        if limit is not None and waiting + frame.size_bytes > limit:
            context.settle_many(frame, frame.receivers, _FULL)
            return
        begin_ns = queue[-1][0] if queue else now_ns
        end_ns = begin_ns + self._airtime_ns(frame.size_bytes)
        sent_ns = -(-max(end_ns, now_ns + params.step_ns) // params.step_ns) * params.step_ns
        queue.append((end_ns, frame.size_bytes))
        spent = self._ledger.spent
        spent(frame, ports.TimePart.QUEUE, begin_ns - now_ns)
        spent(frame, ports.TimePart.AIRTIME, end_ns - begin_ns)
        spent(frame, ports.TimePart.PROPAGATION, sent_ns - end_ns)  # to the end of a step
        context.at(sent_ns, self._sent, frame)

    def signal(self, from_m: np.ndarray, to_m: np.ndarray) -> ports.Signal:
        """Strength 1 is 0 dBm; delivery is all or nothing."""
        near, seen = self._reached(from_m, to_m)
        with np.errstate(divide="ignore"):
            return ports.Signal(-20 * np.log10(np.hypot(*(to_m - from_m).T)), 1.0 * (near & seen))

    def _airtime_ns(self, size_bytes: int) -> int:
        rate_bps = self._params.baud_rate_bps
        bits = size_bytes * self._params.byte_size
        return 0 if rate_bps is None else -(-bits * NS_PER_S // rate_bps)

    def _sent(self, frame: ports.Frame) -> None:
        places = self._context.positions(self._context.now_ns)
        near, seen = self._reached(places[frame.source], places[list(frame.receivers)])
        receivers = np.array(frame.receivers)
        beyond = ports.Drop("out_of_reach" if frame.broadcast else "out_of_range")
        for those, fate in ((near & seen, ports.Deliver(0)), (near & ~seen, _HIDDEN),
                            (~near, beyond)):
            if those.any():
                self._context.settle_many(frame, receivers[those].tolist(), fate)

    def _reached(self, from_m: np.ndarray, to_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """[n] who is in range, and who is in sight."""
        range_m = self._params.range_m
        near = (np.ones(len(to_m), bool) if range_m is None
                else np.hypot(*(to_m - from_m).T) <= range_m)  # False for NaN
        if self._params.type == "radio":
            return near, np.ones(len(to_m), bool)
        return near, unobstructed(self._context.obstacles, from_m, to_m)

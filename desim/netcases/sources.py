"""The senders of a network case."""

from __future__ import annotations

from abc import ABC, abstractmethod
from array import array
from collections import Counter
from collections.abc import Collection, Iterator
from itertools import pairwise

import numpy as np

from desim.engine.kernel import Kernel, Phase
from desim.network.carrier import Carrier
from desim.network.medium import Medium
from desim.ports.cases import Flow
from desim.units import PERIOD

_DRAWN = 1024  # gaps at a time
_PATIENCE_NS = 10_000_000  # of a saturated source without a way, or behind a full queue


class Source(ABC):
    """Sends one flow and counts its fates."""

    def __init__(self, flow: Flow, hosts: tuple[str, ...], kernel: Kernel, entity: int) -> None:
        self.flow, self._kernel, self._entity = flow, kernel, entity
        self._saturated = flow.arrivals == "saturated"
        self._host = hosts.index(flow.source)
        self.forget()

    def forget(self) -> None:
        """Count anew."""
        self.sent = 0
        self.arrivals_ns = array("q")
        self.delays_ns = array("q")
        self.losses: Counter[str] = Counter()

    def begin(self, stream: np.random.Generator) -> None:
        after, flow = self._kernel.after, self.flow
        for _ in range(-(-(flow.backlog + 2 * self._saturated) // flow.train)):
            after(flow.begin_ns, Phase.CONTROL, self._entity, self._send)
        if not self._saturated:
            self._gaps = _gaps(flow, stream)
            after(flow.begin_ns + next(self._gaps), Phase.CONTROL, self._entity, self._next)

    def _next(self, _: object) -> None:
        self._send(None)
        self._kernel.after(next(self._gaps), Phase.CONTROL, self._entity, self._next)

    @abstractmethod
    def _send(self, _: object) -> None:
        """Send the next packet or message."""

    def _count(self, sent_ns: int, packets: int = 1) -> None:
        """Count an arrival now, of packets that were sent at ``sent_ns``."""
        now_ns = self._kernel.now_ns
        self.arrivals_ns.extend([now_ns] * packets)
        self.delays_ns.extend([now_ns - sent_ns] * packets)


class PacketSource(Source, Carrier[int]):
    """Sends packets, as the medium's ``Carrier``. The token of a frame is the time when it was
    sent. A copy counts as no further arrival."""

    def __init__(self, flow: Flow, hosts: tuple[str, ...], kernel: Kernel, entity: int,
                 medium: Medium) -> None:
        super().__init__(flow, hosts, kernel, entity)
        self._medium, self._held_back = medium, 0
        legs = tuple(map(hosts.index, (flow.source, *flow.via, *flow.receivers)))
        self._receivers = legs[1:2] if flow.via else tuple(sorted(legs[1:]))
        # By receiver, the host to which the frame goes on from there.
        self._next_host = dict.fromkeys(self._receivers, self._host) if flow.echo else dict(
            pairwise(legs[1:])) if flow.via else {}

    def _send(self, _: object) -> None:
        flow = self.flow
        self.sent += flow.train
        self._medium.transmit(self._host, self._receivers, flow.train * flow.size_bytes, flow.train,
                              flow.broadcast, self, self._kernel.now_ns)

    def arrived(self, sent_ns: int, receiver: int) -> None:
        if receiver in self._next_host:
            self._medium.transmit(receiver, (self._next_host[receiver],), self.flow.size_bytes, 1,
                                  False, self, sent_ns)
            return
        self._count(sent_ns, self.flow.train)
        if self._saturated:
            self._send(None)

    def arrived_in_part(self, sent_ns: int, receiver: int, lost: dict[int, str]) -> None:
        self.losses.update(lost.values())
        self._count(sent_ns, self.flow.train - len(lost))
        if self._saturated:
            self._send(None)

    def lost(self, sent_ns: int, receiver: int, reason: str) -> None:
        self.losses[reason] += self.flow.train
        is_refused = sent_ns == self._kernel.now_ns
        is_full = reason.endswith("queue_full")
        if not self._saturated or (is_refused and is_full):
            return  # a packet that left the own queue makes room, and is followed by another one
        if not is_refused and not is_full:
            self._send(None)
            return
        self._held_back += 1
        if self._held_back == 1:
            self._kernel.after(_PATIENCE_NS, Phase.CONTROL, self._entity, self._try_again)

    def _try_again(self, _: object) -> None:
        self._held_back -= 1
        if self._held_back:
            self._kernel.after(_PATIENCE_NS, Phase.CONTROL, self._entity, self._try_again)
        self._send(None)

    def missed(self, sent_ns: int, receivers: Collection[int], reason: str,
               medium: Medium) -> None:
        self.losses[reason] += len(receivers)


def _gaps(flow: Flow, stream: np.random.Generator) -> Iterator[int]:
    """The times in ns from 0 to the first frame, from there to the second one, and so on."""
    if flow.arrivals == "poisson":
        while True:
            drawn_ns = np.minimum(stream.exponential(flow.every_ns, _DRAWN), PERIOD.maximum)
            yield from np.rint(drawn_ns).astype(np.int64).tolist()
    yield int(stream.integers(flow.every_ns)) if flow.arrivals == "periodic" else 0
    while True:
        yield flow.every_ns

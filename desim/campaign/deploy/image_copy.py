"""The time to copy an image to many hosts over a network model."""

from __future__ import annotations

from collections import deque

from desim.campaign.deploy.testbed import Copy, Rounds, hosts_of
from desim.engine.kernel import Kernel
from desim.engine.streams import Streams
from desim.engine.trace import Names
from desim.errors import InputError
from desim.middleware.headers import stream_frame
from desim.network.carrier import Carrier
from desim.network.medium import Medium
from desim.ports import NetworkModel, natural_key

PART_BYTES = 4_000_000  # of a copy in one message: a socket's buffer
_UNDER_WAY = 2  # parts of a host in the network, so that there is always one to send
_MOST_LOSSES = 100  # parts in a row: nothing gets through
_FOR_EVER_NS = 10**18


def round_ends_ns(model: NetworkModel, rounds: Rounds, image_bytes: int) -> list[int]:
    """The end of each round of copies, where a round begins when the one before is over. A host
    that makes several copies at a time sends a part of each in turn. Disks are never the
    bottleneck. Raises ``InputError`` where the network lets nothing through."""
    hosts = tuple(sorted(hosts_of(rounds), key=natural_key))
    kernel, names = Kernel(), Names()
    medium = Medium("lan", model, kernel=kernel, names=names, streams=Streams(0), hosts=hosts)
    ends_ns = []
    for copies in rounds:
        _Round(copies, image_bytes, medium, hosts, kernel).begin()
        kernel.run(_FOR_EVER_NS)
        ends_ns.append(kernel.now_ns)
    return ends_ns


class _Round(Carrier[tuple[int, tuple[int, int]]]):
    """Simultaneous copies. It stops the clock when they are complete."""

    def __init__(self, copies: list[Copy], image_bytes: int, medium: Medium,
                 hosts: tuple[str, ...], kernel: Kernel) -> None:
        whole, rest_bytes = divmod(image_bytes, PART_BYTES)
        sizes = [PART_BYTES] * whole + [rest_bytes] * (rest_bytes > 0)
        pairs = [(hosts.index(source), hosts.index(taker)) for source, taker in copies]
        self._left = len(copies) * len(sizes)
        self._losses = 0  # since a part arrived
        self._medium, self._kernel = medium, kernel
        self._parts: dict[int, deque[tuple[int, int]]] = {}  # by host: to whom, how large
        for size_bytes in sizes:
            for source, taker in pairs:
                self._parts.setdefault(source, deque()).append((taker, size_bytes))

    def begin(self) -> None:
        for source, parts in self._parts.items():
            for _ in range(min(_UNDER_WAY, len(parts))):
                self._send(source)

    def _send(self, source: int) -> None:
        part = taker, size_bytes = self._parts[source].popleft()
        wire_bytes, segments = stream_frame(size_bytes)
        self._medium.transmit(source, (taker,), wire_bytes, segments, False, self,
                              (source, part))

    def arrived(self, token: tuple[int, tuple[int, int]], _: int) -> None:
        source = token[0]
        self._losses = 0
        self._left -= 1
        if self._left == 0:
            self._kernel.stop()
        elif self._parts[source]:
            self._send(source)

    def arrived_in_part(self, token: tuple[int, tuple[int, int]], receiver: int,
                        lost: dict[int, str]) -> None:
        """The whole part is copied again."""
        self.lost(token, receiver, next(iter(lost.values())))

    def lost(self, token: tuple[int, tuple[int, int]], _: int, reason: str) -> None:
        source, part = token
        self._losses += 1
        if self._losses > _MOST_LOSSES:
            raise InputError(f"the network loses every part of the image ({reason})")
        self._parts[source].appendleft(part)
        self._send(source)

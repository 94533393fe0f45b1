"""Frames, and what rules and network models answer about them."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple, final

_new = tuple.__new__  # a Frame at half the price


class Frame(NamedTuple):
    """The unit that occupies a medium: one packet, or a train of packets of one message on one hop.

    ``source`` and ``receivers`` (ascending) are host indices (rows of ``Context.positions``).
    ``size_bytes`` is the whole train with its headers, ``segments`` how many packets it is. A
    unicast frame has one receiver and ``broadcast`` False.
    """

    id: int
    source: int
    receivers: tuple[int, ...]
    size_bytes: int
    segments: int
    broadcast: bool

    def among(self, hosts: Sequence[int]) -> list[int]:
        """Those of ``hosts`` that are receivers, in their order."""
        receivers, source = self.receivers, self.source
        last = receivers[-1]
        if len(receivers) == last + (source > last):  # all up to the last, but the source itself
            if hosts and min(hosts) >= 0 and max(hosts) <= last and source not in hosts:
                return list(hosts)
            return [host for host in hosts if 0 <= host <= last and host != source]
        return [host for host in hosts
                if host <= last and receivers[bisect_left(receivers, host)] == host]


class Frames(NamedTuple):
    """Unicast frames that one host sends in one instant, in this order, equal but for their
    receiver: the first has the number ``id`` and goes to the first of ``receivers``, the second
    ``id + 1``, and so on."""

    id: int
    source: int
    receivers: tuple[int, ...]
    size_bytes: int
    segments: int

    def single(self, i: int) -> Frame:
        """Frame i, counted from 0, for itself."""
        id_, source, receivers, size_bytes, segments = self
        return _new(Frame, (id_ + i, source, (receivers[i],), size_bytes, segments, False))

    def singly(self) -> list[Frame]:
        """The same frames, each for itself."""
        return [self.single(i) for i in range(len(self.receivers))]


FULL_PACKET_BYTES = 1500 + 14 + 4  # Ethernet's MTU, its header and its check sequence


@lru_cache(maxsize=1 << 10)
def packet_sizes(size_bytes: int, segments: int) -> tuple[int, ...]:
    """The bytes of each packet of a train: full ones and a rest where that fits, else equal ones as
    far as possible."""
    rest = size_bytes - (segments - 1) * FULL_PACKET_BYTES
    if 0 < rest <= FULL_PACKET_BYTES:
        return (FULL_PACKET_BYTES,) * (segments - 1) + (rest,)
    each, longer = divmod(size_bytes, segments)
    return (each + 1,) * longer + (each,) * (segments - longer)


@final  # its type is asked by ``is``
class Pass(NamedTuple):
    """From a rule: nothing changes for this receiver."""


@final  # its type is asked by ``is``
class Deliver(NamedTuple):
    """Delivered, ``delay_ns`` (int >= 0) from now. From a rule: so much later than by the network
    model alone; the delays of several rules add up."""

    delay_ns: int


@final  # its type is asked by ``is``
class Drop(NamedTuple):
    """Not delivered, for one of the reasons that the plug-in's class declares. A function that is a
    rule gives none: the reason is its name.

    ``packets`` are the numbers (ints from 0, ascending) of those packets of a train that are lost;
    None: the whole frame. A rule takes them out, and the rest goes on. A model that names packets
    has not settled the frame yet: it delivers or drops the rest later; naming the last ones that
    are left settles it.
    """

    reason: str = ""
    packets: tuple[int, ...] | None = None


@final  # its type is asked by ``is``
class Duplicate(NamedTuple):
    """From a rule: where all of the frame is delivered, a copy follows ``after_ns`` (int >= 0)
    later. A stream ignores it; a datagram's message arrives once more. Copies of several rules add
    up."""

    after_ns: int


PASS = Pass()
Verdict = Pass | Deliver | Drop | Duplicate

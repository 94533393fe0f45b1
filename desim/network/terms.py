"""The changes that rules have made to a frame at one receiver: delay, copies, lost packets."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final, NamedTuple

from desim.network.carrier import Carrier
from desim.ports import Frame, packet_sizes


class Terms(NamedTuple):
    """The terms that rules set, and the packets lost so far.

    Rules add ``delay_ns`` to the model's delay, and copies that follow the frame ``copies_ns``
    later. The packets ``lost`` (number to reason) do not arrive; those ``barred`` were lost in
    front of the model, which was given a train without them.
    """

    delay_ns: int
    copies_ns: tuple[int, ...]
    lost: dict[int, str]
    barred: tuple[int, ...]

    def losing(self, packets: Iterable[int], reason: str) -> Terms:
        """The same terms without ``packets``. A packet that was lost before keeps its reason."""
        return self._replace(lost=dict.fromkeys(packets, reason) | self.lost)

    def within(self, frame: Frame) -> tuple[Terms, Frame]:
        """The terms and the train that the model is given: ``frame`` without what is lost."""
        sizes = packet_sizes(frame.size_bytes, frame.segments)
        return (self._replace(barred=tuple(sorted(self.lost))),
                frame._replace(size_bytes=frame.size_bytes - sum(sizes[n] for n in self.lost),
                               segments=frame.segments - len(self.lost)))

    def numbers(self, packets: Iterable[int], segments: int) -> list[int]:
        """The numbers in the whole train of ``segments`` of ``packets``, which the model counts
        without those barred."""
        if not self.barred:
            return list(packets)
        given = [number for number in range(segments) if number not in self.barred]
        return [given[number] for number in packets]


PLAIN = Terms(0, (), {}, ())  # no rule changes anything, and no packet is lost

# A frame at one receiver: carrier, token, receiver, bytes and packets of all of it, terms. The
# token is the carrier's own: nobody else looks at it.
Claim = tuple[Carrier[Any], object, int, int, int, Terms]
RECEIVER: Final = 2  # places in a claim
TERMS: Final = 5

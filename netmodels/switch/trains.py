"""The packets of a frame: their times on a wire, and their bytes in a queue."""

from __future__ import annotations

from typing import NamedTuple

from desim.ports import packet_sizes
from desim.units import airtime_ns
from netmodels.ethernet import CHECK_BYTES, GAP_BYTES, PREAMBLE_BYTES, padded


class PacketTrain(NamedTuple):
    """The packets of one frame: ``longer`` equal ones, and behind them equal ones that are no
    longer. A single packet is a train of one."""

    packets: int
    longer: int
    long_ns: int  # on the wire, with preamble and gap
    short_ns: int
    long_bytes: int  # as a queue counts them: without the check sequence, which the hardware adds
    short_bytes: int
    total_ns: int

    def wire_ns(self, number: int) -> int:
        """Time on the wire of packet ``number``, from 0."""
        return self.long_ns if number < self.longer else self.short_ns

    @property
    def last_ns(self) -> int:
        """Time on the wire of the last packet."""
        return self.wire_ns(self.packets - 1)

    def queue_bytes(self, number: int) -> int:
        """Size in a queue of packet ``number``, from 0."""
        return self.long_bytes if number < self.longer else self.short_bytes


def cut(size_bytes: int, segments: int, rate_bps: int) -> PacketTrain:
    """The train that a frame of ``size_bytes`` in ``segments`` packets is."""
    sizes = packet_sizes(size_bytes, segments)
    longer = sizes.count(sizes[0])
    long_ns, short_ns = (airtime_ns(padded(size) + PREAMBLE_BYTES + GAP_BYTES, rate_bps)
                         for size in (sizes[0], sizes[-1]))
    return PacketTrain(segments, longer, long_ns, short_ns, sizes[0] - CHECK_BYTES,
                 sizes[-1] - CHECK_BYTES, longer * long_ns + (segments - longer) * short_ns)

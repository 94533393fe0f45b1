"""A frame on its way over several hops."""

from __future__ import annotations

from collections.abc import Sequence

from desim import ports


class Journey:
    """A frame on its way: the number of hops so far, and the packets that are left."""

    def __init__(self, frame: ports.Frame) -> None:
        self.frame, self.made = frame, 0
        self.left: Sequence[int] = range(frame.segments)

    def without(self, lost: dict[int, str]) -> dict[str, list[int]]:
        """Go on without the packets that the last hop has ``lost``, by their number among those
        that were left. Returns their numbers in the frame by reason."""
        gone: dict[str, list[int]] = {}
        for number in sorted(lost):
            gone.setdefault(lost[number], []).append(self.left[number])
        if lost:
            self.left = [packet for number, packet in enumerate(self.left) if number not in lost]
        return gone

    def sizes(self) -> Sequence[int]:
        """The bytes of each of the packets that are left."""
        frame = self.frame
        sizes = ports.packet_sizes(frame.size_bytes, frame.segments)
        if len(self.left) == frame.segments:
            return sizes
        return [sizes[packet] for packet in self.left]

    def size_bytes(self) -> int:
        """The bytes of the packets that are left."""
        frame = self.frame
        return frame.size_bytes if len(self.left) == frame.segments else sum(self.sizes())

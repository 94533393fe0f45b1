"""A network model that loses the packets that a test names."""

from desim.ports import Drop
from desim.testing import ImmediateNetwork


class Loses(ImmediateNetwork):
    """A model that loses packets, each of the tuples at its receiver, and delivers the rest."""

    reasons = ("spilt", "burnt")

    def __init__(self, **at):
        self._at = {int(name[1:]): packets for name, packets in at.items()}
        self.given = []

    def send(self, frame):
        self.given.append((frame.segments, frame.size_bytes))
        for receiver in frame.receivers:
            for reason, packets in zip(self.reasons, self._at.get(receiver, ()), strict=False):
                self._context.settle(frame, receiver, Drop(reason, packets))
        return 5

"""The fates of a frame's packets, which become known one by one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from desim import ports
from netmodels.itemized import FrameTimes
from netmodels.partial_trains import settle_without


@dataclass(eq=False)
class PacketFates:
    """A frame on its way to ``receivers``, of which the first ``taken`` packets had room in a
    queue: how many of them have an open fate, and the ones lost by receiver and reason."""

    frame: ports.Frame
    receivers: tuple[int, ...]
    taken: int
    open: int = field(init=False)
    lost: dict[int, dict[str, list[int]]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.open = self.taken

    def over(self, number: int, missed: Mapping[int, str], context: ports.Context,
             times: FrameTimes) -> None:
        """The fate of a packet is known: the receivers that ``missed`` it, with the reasons. With
        the last one the frame is settled."""
        self.open -= 1
        for receiver, reason in missed.items():
            self.lost.setdefault(receiver, {}).setdefault(reason, []).append(number)
        if not self.open:
            times.end(self.frame)
            self._settle(context)

    def _settle(self, context: ports.Context) -> None:
        alike: dict[str, list[int]] = {}  # by the reason of all packets; "": they arrived
        for receiver in self.receivers:
            lost = {reason: sorted(numbers)
                    for reason, numbers in self.lost.get(receiver, {}).items()}
            reason = next(iter(lost), "")
            if lost and len(lost[reason]) < self.frame.segments:
                settle_without(context, self.frame, receiver, lost, sent=self.taken)
            else:
                alike.setdefault(reason, []).append(receiver)
        for reason in sorted(alike, reverse=True):
            context.settle_many(self.frame, alike[reason],
                                ports.Drop(reason) if reason else ports.Deliver(0))

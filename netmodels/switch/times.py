"""The parts of a frame's time in a switch, for a run's ledger."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from desim.ports import Frame, Ledger, TimePart
from netmodels.switch.compiled_queues import Fate
from netmodels.switch.trains import PacketTrain

# A frame at one exit, and the receivers there, which are settled together.
Copy = tuple[Frame, Sequence[int]]


class SwitchTimes:
    """Enters the parts of each frame's time in a ledger, from two stamps: when its last packet has
    left the sender's interface, and when it is at the receiver.

    Queue at the sender: until then, without the time for which the line served the frame itself.
    Queue at the receiver: from the last packet's arrival in the switch until the exit began to send
    it; behind a longer packet of the same frame that is airtime. ``hop_ns``: from the end of the
    gap behind a packet to its arrival at the cable's other end.
    """

    def __init__(self, ledger: Ledger, propagation_ns: int, hop_ns: int,
                 cut: Callable[[int, int], PacketTrain]) -> None:
        self._ledger, self._cut = ledger, cut
        self._propagation_ns, self._hop_ns = propagation_ns, hop_ns
        self._gap_ns = propagation_ns - hop_ns
        self._sent: dict[int, tuple[int, int]] = {}  # when, and exits to come

    def local(self, frame: Frame, latency_ns: int, receivers: Sequence[int] | None = None) -> None:
        """A frame stays within its port."""
        for receiver in frame.receivers if receivers is None else receivers:
            self._ledger.spent(frame, TimePart.PROPAGATION, latency_ns, receiver)

    def sent(self, frame: Frame, receivers: int, now_ns: int) -> None:
        """A frame for so many receivers is handed to its sender's interface."""
        self._sent[frame.id] = now_ns, receivers

    def woken(self, now_ns: int, fates: Sequence[Fate[Copy]], departures_ns: Sequence[int]) -> None:
        """Frames have been sent: their fates from now on, and when each left its interface."""
        for ((frame, receivers), delay_ns, lost), left_ns in zip(fates, departures_ns, strict=True):
            self.passed(frame, receivers, lost, left_ns, now_ns + delay_ns)

    def passed(self, frame: Frame, receivers: Sequence[int], lost: Sequence[int], left_ns: int,
               there_ns: int) -> None:
        """The last packet of a frame has left its interface at ``left_ns``, and all that is not
        ``lost`` is ``there``, at an exit's ``receivers``."""
        sent_ns, to_come = self._sent.pop(frame.id)
        if to_come > len(receivers):
            self._sent[frame.id] = sent_ns, to_come - len(receivers)
        train = self._cut(frame.size_bytes, frame.segments)
        parts = [(TimePart.QUEUE, left_ns - train.total_ns - sent_ns),
                 (TimePart.AIRTIME, train.total_ns)]
        if frame.segments - 1 in lost:  # then the exit has no room
            after = [(TimePart.QUEUE, there_ns - left_ns)]
        else:
            parts[1] = TimePart.AIRTIME, train.total_ns - self._gap_ns
            wait_ns = there_ns - self._hop_ns - train.last_ns - (left_ns + self._hop_ns)
            own_ns = min(wait_ns, train.long_ns - train.last_ns) if train.packets > 1 else 0
            after = [(TimePart.QUEUE, wait_ns - own_ns),
                     (TimePart.AIRTIME, own_ns + train.last_ns - self._gap_ns),
                     (TimePart.PROPAGATION, self._propagation_ns)]
            parts.append((TimePart.PROPAGATION, self._propagation_ns))
        ledger = self._ledger
        for receiver in receivers:
            for part, time_ns in parts:
                ledger.spent(frame, part, time_ns, receiver)
            for part, time_ns in after:
                ledger.spent(frame, part, time_ns, receiver, receiver)
            ledger.lost_at(frame, receiver, receiver)

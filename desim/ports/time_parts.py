"""The parts of a message's time, and the ledger in which network models enter those of frames."""

from __future__ import annotations

from enum import StrEnum
from typing import Protocol

from desim.ports.frames import Frame


class TimePart(StrEnum):
    """The parts of a message's time. A network model enters those from ``QUEUE`` to
    ``RETRANSMISSION``; transports and media enter the others."""

    SENDER = "sender's queue"  # outbox, socket, window
    RESOLUTION = "resolution"  # of the receiver's address (ARP)
    QUEUE = "queue"  # behind others at an interface, a port, a relay
    CONTENTION = "contention"  # for the channel: spaces between frames, backoff, a busy medium
    AIRTIME = "airtime"  # on a channel or a wire, as long as its bits take
    PROPAGATION = "propagation"  # along the wire or through the air, and other constant delays
    RETRANSMISSION = "retransmission"  # from the first transmission to the one that got through
    RULES = "rules"  # delays of the medium's rules
    MEDIUM = "on the medium"  # of a network model that enters no parts
    RELAY = "relay"  # at a host that passes the message on, above its media


class Ledger(Protocol):
    """A network model's view of a run's ledger: the model enters where the time of frames goes."""

    def spent(self, frame: Frame, part: TimePart, time_ns: int, receiver: int | None = None,
              host: int | None = None) -> None:
        """``frame`` has spent or will spend ``time_ns`` (0: no entry) in ``part``, on its way to
        ``receiver`` (None: to all of its receivers), at or from ``host`` (index; behind those of
        hosts that of an access point of ``KnowsHandovers``; None: at its source). Enter parts
        in their order in time, those for all receivers first, and before the frame is settled
        there. The parts of a delivered frame sum up to the time from ``send`` to its arrival,
        without the delays of rules. A train's are those of its last packet, with the times that
        its other packets were served in front of it."""

    def lost_at(self, frame: Frame, host: int, receiver: int | None = None) -> None:
        """``frame`` gets lost at ``host``; without this call it is at its source."""

"""Implied acknowledgements (``acks: implied``): a sender knows at once what has arrived."""

from __future__ import annotations

from typing import TYPE_CHECKING

from desim.middleware.tcp.express import Express
from desim.middleware.tcp.receiver import Receiver

if TYPE_CHECKING:
    from desim.middleware.tcp.connection import Connection
    from desim.middleware.tcp.end import End
    from desim.middleware.tcp.sender import Sender


class ImpliedReceiver(Receiver):
    """A receiver whose acknowledgements are no frames: it gives them to the sender at once."""

    __slots__ = ("_up", "_peer")

    def __init__(self, connection: Connection, end: End, entity: int) -> None:
        super().__init__(connection, end, entity)
        self._up = connection.tcp.context.up
        self._peer = end.peer

    def _take_next(self, size_bytes: int) -> None:
        transit = self.transit
        messages, delivered = transit.messages, transit.delivered
        if len(messages) > delivered and messages[delivered][0] == self.nxt:  # one, and all of it
            transit.delivered = delivered + 1
            _, arrived, token, _ = messages[delivered]
            self.acknowledge(1)
            arrived(token)
            return
        self._deliver()
        if self.open:
            self.acknowledge(1)

    def acknowledge(self, segments: int) -> None:
        self.due_ns = 0
        self.acknowledged = self.nxt
        if self._up(self._peer):
            self.transit.sender.arrived((self.nxt, self.echo_ns, tuple(self.ranges)), self._peer)

    def express_for(self, sender: Sender) -> Express | None:
        return Express(sender) if sender.near else None

    def shut(self) -> None:
        was_open = self.open
        super().shut()
        if was_open:  # in the midst of an arrival
            self.acknowledge(1)

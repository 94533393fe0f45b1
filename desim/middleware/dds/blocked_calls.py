"""Calls of ``write`` that block: the history keeps all samples and is full (KEEP_ALL).

Fast DDS 2.9.1: DataWriterHistory.cpp, prepare_change; Cyclone DDS: throttle_writer.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from desim.middleware.dds.dds import Dds
    from desim.middleware.dds.stateful_writer import StatefulWriter
    from desim.middleware.message import Message
    from desim.ports.networks import Handle


class HeldCall(NamedTuple):
    """A message that waits to be written for these ``receivers``."""

    writer: StatefulWriter
    message: Message
    receivers: list[int]


class BlockedCalls:
    """The calls of one node that are ``waiting``, the first one for room; the others are those
    that the node makes behind it in the same callback. A call without room for
    ``max_blocking_time`` returns an error, and its message is dropped as ``history_full``, as is
    what somebody else publishes in the name of the node meanwhile."""

    def __init__(self, dds: Dds, host: int, node: str) -> None:
        self._dds, self._context = dds, dds.context
        self._host, self._node = host, node
        self.waiting: deque[HeldCall] = deque()
        self._since_ns = 0
        self._end: Handle | None = None

    def hold(self, call: HeldCall) -> None:
        """Let ``call`` wait behind the others."""
        now_ns = self._context.now_ns
        if not self.waiting:
            self._since_ns = now_ns
        elif self._since_ns != now_ns:
            self._refuse(call)
            return
        self._context.block(self._host, self._node)
        self.waiting.append(call)
        if len(self.waiting) == 1:
            self._await_room()

    def held(self, writer: StatefulWriter) -> int:
        """Receptions of messages of ``writer`` that wait."""
        return sum(len(call.receivers) for call in self.waiting if call.writer is writer)

    def go_on(self, _: object = None) -> None:
        """Make the calls that there is room for."""
        while self.waiting and self.waiting[0].writer.has_room(waited=True):
            call = self._return()
            call.writer.write(call.message, call.receivers, call.message.born_ns)
        if self.waiting and self._end is None:
            self._await_room()

    def drop(self, writer: StatefulWriter, reason: str) -> None:
        """The host stops: drop the messages of ``writer``."""
        for call in [call for call in self.waiting if call.writer is writer]:
            self.waiting.remove(call)
            self._refuse(call, reason)
        if not self.waiting and self._end is not None:
            self._end.cancel()
            self._end = None

    def _return(self) -> HeldCall:
        """The first call is over."""
        if self._end is not None:
            self._end.cancel()
            self._end = None
        self._context.unblock(self._host, self._node)
        return self.waiting.popleft()

    def _await_room(self) -> None:
        context = self._context
        self._end = context.at(
            context.now_ns + self._dds.constants.max_blocking_time_ns, self._host, self._expired)
        for due_ns in self.waiting[0].writer.acknowledgements_ns():
            self.acknowledged_at(due_ns)

    def acknowledged_at(self, due_ns: int) -> None:
        """A reader's answer will have arrived after ``due_ns``."""
        self._context.at(due_ns + 1, self._host, self.go_on)

    def _expired(self, _: object) -> None:
        self._end = None
        self._refuse(self._return())
        self.go_on()

    def _refuse(self, call: HeldCall, reason: str = "history_full") -> None:
        for receiver in call.receivers:
            self._context.drop(call.message, receiver, reason)

"""Repairs of discovery: the items that other participants have requested, sent again."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain, groupby
from operator import itemgetter
from typing import TYPE_CHECKING

from desim.middleware.dds import wire
from desim.middleware.dds.heartbeat_piggyback import Spent

if TYPE_CHECKING:
    from desim.middleware.dds.endpoints import Endpoints
    from desim.middleware.dds.participant import Participant
    from desim.middleware.dds.remote import RemoteParticipant
    from desim.middleware.dds.wire import DiscoveredData

TRAIN = 10  # messages in one frame, so that a large fleet's start is not a frame for each of them


class SingleRepairs:
    """Cyclone DDS: each reader gets what it has requested, with a heartbeat in the last message."""

    spent: tuple[Spent, ...] = ()

    def __init__(self, me: Participant, endpoints: Endpoints) -> None:
        self._me, self._endpoints = me, endpoints

    def request(self, remote: RemoteParticipant, missing: tuple[int, ...]) -> None:
        """``remote`` wants the items of these numbers, and no others."""
        pending, remote.requested = remote.requested, missing
        if not pending:
            self._me.after(self._me.constants.discovery_nack_response_ns, self._repair, remote)

    def _repair(self, remote: RemoteParticipant) -> None:
        me, numbers, remote.requested = self._me, remote.requested, ()
        if me.remotes.get(remote.guid) is not remote:
            return
        for start in range(0, len(numbers), TRAIN):
            part = numbers[start:start + TRAIN]
            last = start + TRAIN >= len(numbers)
            messages = me.dds.wire.known_endpoints([remote.out[number] for number in part],
                                                  me.constants.repeated_message_bytes, last)
            self._endpoints.send_items([remote], part, messages,
                                       remote.sent_count if last else None)
        self._endpoints.send_heartbeat_soon()


class SharedRepairs:
    """Fast DDS: one timer for the requests of all readers, and each item is sent once for all that
    want it. A request leaves the timer alone that runs (TimedEventImpl.cpp, go_ready). ``spent``
    says, for publications and subscriptions, behind which items all readers get a heartbeat."""

    def __init__(self, me: Participant, endpoints: Endpoints) -> None:
        self._me, self._endpoints = me, endpoints
        limit_bytes = me.constants.heartbeat_after_bytes
        self.spent = () if limit_bytes is None else (Spent(limit_bytes), Spent(limit_bytes))
        self._due = False

    def request(self, remote: RemoteParticipant, missing: tuple[int, ...]) -> None:
        """``remote`` wants the items of these numbers, and no others."""
        remote.requested = missing
        if not self._due:
            self._due = True
            self._me.after(self._me.constants.discovery_nack_response_ns, self._repair)

    def _repair(self, _: object) -> None:
        self._due = False
        by_series: dict[int, list[RemoteParticipant]] = {}  # a server has one for each client
        for remote in self._me.direct():
            if remote.requested:
                by_series.setdefault(id(remote.out), []).append(remote)
        for remotes in by_series.values():
            self._send(remotes)
        self._endpoints.send_heartbeat_soon()

    def _send(self, remotes: list[RemoteParticipant]) -> None:
        """Send each item to those that want it, then to all readers the heartbeats that go between
        the items: each reader's in one train."""
        me, out = self._me, remotes[0].out
        wanted: dict[int, list[RemoteParticipant]] = {}
        for remote in remotes:
            for number in remote.requested:
                wanted.setdefault(number, []).append(remote)
            remote.requested = ()
        readers = [number for number in wanted if out[number].kind in wire.READERS]
        parts = self._parted(sorted(wanted.keys() - readers) + sorted(readers), out)
        wishes = [(to, list(same)) for part in parts
                 for to, same in groupby(part, wanted.__getitem__)]
        for to, group in groupby(wishes, itemgetter(0)):
            self._send_train(to, [numbers for _, numbers in group], out)
        self._endpoints.send_heartbeats(me.direct(), len(parts) - 1, directed=False)

    def _send_train(self, to: list[RemoteParticipant], groups: list[list[int]],
                    out: list[DiscoveredData]) -> None:
        """Send the items of these numbers to the same readers; each group begins a message."""
        me = self._me
        for start in range(0, len(groups), TRAIN):
            some = groups[start:start + TRAIN]
            messages = [message for group in some for message in me.dds.wire.known_endpoints(
                [out[number] for number in group], me.constants.repeated_message_bytes, False,
                addressed=len(to) == 1)]
            self._endpoints.send_items(to, [*chain.from_iterable(some)], messages, None)

    def _parted(self, numbers: Sequence[int], out: list[DiscoveredData]) -> list[list[int]]:
        """Cut the numbers of items behind each that a heartbeat to all follows: that is a message
        of its own, and ends the one before it."""
        parts: list[list[int]] = [[]]
        if not self.spent:
            return [list(numbers)]
        me, head_bytes = self._me, self._me.dds.wire.head_bytes
        for number in numbers:
            item = out[number]
            me.resent_bytes += wire.TIME_BYTES + item.size_bytes + (
                0 if parts[-1] else head_bytes)
            parts[-1].append(number)
            if self.spent[item.kind in wire.READERS].over(me.resent_bytes):
                me.resent_bytes += head_bytes + wire.HEARTBEAT_BYTES
                parts.append([])
        return parts

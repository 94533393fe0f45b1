"""A discovery server: it announces to each client the endpoints of others that match its own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from desim.middleware.dds.wire import DataKind, DiscoveredData, Guid

if TYPE_CHECKING:
    from desim.middleware.dds.participant import Participant

_OPPOSITE = {DataKind.WRITER: DataKind.READER, DataKind.READER: DataKind.WRITER}


class DiscoveryServer:
    """All endpoints that the server ``me`` knows of, its own host's among them."""

    def __init__(self, me: Participant) -> None:
        self._me = me
        # By kind and topic, by owner.
        self._items: dict[tuple[DataKind, str], dict[Guid, DiscoveredData]] = {}
        self._announced: dict[Guid, dict[DiscoveredData, None]] = {}  # by client

    def add(self, item: DiscoveredData) -> None:
        """Take an endpoint: its owner and the owners of endpoints that match it learn of each
        other."""
        if item.kind not in _OPPOSITE:
            return
        self._items.setdefault((item.kind, item.topic), {})[item.owner] = item
        others = self._items.get((_OPPOSITE[item.kind], item.topic), {})
        for owner, other in others.items():
            if owner != item.owner:
                self._announce(owner, item)
                self._announce(item.owner, other)

    def forget(self, guid: Guid) -> None:
        """Announce that ``guid`` is gone to all that know of it. It may come again."""
        for owners in self._items.values():
            owners.pop(guid, None)
        self._announced.pop(guid, None)
        for to, announced in self._announced.items():
            stale = [item for item in announced if item.owner == guid]
            for item in stale:
                del announced[item]
            if any(item.kind != DataKind.GONE for item in stale):
                self._announce(to, DiscoveredData(guid, DataKind.GONE, "",
                                        self._me.dds.wire.announcement_bytes))

    def _announce(self, to: Guid, item: DiscoveredData) -> None:
        remote, me = self._me.remotes.get(to), self._me
        if remote is None:
            return
        announced = self._announced.setdefault(to, {})
        if item in announced:
            return
        first = DiscoveredData(item.owner, DataKind.PARTICIPANT, "",
                               self._me.dds.wire.announcement_bytes)
        if item.owner != me.guid and item.kind != DataKind.GONE and first not in announced:
            announced[first] = None
            remote.out.append(first)
        announced[item] = None
        remote.out.append(item)
        me.endpoints.announce([remote])

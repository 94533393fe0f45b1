"""A discovery server: it tells each client of those endpoints of others that match one of its."""

from __future__ import annotations

from typing import TYPE_CHECKING

from desim.middleware.dds.remote import Guid, Item

if TYPE_CHECKING:
    from desim.middleware.dds.participant import Participant

_OPPOSITE = {"writer": "reader", "reader": "writer"}


class Relay:
    """All endpoints that the server ``me`` knows of, its own host's among them."""

    def __init__(self, me: Participant) -> None:
        self._me = me
        self._items: dict[tuple[str, str], dict[Guid, Item]] = {}  # by kind and topic, by owner
        self._told: dict[Guid, dict[Item, None]] = {}  # to whom

    def add(self, item: Item) -> None:
        """Somebody has an endpoint: those that match it learn of each other."""
        if item.kind not in _OPPOSITE:
            return
        self._items.setdefault((item.kind, item.topic), {})[item.owner] = item
        others = self._items.get((_OPPOSITE[item.kind], item.topic), {})
        for owner, other in others.items():
            if owner != item.owner:
                self._tell(owner, item)
                self._tell(item.owner, other)

    def gone(self, guid: Guid) -> None:
        """Tell all who were told of ``guid``, which may come again."""
        for owners in self._items.values():
            owners.pop(guid, None)
        self._told.pop(guid, None)
        for to, told in self._told.items():
            stale = [item for item in told if item.owner == guid]
            for item in stale:
                del told[item]
            if any(item.kind != "gone" for item in stale):
                self._tell(to, Item(guid, "gone", "", self._me.dds.wire.announcement_bytes))

    def _tell(self, to: Guid, item: Item) -> None:
        remote, me = self._me.remotes.get(to), self._me
        if remote is None:
            return
        told = self._told.setdefault(to, {})
        if item in told:
            return
        first = Item(item.owner, "participant", "", self._me.dds.wire.announcement_bytes)
        if item.owner != me.guid and item.kind != "gone" and first not in told:
            told[first] = None
            remote.out.append(first)
        told[item] = None
        remote.out.append(item)
        me.endpoints.tell_new(remote)

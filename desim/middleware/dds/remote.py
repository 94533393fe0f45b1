"""The state that a participant keeps of another one."""

from __future__ import annotations

from collections.abc import Callable

from desim.middleware.dds.reader import NackTiming
from desim.middleware.dds.wire import Guid, Item, ItemKind

NOBODY: Guid = (-1, 0)
# An arrival that only shows that a participant lives: ``arrived(token, receiver)`` at ``time_ns``.
Arrival = tuple[int, Callable[..., object], object]


class RemoteParticipant:
    """Another participant, as one of them knows it.

    ``out`` lists the items for this remote: the first ``sent_count`` were sent, the first
    ``acked_count`` acknowledged; those in ``wanted`` will be sent again. Of its own items the first
    ``got`` have arrived in order, ``held`` are those beyond, and ``known`` exist.

    ``answered``: it has acknowledged anything. ``asked``: it has sent a heartbeat. ``beating``: its
    heartbeats that are not answered. A server that loses a client and meets it again sends all
    items anew, in another ``series`` (a participant without clients has one only, 0);
    ``received_series`` is the present one of this remote, ``named`` the participants in it.
    ``built_in``: its endpoints that every node has; ``greeted``: topics of these whose writer has
    sent a heartbeat. ``coming``: arrivals that only show that it lives. A remote that is known only
    through a server (``direct`` False) has neither a lease nor items of its own.
    """

    def __init__(self, guid: Guid, lease_ns: int, received_ns: int, direct: bool,
                 out: list[Item], series: int = 0) -> None:
        self.guid = guid
        self.host = guid[0]
        self.lease_ns = lease_ns
        self.received_ns = received_ns
        self.direct = direct
        self.writers: dict[str, None] = {}  # topics
        self.readers: dict[str, None] = {}
        self.out = out
        self.sent_count = len(out)
        self.acked_count = 0
        self.answered = False
        self.got = self.known = 0
        self.held: dict[int, Item] = {}
        self.asked = self.answering = False
        self.asking = NackTiming()
        self.wanted: tuple[int, ...] = ()
        self.series = series
        self.received_series = 0
        self.named: dict[Guid, None] = {}
        self.beating = 0
        self.built_in: dict[tuple[ItemKind, str], None] = {}
        self.greeted: dict[str, None] = {}
        self.coming: list[Arrival] = []

    def take_arrivals(self, now_ns: int) -> None:
        """Renew its lease by what has arrived before ``now_ns``."""
        coming, self.coming = self.coming, []
        for arrival in coming:
            if arrival[0] >= now_ns:
                self.coming.append(arrival)
            else:
                self.received_ns = max(self.received_ns, arrival[0])

    def begin(self, series: int) -> None:
        """Start anew: the remote sends all its items again."""
        self.received_series = series
        self.got = self.known = 0
        self.held.clear()
        self.named.clear()
        self.asking = NackTiming()

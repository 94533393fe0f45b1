"""The state that a participant keeps of another one."""

from __future__ import annotations

from collections.abc import Callable

from desim.middleware.dds.wire import DataKind, DiscoveredData, Guid
from desim.middleware.dds.writer_proxy import NackTiming

NOBODY: Guid = (-1, 0, 0)
# An arrival that only shows that a participant lives: ``arrived(token, receiver)`` at ``time_ns``.
Arrival = tuple[int, Callable[..., object], object]


class RemoteParticipant:
    """Another participant, as one of them knows it."""

    def __init__(self, guid: Guid, lease_ns: int, received_ns: int, direct: bool,
                 out: list[DiscoveredData], series: int = 0) -> None:
        self.guid = guid
        self.host, _, self.number = guid
        self.direct = direct  # False: known through a server only, without lease and own items
        self.lease_ns = lease_ns
        self.received_ns = received_ns  # when something last arrived from it
        self.coming: list[Arrival] = []  # arrivals that only show that it lives

        # Its endpoints: topics of its writers and readers, those that every node has, and topics of
        # the latter whose writer has sent a heartbeat.
        self.writers: dict[str, None] = {}
        self.readers: dict[str, None] = {}
        self.built_in: dict[tuple[DataKind, str], None] = {}
        self.heard_writers: dict[str, None] = {}

        # Items for this remote.
        self.out = out
        self.series = series  # a server begins a new one whenever it meets a client
        self.sent_count = len(out)  # the first so many were sent
        self.acked_count = 0  # the first so many were acknowledged
        self.requested: tuple[int, ...] = ()  # will be sent again
        self.answered = False  # it has acknowledged anything

        # Items of this remote.
        self.received_series = 0  # the present one
        self.known = 0  # how many it has
        self.got = 0  # how many of them arrived in order
        self.held: dict[int, DiscoveredData] = {}  # arrived beyond those, by number
        self.named: dict[Guid, None] = {}  # participants in the items of this series
        self.beating = 0  # its writers with a heartbeat that is not answered yet
        self.answering = False  # an answer to its heartbeats is due
        self.asked = False  # one was sent
        self.nack_timing = NackTiming()

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
        self.nack_timing = NackTiming()

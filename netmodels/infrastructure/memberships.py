"""Memberships of hosts in multicast groups, as IGMP snooping knows them."""

from __future__ import annotations


class Memberships:
    """Hosts report their groups when they start (RFC 3376, 5.1: when what they listen to changes)
    and answer queries (5.2), every 125 s (8.2). So memberships last with a querier; without one
    they end ``lasts_ns`` later (8.4: group membership interval), and no multicast goes to a host
    then until it starts again. ``lasts_ns`` is None where they do not end.

    So it is behind bridges and switches that forward to known members alone. (Linux's own bridge
    floods as long as it has heard no querier: br_multicast_querier_exists.)"""

    def __init__(self, lasts_ns: int | None) -> None:
        self._lasts_ns = lasts_ns
        self._reported_ns: dict[int, int] = {}  # by host that has started again

    def report(self, host: int, now_ns: int) -> None:
        """A host has started."""
        self._reported_ns[host] = now_ns

    def ended(self, host: int, now_ns: int) -> bool:
        """Whether no multicast goes to a host any more."""
        return (self._lasts_ns is not None
                and now_ns > self._reported_ns.get(host, 0) + self._lasts_ns)

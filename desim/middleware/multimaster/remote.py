"""Another master, as its heartbeats show it to one host: online, silent, gone."""

from __future__ import annotations

from collections import deque
from enum import StrEnum

from desim.middleware.multimaster.parameters import DiscoveryTiming, MultimasterParams


class MasterNews(StrEnum):
    """A change that discovery notices at a remote master, or the need to ask it."""

    ONLINE = "online"  # new, or again
    CHANGED = "changed"
    OFFLINE = "offline"
    REMOVED = "removed"
    REQUEST = "request"


class RemoteMaster:
    """The master of ``host``. ``known``: its identity is known. ``quality``: percent of the
    expected heartbeats that have arrived, 0 where these are too slow for that."""

    def __init__(self, host: int) -> None:
        self.host = host
        self.known = False
        self.online = False
        self.changed_ns = -1  # the last change of its state, by its last heartbeat
        self.stirred_ns = -1  # the last change of its master
        self.received_ns = 0
        self.offline_ns = 0  # when it became so
        self.requests = 0  # unanswered
        self.quality = 0
        self._beats: deque[int] = deque()

    def receive(self, now_ns: int) -> None:
        self.received_ns = now_ns
        self.requests = 0
        self._beats.append(now_ns)

    def verdict(self, now_ns: int, timing: DiscoveryTiming, params: MultimasterParams
                ) -> MasterNews | None:
        """The meaning of the master's silence: offline, removed, a request (which is counted), or
        None. With quick heartbeats silence is enough; with slow ones the master is asked first."""
        silent_ns = now_ns - self.received_ns
        if silent_ns > params.remove_after_ns:
            return MasterNews.REMOVED
        if timing.counted:
            return MasterNews.OFFLINE if silent_ns > timing.timeout_ns else None
        if not timing.request_after_ns or silent_ns <= timing.request_after_ns:
            return None
        if self.requests >= params.offline_after_requests:
            return MasterNews.OFFLINE
        self.requests += 1
        return MasterNews.REQUEST

    def measure(self, now_ns: int, timing: DiscoveryTiming) -> bool:
        """Update the quality; returns whether it has changed: beats / (rate * window + unanswered
        requests)."""
        beats = self._beats
        while beats and beats[0] <= now_ns - timing.window_ns:
            beats.popleft()
        if not timing.counted:
            return False
        quality = min(100, int(100 * len(beats) / (timing.expected + self.requests)))
        changed = quality != self.quality
        self.quality = quality
        return changed

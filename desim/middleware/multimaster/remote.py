"""Another master, as one host has it by its heartbeats: there, silent, gone."""

from __future__ import annotations

from collections import deque

from desim.middleware.multimaster.parameters import MultimasterParams, Watch


class Remote:
    """The master of ``host``. ``known``: it has said who it is. ``quality``: percent of the
    heartbeats that should have come, 0 where these are too slow to tell."""

    __slots__ = ("host", "known", "online", "changed_ns", "stirred_ns", "heard_ns", "offline_ns",
                 "requests", "quality", "_beats")

    def __init__(self, host: int) -> None:
        self.host = host
        self.known = False
        self.online = False
        self.changed_ns = -1  # when its state did, as its last heartbeat said
        self.stirred_ns = -1  # when anything in its master did
        self.heard_ns = 0
        self.offline_ns = 0  # when it became so
        self.requests = 0  # unanswered
        self.quality = 0
        self._beats: deque[int] = deque()

    def heard(self, now_ns: int) -> None:
        self.heard_ns = now_ns
        self.requests = 0
        self._beats.append(now_ns)

    def judged(self, now_ns: int, watch: Watch, params: MultimasterParams) -> str | None:
        """What its silence means: offline, removed, time for a ``request`` (which is counted), or
        None. Quick heartbeats tell by themselves; with slow ones it is asked first."""
        silent_ns = now_ns - self.heard_ns
        if silent_ns > params.remove_after_ns:
            return "removed"
        if watch.counted:
            return "offline" if silent_ns > watch.timeout_ns else None
        if not watch.request_after_ns or silent_ns <= watch.request_after_ns:
            return None
        if self.requests >= params.offline_after_requests:
            return "offline"
        self.requests += 1
        return "request"

    def measure(self, now_ns: int, watch: Watch) -> bool:
        """Whether the quality has changed: beats / (rate * window + unanswered requests)."""
        beats = self._beats
        while beats and beats[0] <= now_ns - watch.window_ns:
            beats.popleft()
        if not watch.counted:
            return False
        quality = min(100, int(100 * len(beats) / (watch.expected + self.requests)))
        changed = quality != self.quality
        self.quality = quality
        return changed

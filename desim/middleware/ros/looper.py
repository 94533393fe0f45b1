"""The thread of a roscpp process that serves XML-RPC and makes its requestTopic calls."""

from __future__ import annotations


class Looper:
    """It works for rounds of ``period_ns`` (roscpp xmlrpc_manager.cpp: server_.work(0.1)), and
    looks between them only at calls that are new or answered. A round goes on for another period
    after each event within its period, and ends with the first event behind that
    (XmlRpcDispatch::work: each of its polls waits for the whole time). Without a period it always
    looks at once.
    """

    __slots__ = ("_period_ns", "_begin_ns", "_end_ns")

    def __init__(self, period_ns: int, begin_ns: int) -> None:
        self._period_ns = period_ns
        self._begin_ns = begin_ns
        self._end_ns = begin_ns + period_ns

    def event(self, now_ns: int) -> None:
        """A call came, or an answer, or a request may be written."""
        period_ns = self._period_ns
        if now_ns >= self._end_ns and period_ns:
            self._begin_ns = now_ns - (now_ns - self._end_ns) % period_ns
        within = now_ns <= self._begin_ns + period_ns
        self._end_ns = now_ns + period_ns if within else now_ns

    def looks(self, now_ns: int) -> int:
        """When the round that runs now ends, if nothing comes in between."""
        if now_ns <= self._end_ns or not self._period_ns:
            return max(self._end_ns, now_ns)
        return now_ns + (self._end_ns - now_ns) % self._period_ns

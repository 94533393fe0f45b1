"""The thread of a roscpp process that serves XML-RPC and makes its requestTopic calls."""

from __future__ import annotations


class XmlrpcThread:
    """It works in rounds of ``period_ns`` (roscpp xmlrpc_manager.cpp: server_.work(0.1)), and
    serves calls that are new or answered between them. A round goes on for another period after
    each event within its period, and ends with the first event behind that (XmlRpcDispatch::work:
    each of its polls waits for the whole time). Without a period a round ends at once.
    """

    def __init__(self, period_ns: int, begin_ns: int) -> None:
        self._period_ns = period_ns
        self._begin_ns = begin_ns
        self._end_ns = begin_ns + period_ns

    def event(self, now_ns: int) -> None:
        """A call or an answer has arrived, or a request may be written."""
        period_ns = self._period_ns
        if now_ns >= self._end_ns and period_ns:
            self._begin_ns = now_ns - (now_ns - self._end_ns) % period_ns
        within = now_ns <= self._begin_ns + period_ns
        self._end_ns = now_ns + period_ns if within else now_ns

    def round_end_ns(self, now_ns: int) -> int:
        """The end of the present round, if there is no event before it."""
        if now_ns <= self._end_ns or not self._period_ns:
            return max(self._end_ns, now_ns)
        return now_ns + (self._end_ns - now_ns) % self._period_ns

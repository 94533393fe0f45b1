"""NTP clients: hosts that ask a server for the time and correct their clocks (RFC 5905).

A client sends a burst of requests when it starts, then one in each polling interval. Of its last
answers it trusts the one with the shortest round trip. It steps its clock if that one's offset is
large, and slews it otherwise. What remains is half of the difference between the delays of request
and answer, and the drift between two corrections.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, NamedTuple

from desim.engine.kernel import Call, Phase
from desim.middleware.clocks import PPB, HostClock
from desim.units import NS_PER_S

if TYPE_CHECKING:
    from desim.middleware.graph import Graph

NTP_BYTES = 48 + 8 + 20 + 14 + 4  # the header of NTP, UDP, IP, Ethernet and its check sequence
BURST, BURST_NS = 8, 2 * NS_PER_S  # ntpd's iburst: so many requests, so far apart
STEP_NS = 128_000_000  # STEPT: a larger offset is stepped, not slewed
_ANSWERS = 8  # that the clock filter keeps
_AGING_PPB = 15_000  # PHI, 15 ppm: an answer counts as worse by so much of its age
_RATE_GAIN = 4  # a quarter of the measured rate is corrected (the frequency-lock loop's gain)


class Answer(NamedTuple):
    """A server's answer: the round trip took ``delay_ns``, and the server's clock is
    ``offset_ns`` ahead. ``read_ns``: the client's clock when it came."""

    read_ns: int
    delay_ns: int
    offset_ns: int


class NtpClient:
    """Keeps ``clock``, that of ``host``, near that of ``server`` (indices of hosts)."""

    def __init__(self, graph: Graph, host: int, clock: HostClock, server: int, poll_ns: int
                 ) -> None:
        self._graph, self._kernel, self._clock = graph, graph.kernel, clock
        self._host, self._server, self._poll_ns = host, server, poll_ns
        self._asked = 0  # requests since the start
        self._answers: deque[Answer] = deque(maxlen=_ANSWERS)
        self._corrected_ns: int | None = None  # the client's clock at the last correction
        self._call: Call | None = None
        graph.context.watchers.append(self._switched)

    def _switched(self, host: int, up: bool) -> None:
        if host != self._host:
            return
        if self._call is not None:
            self._call.cancel()
        self._asked, self._corrected_ns = 0, None
        self._answers.clear()
        graph = self._graph
        if up:  # not all at once, as daemons do not start in one instant
            self._call_after(graph.streams.integer(BURST_NS, "ntp", graph.hosts[host].name))

    def _call_after(self, delay_ns: int) -> None:
        self._call = self._kernel.after(delay_ns, Phase.NETWORK, self._graph.hosts[self._host].id,
                                        self._ask)

    def _ask(self, _: object) -> None:
        self._asked += 1
        self._call_after(BURST_NS if self._asked < BURST else self._poll_ns)
        self._graph.context.send("ntp", self._host, [self._server], NTP_BYTES, self._serve,
                                 self._clock.read(self._kernel.now_ns))

    def _serve(self, sent_ns: int, server: int) -> None:
        """The server answers with its time, and with that of the request."""
        served_ns = self._graph.hosts[server].clock_ns(self._kernel.now_ns)
        self._graph.context.send("ntp", server, [self._host], NTP_BYTES, self._hear,
                                 (sent_ns, served_ns))

    def _hear(self, answer: tuple[int, int], _: int) -> None:
        sent_ns, served_ns = answer
        read_ns = self._clock.read(self._kernel.now_ns)
        self._answers.append(Answer(read_ns, read_ns - sent_ns,
                                    served_ns - (sent_ns + read_ns) // 2))
        best = min(self._answers, key=lambda each: (
            each.delay_ns // 2 + (read_ns - each.read_ns) * _AGING_PPB // PPB))
        if self._corrected_ns is None or best.read_ns > self._corrected_ns:
            self._correct(best)

    def _correct(self, best: Answer) -> None:
        now_ns, by_ns = self._kernel.now_ns, best.offset_ns
        if self._corrected_ns is not None and best.read_ns - self._corrected_ns > BURST_NS * BURST:
            self._clock.trim(by_ns * PPB // (best.read_ns - self._corrected_ns) // _RATE_GAIN)
        if abs(by_ns) > STEP_NS:
            self._clock.step(now_ns, by_ns)
            self._answers.clear()  # they are of another clock
        else:
            self._clock.slew(now_ns, by_ns)
        self._corrected_ns = self._clock.read(now_ns)
        self._graph.context.record("clock_set", self._host, by_ns)

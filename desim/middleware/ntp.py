"""NTP clients: hosts that ask a server for the time and correct their clocks (RFC 5905).

A client sends a burst of requests when it starts, then one in each polling interval. Of its last
answers it trusts the one with the shortest round trip. It steps its clock if that one's offset is
large, and slews it otherwise. What remains is half of the difference between the delays of request
and answer, and the drift between two corrections.

The discipline is ntpd's frequency-lock loop (RFC 5905, appendix A.5.5.6, ``local_clock``, with the
gain of ntpd 4.2.8, ``ntp_loopfilter.c``) over a clock that adjtime(3) slews. An answer's *error* is
its offset beyond what is still to be slewed, as there (``offset - c.offset``) and in chrony. So an
offset that is still being slewed is no error of the rate. From the error e, the time t since the
answer before and the polling interval p the rate is corrected by e / max(t, p) / 4. Answers one
polling interval apart therefore leave 3/4 of the rate's error each, however long the slew takes.

ntpd has this loop from polling intervals of 2048 s on (the RFC: above 750 s). For shorter ones it
has a slower phase-locked loop, which lets an offset cross zero after some 3000 s with a p of 64 s
(D. Mills in comp.protocols.time.ntp, 17 October 2006).
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, NamedTuple

from desim.engine.agenda import Call
from desim.engine.kernel import Phase
from desim.middleware.clocks import PPB, HostClock
from desim.middleware.headers import UDP_HEADER_BYTES
from desim.units import NS_PER_S

if TYPE_CHECKING:
    from desim.middleware.graph import Graph

NTP_BYTES = 48 + UDP_HEADER_BYTES
BURST, BURST_NS = 8, 2 * NS_PER_S  # ntpd's iburst: so many requests, so far apart
STEP_NS = 128_000_000  # STEPT: a larger offset is stepped, not slewed
_ANSWERS = 8  # that the clock filter keeps
_AGING_PPB = 15_000  # PHI, 15 ppm: an answer counts as worse by so much of its age
MAX_RATE_PPB = 500_000  # MAXFREQ, also of Linux's ntp_adjtime(2): no clock errs by more
_AVERAGED = 4  # a quarter of the measured error of the rate is corrected: ntpd's CLOCK_FLL, 1/AVG


class Answer(NamedTuple):
    """A server's answer, heard at ``heard_ns`` after a round trip of ``delay_ns``, both by the
    host's timer. The server's clock is ``error_ns`` ahead of the client's as that will be when all
    of its corrections have been slewed."""

    heard_ns: int
    delay_ns: int
    error_ns: int


class NtpClient:
    """Keeps ``clock``, that of ``host``, near that of ``server`` (indices of hosts)."""

    def __init__(self, graph: Graph, host: int, clock: HostClock, server: int, poll_ns: int
                 ) -> None:
        self._graph, self._kernel, self._clock = graph, graph.kernel, clock
        self._host, self._server, self._poll_ns = host, server, poll_ns
        self._asked = 0  # requests since the start
        self._answers: deque[Answer] = deque(maxlen=_ANSWERS)
        self._used_ns: int | None = None  # when the answer of the last correction was heard
        self._call: Call | None = None
        graph.context.watchers.append(self._switched)

    def _switched(self, host: int, up: bool) -> None:
        if host != self._host:
            return
        if self._call is not None:
            self._call.cancel()
        self._asked, self._used_ns = 0, None
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
                                 self._kernel.now_ns)

    def _serve(self, asked_ns: int, server: int) -> None:
        """The server answers with its time, and with that of the request."""
        served_ns = self._graph.hosts[server].clock_ns(self._kernel.now_ns)
        self._graph.context.send("ntp", server, [self._host], NTP_BYTES, self._hear,
                                 (asked_ns, served_ns))

    def _hear(self, answer: tuple[int, int], _: int) -> None:
        asked_ns, served_ns = answer
        now_ns = self._kernel.now_ns
        delay_ns = now_ns - asked_ns
        bound_ns = self._clock.read(now_ns) + self._clock.unslewed_ns(now_ns)
        self._answers.append(Answer(now_ns, delay_ns, served_ns + delay_ns // 2 - bound_ns))
        best = min(self._answers, key=lambda each: (
            each.delay_ns // 2 + (now_ns - each.heard_ns) * _AGING_PPB // PPB))
        if self._used_ns is None or best.heard_ns > self._used_ns:
            self._correct(now_ns, best)

    def _correct(self, now_ns: int, best: Answer) -> None:
        error_ns, offset_ns = best.error_ns, best.error_ns + self._clock.unslewed_ns(now_ns)
        if self._used_ns is not None:
            over_ns = max(best.heard_ns - self._used_ns, self._poll_ns)
            rate_ppb = error_ns * PPB // over_ns
            if abs(rate_ppb) <= MAX_RATE_PPB:  # else one of the two clocks has been set
                self._clock.trim(rate_ppb // _AVERAGED)
        if abs(offset_ns) > STEP_NS:
            self._clock.step(now_ns, offset_ns)
        else:
            self._clock.slew(now_ns, error_ns)
        self._used_ns = best.heard_ns
        self._answers = deque((each._replace(error_ns=each.error_ns - error_ns)
                               for each in self._answers), _ANSWERS)
        self._graph.context.record("clock_set", self._host, offset_ns)

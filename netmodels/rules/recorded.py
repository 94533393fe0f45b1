"""Loss, delay and rate of links as somebody has recorded them, in front of any network model."""

from __future__ import annotations

from pydantic import Field

from desim import ports
from desim.units import ByteSize, airtime_ns
from netmodels.link_traces import UNITS
from netmodels.measured import TraceFile, measured
from netmodels.random_loss import PairStreams, drop, losses


class _Links:
    """The recorded values of links now, means where several count alike."""

    def __init__(self, params: TraceFile, what: str, context: ports.RuleContext,
                 hosts: tuple[str, ...]) -> None:
        self._measured = measured(params, tuple(UNITS[what]), hosts, context)
        self._context = context

    def value(self, source: int, receiver: int) -> float | None:
        """The value of a link, None where nothing is known of it."""
        values = self._measured.values(source, receiver, self._context.now_ns)
        return sum(values) / len(values) if values else None


class RecordedLoss:
    """Packets of a link are lost with the chance that was recorded of it, independently of each
    other. ``file`` is a trace as of ``replay``, with a column loss_ratio or loss_percent, or a
    survey: a value holds until the next one of that link, the last one to the end. Nothing is lost
    before its first row, and on links that it does not have. What was recorded is what remained
    after all repetitions: no radio repeats it.

    Capabilities: Separates.
    """

    class Params(TraceFile):
        pass

    reasons = ("recorded_loss",)

    def __init__(self, params: Params) -> None:
        self._params = params

    def start(self, context: ports.RuleContext, hosts: tuple[str, ...]) -> None:
        self._links = _Links(self._params, "loss", context, hosts)
        self._streams = PairStreams(context, "recorded_loss", hosts)

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> list[ports.Verdict]:
        return [self._verdict(frame, receiver) for receiver in receivers]

    def _verdict(self, frame: ports.Frame, receiver: int) -> ports.Verdict:
        lost = losses(self._streams(frame.source, receiver), frame.segments,
                      self._links.value(frame.source, receiver) or 0.0)
        return drop("recorded_loss", lost, frame.segments) if lost else ports.PASS

    def separates(self, host: int, other: int) -> bool:
        """Whether no frame gets between the two now."""
        return self._links.value(host, other) == 1.0


class RecordedDelay:
    """All of a link arrives later, by the delay that was recorded of it at the time of sending.
    ``file`` is a trace as of ``replay``, with a column delay_s, delay_ms or delay_us, or a survey.
    Where it says nothing, nothing is late. Frames overtake each other where the delay falls (netem,
    too)."""

    class Params(TraceFile):
        pass

    reasons = ()

    def __init__(self, params: Params) -> None:
        self._params = params

    def start(self, context: ports.RuleContext, hosts: tuple[str, ...]) -> None:
        self._links = _Links(self._params, "delay", context, hosts)

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> list[ports.Verdict]:
        return [ports.Deliver(round(self._links.value(frame.source, receiver) or 0.0))
                for receiver in receivers]


class RecordedRate:
    """A link's frames go one behind the other at the rate that was recorded of it when each was
    sent: delay = wait behind earlier frames of the link + size * 8 / rate. ``file`` is a trace as
    of ``replay``, with a column rate_bps, rate_kbps or rate_mbps, or a survey. Where it says
    nothing, no rate limits a link; at 0 nothing gets through. A frame with more than ``backlog``
    waiting (its own size included) is dropped. What waits at ``until`` leaves then, in order and
    as fast as the medium takes it.

    Capabilities: Queues, Separates, TakesBack.
    """

    class Params(TraceFile):
        backlog_bytes: ByteSize = Field("64 MB", description="(as the queue of ``link``)")

    reasons = ("rate_limited",)

    def __init__(self, params: Params) -> None:
        self._params = params

    def start(self, context: ports.RuleContext, hosts: tuple[str, ...]) -> None:
        self._links = _Links(self._params, "rate", context, hosts)
        self._context = context
        self.emptied()
        self._last: dict[int, list[tuple[int, int]]] = {}  # by sender: receivers, rates

    def emptied(self) -> None:
        """``ports.Queues``."""
        self._free_ns: dict[tuple[int, int], int] = {}

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> list[ports.Verdict]:
        self._last[frame.source] = []
        return [self._verdict(frame, receiver) for receiver in receivers]

    def _verdict(self, frame: ports.Frame, receiver: int) -> ports.Verdict:
        rate, link = self._links.value(frame.source, receiver), (frame.source, receiver)
        if rate is None:
            return ports.PASS
        rate_bps, now_ns = round(rate), self._context.now_ns
        if not rate_bps:
            return ports.Drop("rate_limited")
        end_ns = (max(self._free_ns.get(link, 0), now_ns)
                  + airtime_ns(frame.size_bytes, rate_bps))
        if end_ns - now_ns > airtime_ns(self._params.backlog_bytes, rate_bps):
            return ports.Drop("rate_limited")
        self._free_ns[link] = end_ns
        self._last[frame.source].append((receiver, rate_bps))
        return ports.Deliver(end_ns - now_ns)

    def refused(self, host: int, size_bytes: int) -> None:
        """``ports.TakesBack``."""
        for receiver, rate_bps in self._last[host]:
            self._free_ns[host, receiver] -= airtime_ns(size_bytes, rate_bps)

    def separates(self, host: int, other: int) -> bool:
        """Whether no frame gets between the two now."""
        rate = self._links.value(host, other)
        return rate is not None and not round(rate)

"""Everything arrives later."""

from __future__ import annotations

from pydantic import Field

from desim import ports
from desim.units import Duration


class Latency:
    """Adds ``delay``, and where ``jitter`` is set a uniform part of it more, drawn for each ordered
    pair of hosts from its own stream. Frames may overtake each other by their jitter."""

    class Params(ports.Params):
        delay_ns: Duration = Field(description="one way")
        jitter_ns: Duration = Field("0 ns", description="upper end of the uniform addition (none)")

    reasons = ()

    def __init__(self, params: Params) -> None:
        self._delay_ns = params.delay_ns
        self._jitter_ns = params.jitter_ns
        self._fixed = ports.Deliver(params.delay_ns)

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self._context = context
        self._hosts = hosts

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> list[ports.Verdict]:
        if not self._jitter_ns:
            return [self._fixed] * len(receivers)
        return [ports.Deliver(self._delay_ns + self._draw(frame.source, receiver))
                for receiver in receivers]

    def _draw(self, source: int, receiver: int) -> int:
        stream = self._context.stream("jitter", self._hosts[source], self._hosts[receiver])
        return int(stream.random() * (self._jitter_ns + 1))

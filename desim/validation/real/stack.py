"""The way from a program to the air as the guest has it, for our models."""

from __future__ import annotations

from typing import ClassVar

from desim import ports
from desim.loop.gateway import STACK_NS


class Stack:
    """A rule that has each frame set out up to ``STACK_NS`` later, after all before it of its host,
    as real ones do (``Gateway.take``). A train sets out with its last packet. It is a queue in
    front of the medium, so its scope has to have an end.

    Capabilities: Queues.
    """

    Params = ports.Params
    reasons: ClassVar[tuple[str, ...]] = ()

    def __init__(self, params: ports.Params) -> None:
        self._last_ns: dict[int, int] = {}  # by host, when its last frame set out

    def start(self, context: ports.RuleContext, hosts: tuple[str, ...]) -> None:
        self._context = context
        self._draws = [context.stream("stack", host) for host in hosts]

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> list[ports.Verdict]:
        now_ns, source = self._context.now_ns, frame.source
        drawn_ns = int(self._draws[source].integers(STACK_NS, size=frame.segments).max())
        self._last_ns[source] = at_ns = max(self._last_ns.get(source, 0), now_ns + drawn_ns)
        return [ports.Deliver(at_ns - now_ns)] * len(receivers)

    def emptied(self) -> None:
        """``ports.Queues``: nothing waits after the last frame's departure anyway."""

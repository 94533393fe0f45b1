"""Interfaces and links that are down at set times."""

from __future__ import annotations

from desim import ports
from netmodels.rules.targets import Targets
from netmodels.rules.window import TimeWindow


class Outage:
    """From ``from`` until ``until`` nothing gets out of or into the ``hosts``, and nothing over the
    ``links``. The hosts themselves go on; ``faults`` stop them.

    Capabilities: Separates.
    """

    class Params(TimeWindow, Targets):
        pass

    reasons = ("outage",)

    def __init__(self, params: Params) -> None:
        self._params = params

    def start(self, context: ports.RuleContext, hosts: tuple[str, ...]) -> None:
        self._context = context
        named, links = self._params.resolved(hosts)
        self._hosts, self._links = frozenset(named), frozenset(links)

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> list[ports.Verdict] | None:
        if not self._params.holds(self._context.now_ns):
            return None
        return [ports.Drop("outage") if self._cuts(frame.source, receiver) else ports.PASS
                for receiver in receivers]

    def separates(self, host: int, other: int) -> bool:
        """Whether no frame gets between the two now."""
        return self._params.holds(self._context.now_ns) and self._cuts(host, other)

    def _cuts(self, one: int, other: int) -> bool:
        return (one in self._hosts or other in self._hosts
                or (min(one, other), max(one, other)) in self._links)

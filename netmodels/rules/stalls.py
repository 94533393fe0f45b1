"""Links that stand still now and then, as a real card's do."""

from __future__ import annotations

from desim import ports
from netmodels.stalls import StallLaw, Stalls


class Stall:
    """Now and then a host's link stalls: what it sends or is sent meanwhile arrives at the end of
    that. Each of ``hosts`` (none: all) has stalls of its own, in both directions.

    The defaults are fitted to the round trips of a laptop over Wi-Fi with a repeater, one after
    another for 25.8 h (Fernandez-Madrigal et al. 2025, doi 10.5281/zenodo.14967644, experiment 011;
    p99 203 ms): the 43 an hour that took more than 400 ms.
    """

    class Params(StallLaw, ports.Targets):
        pass

    reasons = ()

    def __init__(self, params: Params) -> None:
        self._params = params

    def start(self, context: ports.RuleContext, hosts: tuple[str, ...]) -> None:
        self._context, params = context, self._params
        named, links = params.resolved(hosts)
        stalling = named if params.named else range(len(hosts))
        self._hosts = {host: Stalls(context.stream("host", hosts[host]), params)
                       for host in stalling}
        self._links = {
            (one, other): Stalls(context.stream("link", hosts[one], hosts[other]), params)
            for one, other in links}

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> list[ports.Verdict]:
        return [self._verdict(frame.source, receiver) for receiver in receivers]

    def _verdict(self, source: int, receiver: int) -> ports.Verdict:
        now_ns = self._context.now_ns
        stalls = (self._hosts.get(source), self._hosts.get(receiver),
                  self._links.get((min(source, receiver), max(source, receiver))))
        over_ns = max([one.over_ns(now_ns) for one in stalls if one is not None], default=now_ns)
        return ports.PASS if over_ns == now_ns else ports.Deliver(over_ns - now_ns)

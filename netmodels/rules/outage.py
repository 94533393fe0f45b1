"""Interfaces and links that are down: at set times, or by chance."""

from __future__ import annotations

import numpy as np
from pydantic import Field, model_validator

from desim import ports
from desim.units import Pace

_DOWN = ports.Drop("outage")


class SomeTargets(ports.Targets):
    """Hosts and links, at least one of them."""

    @model_validator(mode="after")
    def _names_something(self) -> SomeTargets:
        if not self.hosts and not self.links:
            raise ValueError("hosts or links must be given")
        return self


class Outage:
    """From ``from`` until ``until`` nothing gets out of or into the ``hosts``, and nothing over the
    ``links``. The hosts themselves go on; ``faults`` stop them.

    Capabilities: CutsCarrier, Separates.
    """

    class Params(ports.TimeWindow, SomeTargets):
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
        return [_DOWN if self._cuts(frame.source, receiver) else ports.PASS
                for receiver in receivers]

    def separates(self, host: int, other: int) -> bool:
        """Whether no frame gets between the two now."""
        return self._params.holds(self._context.now_ns) and self._cuts(host, other)

    def carrier(self, host: int) -> tuple[bool, int | None]:
        """``hosts`` have no carrier meanwhile; ``links`` take none away."""
        if host not in self._hosts:
            return True, None
        now_ns = self._context.now_ns
        return not self._params.holds(now_ns), self._params.changes_ns(now_ns)

    def _cuts(self, one: int, other: int) -> bool:
        return (one in self._hosts or other in self._hosts
                or (min(one, other), max(one, other)) in self._links)


class OnOffProcess:
    """Up and down in turn, for exponential times with means ``mean_ns`` (down, up); at time 0 it is
    up with the chance up / (up + down), for the rest of a spell as long as any. A function of time
    and of the stream alone: asking more often changes nothing. ``until_ns``: when it changes."""

    def __init__(self, stream: np.random.Generator, mean_ns: tuple[int, int]) -> None:
        self._stream = stream
        self._mean_ns = mean_ns
        self._up = bool(stream.random() * sum(mean_ns) < mean_ns[True])
        self.until_ns = self._spell_ns()

    def up(self, now_ns: int) -> bool:
        """Whether it is up; ``now_ns`` never decreases."""
        while self.until_ns <= now_ns:
            self._up = not self._up
            self.until_ns += self._spell_ns()
        return self._up

    def _spell_ns(self) -> int:
        return round(self._mean_ns[self._up] * self._stream.standard_exponential())


class Flapping:
    """The ``hosts``' interfaces and the ``links`` are up and down for exponentially distributed
    times. Each draws them from its own stream, and is available for up / (up + down) of the time. A
    link is down in both directions at once.

    Capabilities: CutsCarrier, Separates.
    """

    class Params(SomeTargets):
        up_ns: Pace = Field(examples=["1 min"],
                            description="mean time from coming up to going down")
        down_ns: Pace = Field(description="mean time from going down to coming up")

    reasons = ("outage",)

    def __init__(self, params: Params) -> None:
        self._params = params

    def start(self, context: ports.RuleContext, hosts: tuple[str, ...]) -> None:
        self._context = context
        mean_ns = self._params.down_ns, self._params.up_ns
        named, links = self._params.resolved(hosts)
        self._hosts = {host: OnOffProcess(context.stream("host", hosts[host]), mean_ns)
                       for host in named}
        self._links = {(one, other): OnOffProcess(context.stream("link", hosts[one], hosts[other]),
                                            mean_ns) for one, other in links}

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> list[ports.Verdict]:
        return [_DOWN if self.separates(frame.source, receiver) else ports.PASS
                for receiver in receivers]

    def separates(self, host: int, other: int) -> bool:
        """Whether no frame gets between the two now."""
        now_ns, hosts = self._context.now_ns, self._hosts
        spells = (hosts.get(host), hosts.get(other),
                  self._links.get((min(host, other), max(host, other))))
        return not all(spell is None or spell.up(now_ns) for spell in spells)

    def carrier(self, host: int) -> tuple[bool, int | None]:
        """``hosts`` have no carrier while they are down; ``links`` take none away."""
        spell = self._hosts.get(host)
        return (True, None) if spell is None else (spell.up(self._context.now_ns), spell.until_ns)

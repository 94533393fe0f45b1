"""A rule within its scope, and what waits in its queue where that ends."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

from desim.network.answer_checks import checked_delay, is_complete
from desim.ports import (
    PASS,
    CutsCarrier,
    Deliver,
    Drop,
    Frame,
    JudgesTransmissions,
    KnowsDepartures,
    Params,
    PassesMany,
    Queues,
    Rule,
    RuleContext,
    Separates,
    TakesBack,
    Targets,
    TimeWindow,
    Topics,
    Verdict,
    scope_beside,
)
from desim.ports.scope import is_topic
from desim.units import NEVER_NS

_ALWAYS, _ALL, _ALL_TOPICS = TimeWindow(), Targets(), Topics()


def scoped(rule: Rule, params: Params) -> Rule:
    """``rule`` within the scope that stands in its ``params`` (``ports.with_scope``); the rule
    itself where that is everything."""
    own = scope_beside(getattr(type(rule), "Params", Params))
    window = params if TimeWindow in own and isinstance(params, TimeWindow) else _ALWAYS
    targets = params if Targets in own and isinstance(params, Targets) else _ALL
    topics = params if Topics in own and isinstance(params, Topics) else _ALL_TOPICS
    if not window.bounded and not targets.named and not topics.topics:
        return rule
    cls = Scoped if window.until_ns is None or not isinstance(rule, Queues) else ScopedQueue
    # Complaints name the plug-in.
    named: type[Scoped] = type("Scoped", (cls,), {"__wrapped__": type(rule)})
    return named(rule, window, targets, topics.topics)


class Scoped:
    """Asks a rule about all frames, and lets pass what is out of its scope: the k-th frame of a
    link finds the same random numbers, whatever the scope. A rule that counts what it lets through
    takes such frames back.

    It has the rule's capabilities but ``LimitsReach``: what is out of its scope gets farther. With
    ``topics`` (patterns) the gate tells it of each frame what that carries (``follow``); then it
    neither ``Separates`` nor ``CutsCarrier``.
    """

    Params = Params

    def __init__(self, rule: Rule, window: TimeWindow, targets: Targets,
                 topics: Sequence[str] = ()) -> None:
        self._rule, self._window, self._targets = rule, window, targets
        self.topics = topics
        self._follows = not topics  # what the frame carries
        self._counted = True  # the last frame, by the rule
        self.reasons = rule.reasons
        if isinstance(rule, JudgesTransmissions):
            self.per_transmission = rule.per_transmission
        if isinstance(rule, PassesMany):
            self.all_pass = rule.all_pass
        if isinstance(rule, KnowsDepartures):
            self.departure_ns = rule.departure_ns
        if isinstance(rule, TakesBack):
            self._take_back = rule.refused
            self.refused = self._refused
        if isinstance(rule, Separates) and not topics:
            self._separated = rule.separates
            self.separates = self._separates
        if isinstance(rule, CutsCarrier) and not topics:
            self._own_carrier = rule.carrier
            self.carrier = self._carrier

    def start(self, context: RuleContext, hosts: tuple[str, ...]) -> None:
        named, links = self._targets.resolved(hosts)
        self._hosts = frozenset(named if self._targets.named else range(len(hosts)))
        self._links = frozenset(links)
        self._named = cache(lambda topic: any(is_topic(topic, pattern, hosts)
                                              for pattern in self.topics))
        self._context = context
        self._rule.start(context, hosts)

    def follow(self, topics: tuple[str, ...]) -> None:
        """The next frame carries messages of ``topics``."""
        self._follows = any(map(self._named, topics))

    def judge(self, frame: Frame, receivers: tuple[int, ...]) -> Sequence[Verdict] | None:
        verdicts = self._rule.judge(frame, receivers)
        within = [self._acts(frame.source, receiver) for receiver in receivers]
        self._counted = any(within)
        if all(within) or verdicts is not None and not is_complete(verdicts, len(receivers)):
            return verdicts
        if not self._counted:
            if isinstance(self._rule, TakesBack) and not (
                    verdicts and all(type(verdict) is Drop for verdict in verdicts)):
                self._take_back(frame.source, frame.size_bytes)
            return None
        return verdicts and [verdict if inside else PASS
                             for verdict, inside in zip(verdicts, within, strict=True)]

    def _refused(self, host: int, size_bytes: int) -> None:
        if self._counted:
            self._take_back(host, size_bytes)

    def _separates(self, host: int, other: int) -> bool:
        return self._acts(host, other) and self._separated(host, other)

    def _carrier(self, host: int) -> tuple[bool, int | None]:
        up, changes_ns = self._own_carrier(host)
        now_ns = self._context.now_ns
        acts = self._window.holds(now_ns) and host in self._hosts
        times_ns = [time_ns for time_ns in (changes_ns, self._window.changes_ns(now_ns))
                    if time_ns is not None]
        return up or not acts, min(times_ns, default=None)

    def _acts(self, one: int, other: int) -> bool:
        return self._follows and self._window.holds(self._context.now_ns) and (
            one in self._hosts or other in self._hosts
            or (min(one, other), max(one, other)) in self._links)


class ScopedQueue(Scoped):
    """A rule that ``Queues``, in a scope that ends.

    ``wait_ns``: for how long the frame that was judged last waits in front of the model, until the
    end at most. If its receivers wait for different times, that is the least of them, and the
    verdicts have the rest.
    """

    wait_ns = 0
    _end_ns = NEVER_NS  # when all leaves that waits

    def __init__(self, rule: Rule, window: TimeWindow, targets: Targets,
                 topics: Sequence[str] = ()) -> None:
        super().__init__(rule, window, targets, topics)
        assert isinstance(rule, Queues)
        self._emptied = rule.emptied
        if isinstance(rule, KnowsDepartures):
            own_ns = rule.departure_ns
            self.departure_ns = lambda host: min(own_ns(host), self._end_ns)

    def judge(self, frame: Frame, receivers: tuple[int, ...]) -> Sequence[Verdict] | None:
        now_ns = self._context.now_ns
        if now_ns >= self._end_ns:
            self._emptied()
            self._end_ns = NEVER_NS
        if self._window.holds(now_ns):
            self._end_ns = self._window.changes_ns(now_ns) or NEVER_NS
        verdicts = super().judge(frame, receivers)
        self.wait_ns = 0
        if not is_complete(verdicts, len(receivers)):
            return verdicts
        waits_ns = [min(checked_delay(self, "delays by", verdict.delay_ns), self._end_ns - now_ns)
                    if type(verdict) is Deliver else 0 for verdict in verdicts]
        self.wait_ns = min((wait_ns for wait_ns, verdict in zip(waits_ns, verdicts, strict=True)
                            if type(verdict) is not Drop), default=0)
        return [Deliver(wait_ns - self.wait_ns) if wait_ns > self.wait_ns else
                PASS if wait_ns else verdict
                for wait_ns, verdict in zip(waits_ns, verdicts, strict=True)]

"""The beliefs of all hosts about each other at an instant of a run, folded from its trace rows."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from typing import NamedTuple

import numpy as np

from desim import plugins
from desim.engine.trace import Names
from desim.errors import InputError, did_you_mean
from desim.middleware.beliefs import Beliefs
from desim.monitor.meters.reachability import Pair, linked_at
from desim.ports import natural_key
from desim.ports.middleware import HasDomains, HostState, Informs
from desim.results.file_names import LINKS
from desim.results.run import Run
from desim.results.status import refuse_imported
from desim.results.traces import Rows, refuse_failed, spools, trace_of
from desim.units import DURATION, NS_PER_S

KINDS = ("host_started", "host_stopped", "advertises", "subscribes", "believes", "sees")
_NAMED = 8  # topics in an error

Domains = Callable[[Sequence[str]], Sequence[int]]


class PairBelief(NamedTuple):
    """The belief of one host about another one: ``sees`` is online, offline, removed or never;
    ``known`` are the topics of matches that it knows, ``missing`` of those that it has not learnt
    of, ``ghosts`` of those that do not exist.

    ``reached`` is the truth: both are up and frames get from each to the other, as of the last
    sample of the links, less than a second ago; None: the run has not kept it."""

    believer: str
    other: str
    sees: str
    known: tuple[str, ...]
    missing: tuple[str, ...]
    ghosts: tuple[str, ...]
    reached: bool | None = None

    @property
    def mistaken(self) -> bool:
        """Whether the other one is taken for online and out of reach, or for gone and in reach."""
        return (self.reached is not None and self.sees != "never"
                and (self.sees == HostState.ONLINE) != self.reached)


class BeliefSnapshot(NamedTuple):
    """All beliefs at one instant: ``views`` has each ordered pair of hosts, believer by believer.
    ``informed`` is the end of a match that has to learn of the other one; ``up`` is by host."""

    at_ns: int
    informed: str
    up: dict[str, bool]
    views: tuple[PairBelief, ...]

    @property
    def known(self) -> int:
        """Matches that are known."""
        return sum(len(view.known) for view in self.views)

    @property
    def missing(self) -> int:
        return sum(len(view.missing) for view in self.views)

    @property
    def ghosts(self) -> int:
        return sum(len(view.ghosts) for view in self.views)

    @property
    def seen(self) -> dict[str, int]:
        """The numbers of ordered pairs (believer, other) whose believer is up, by the state that it
        assumes of the other."""
        count = Counter(view.sees for view in self.views if self.up[view.believer])
        return {state: count[state] for state in (*HostState, "never")}

    @property
    def mistaken(self) -> int:
        return sum(view.mistaken for view in self.views)

    @property
    def parts(self) -> list[list[str]] | None:
        """The hosts that are up, by who can reach whom over a chain of others; None: the run has
        not kept it."""
        if any(view.reached is None for view in self.views):
            return None
        joined = {(view.believer, view.other) for view in self.views if view.reached}
        left, parts = [host for host, up in self.up.items() if up], []
        while left:
            part = [left[0]]
            for member in part:  # which grows
                part += [host for host in left if host not in part and (member, host) in joined]
            left = [host for host in left if host not in part]
            parts.append([host for host in self.up if host in part])
        return parts

    @property
    def divergence(self) -> float:
        """The share of missing matches and ghosts, as in ``desim.middleware.beliefs.Beliefs``."""
        wrong = self.missing + self.ghosts
        return wrong / max(1, self.known + wrong)

    @property
    def headline(self) -> str:
        """The snapshot in two lines: matches, and pairs (believer, other) of hosts."""
        pairs = ", ".join(f"{number} {'never seen' if state == 'never' else f'seen {state}'}"
                           for state, number in self.seen.items() if number)
        reached = ("" if self.parts is None else
                   f"; in truth {sum(bool(view.reached) for view in self.views)} in reach, "
                   f"{self.mistaken} mistaken")
        return (f"at {self.at_ns / NS_PER_S:g} s: {self.known} of {self.known + self.missing} "
                f"matches known, {self.missing} missing, {_count(self.ghosts, 'ghost')}, "
                f"divergence {self.divergence:.3f}\n"
                f"{_count(sum(self.seen.values()), 'pair')} of hosts: {pairs or 'none'}{reached}")

    def of(self, topic: str) -> BeliefSnapshot:
        """Of this topic only. Raises ``InputError`` where nobody has a match on it."""
        topics = sorted({own for view in self.views
                         for own in (*view.known, *view.missing, *view.ghosts)}, key=natural_key)
        if topic not in topics:
            raise InputError(f"--topic: nobody knows or should know a match on {topic!r} then"
                             f"{did_you_mean(topic, topics)}; topics: "
                             f"{', '.join(topics[:_NAMED]) or 'none'}"
                             f"{', ...' if len(topics) > _NAMED else ''}")
        only = {topic}
        return self._replace(views=tuple(view._replace(
            known=tuple(only.intersection(view.known)),
            missing=tuple(only.intersection(view.missing)),
            ghosts=tuple(only.intersection(view.ghosts))) for view in self.views))


def beliefs_at(run: Run, at_ns: int | None = None) -> BeliefSnapshot:
    """The beliefs in ``run`` after everything that happened at ``at_ns`` (None: at its end).

    Where trace rows were not kept, the run is repeated up to then. Raises ``InputError`` for an
    instant after the end, for a middleware without beliefs, and where a run can be neither read
    nor repeated.
    """
    refuse_imported(run.path, run.manifest, "beliefs")
    middleware = _middleware(run)
    end_ns = round(run.manifest["simulated_s"] * NS_PER_S)
    if at_ns is None:
        refuse_failed(run)
        at_ns = end_ns
    elif at_ns > end_ns:
        raise InputError(f"--at: {DURATION.format(at_ns)} is after the end of the run, which was "
                         f"at {DURATION.format(end_ns)}")
    # Runs that failed, and those of earlier versions, have no links.
    linked = linked_at(run.table("links"), at_ns) if run.has(LINKS) else None
    with spools() as folder:
        return folded(trace_of(run, folder / "trace", at_ns), at_ns, middleware.informed, linked,
                      middleware.domains if isinstance(middleware, HasDomains) else None)


def folded(trace: Rows, at_ns: int, informed: str, linked: Mapping[Pair, bool] | None = None,
           domains: Domains | None = None) -> BeliefSnapshot:
    """The beliefs after the rows up to ``at_ns``; ``informed`` as middlewares have it, ``linked``
    for each pair whether frames get from one to the other then, ``domains`` that of each host
    (None: all are in one)."""
    kinds = {Names().id(kind): kind for kind in KINDS}
    rows, names = trace
    rows = rows[np.isin(rows["kind"], list(kinds)) & (rows["t_ns"] <= at_ns)]
    started = rows["entity"][rows["kind"] == Names().id("host_started")]
    hosts = sorted((names[id_] for id_ in np.unique(started).tolist()), key=natural_key)
    place = {Names().id(name): i for i, name in enumerate(hosts)}
    beliefs = Beliefs(informed, lambda *row: None, list(range(len(hosts))), lambda name: 0,
                      () if domains is None else domains(hosts))
    up = [False] * len(hosts)
    for _, kind, entity, a, b, c in rows.tolist():
        kind, host = kinds[kind], place[entity]
        if kind in ("host_started", "host_stopped"):
            up[host] = kind == "host_started"
            if not up[host]:
                beliefs.stops(host)
        elif kind == "sees":
            beliefs.sees(host, place[a], HostState(names[b]))
        elif kind == "believes":
            beliefs.knows(host, place[a], names[b], bool(c))
        elif kind == "subscribes":
            beliefs.subscribes(host, names[a])
        else:
            beliefs.advertises(host, names[a])
    is_up, views = dict(zip(hosts, up, strict=True)), _views(hosts, beliefs)
    if linked is not None:
        views = tuple(view._replace(reached=all(
            is_up[one] and is_up[other] and linked.get((one, other), False)
            for one, other in (view[:2], view[1::-1]))) for view in views)
    return BeliefSnapshot(at_ns, informed, is_up, views)


def _views(hosts: list[str], beliefs: Beliefs) -> tuple[PairBelief, ...]:
    topics: dict[tuple[int, int], tuple[list[str], list[str], list[str]]] = {
        (believer, other): ([], [], []) for believer in range(len(hosts))
        for other in range(len(hosts)) if other != believer}
    for believer, other, topic in sorted(beliefs.true.keys() | beliefs.believed.keys()):
        match = believer, other, topic
        which = 2 if match not in beliefs.true else 0 if match in beliefs.believed else 1
        topics[believer, other][which].append(topic)
    return tuple(PairBelief(hosts[believer], hosts[other],
                      beliefs.seen.get((believer, other), "never"), tuple(known), tuple(missing),
                      tuple(ghosts))
                 for (believer, other), (known, missing, ghosts) in topics.items())


def _middleware(run: Run) -> Informs:
    choice = run.scenario.middleware
    with nullcontext() if run.trust else plugins.installed_only():
        middleware = plugins.load("middleware", choice.model)(choice.params)
    if not isinstance(middleware, Informs):
        raise InputError(f"{run.path}: under middleware {choice.model!r} nobody believes anything: "
                         "everybody knows at once who is there; desim graph shows runs of a "
                         "middleware that has to find out (desim plugins lists them)")
    return middleware


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"

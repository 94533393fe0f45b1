"""Checks of middlewares: does a class keep its contract?"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from desim.engine.kernel import Kernel
from desim.engine.streams import Streams
from desim.engine.trace import Names, Trace
from desim.middleware.graph import Graph
from desim.ports.middleware import Addressing, Advertisement, Endpoint, Middleware, TransportKind
from desim.testing.advice import PluginClass, check_form, made, need
from desim.testing.checks import own_streams
from desim.testing.fleet import HOSTS, Fleet
from desim.units import NS_PER_S

_WINDOW_NS = 5 * NS_PER_S  # messages of this time have to be heard
_QUIET_NS = 30 * NS_PER_S  # nobody publishes: any events are the middleware's


class Patience(NamedTuple):
    """The times that a middleware may take, as its author states them: until all have found each
    other after the start (``find_ns``) and after an outage (``again_ns``), until a message has
    arrived where nothing is wrong (``arrive_ns``). ``stops`` are the hosts that stop, one after the
    other, each for ``down_ns``; for ``apart_ns`` two hosts cannot reach the other two. At most
    ``events_per_s`` events may happen in a simulated second without messages, with four
    hosts."""

    find_ns: int = 30 * NS_PER_S
    again_ns: int = 150 * NS_PER_S
    arrive_ns: int = NS_PER_S
    down_ns: int = 20 * NS_PER_S
    apart_ns: int = 60 * NS_PER_S
    stops: tuple[int, ...] = (1,)
    events_per_s: float = 1000.0


_USUAL = Patience()


def check_middleware(cls: PluginClass[Middleware], **params: object) -> None:
    """Check a ``ports.middleware.Middleware`` whose registries settle at once: the answer does not
    depend on the order of subscribing, changes are announced, a stopped host is no surprise."""
    check_form("middleware", cls, params)
    ends = [Endpoint(host, node, "/map") for host in (2, 0, 10) for node in ("b", "a")]
    advertised = Advertisement(Endpoint(1, "talker", "/map"), TransportKind.STREAM,
                               Addressing.UNICAST, 1, False)
    publisher, answers = advertised.publisher, []
    for order in (ends, ends[::-1]):
        middleware, counter, names = made(cls, params), _ChangeCounter(), Names()
        graph = Graph(Kernel(), names, Trace(names), Streams(0), middleware,
                      [f"host_{i}" for i in range(12)])
        graph.topic("/map").publishers.append(counter)  # type: ignore[arg-type] # all of it that is used here
        middleware.advertise(advertised)
        for end in order:
            before = middleware.subscribers(publisher)
            middleware.subscribe(end)
            if middleware.subscribers(publisher) != before:
                need(counter.times, cls, "call changed(topic) when an answer changes")
        answers.append(middleware.subscribers(publisher))
        middleware.switched(11, False)
        middleware.switched(2, False)
        need(set(middleware.subscribers(publisher)) <= set(ends), cls,
             "answer with subscribers of the publisher's topic only")
    need(isinstance(answers[0], tuple), cls, "answer with a tuple")
    need(answers[0] == answers[1], cls, "answer in an order that does not depend on who came "
                                        f"first, got {answers[0]} and {answers[1]}")


class _ChangeCounter:
    """Stands for a publisher."""

    times = 0

    def changed(self) -> None:
        self.times += 1


def check_discovery(cls: PluginClass[Middleware], patience: Patience = _USUAL,
                    **params: object) -> None:
    """Check a ``ports.middleware.Middleware``, also one that takes time, with the four hosts of
    ``Fleet`` on a medium where everything arrives at once.

    All find each other, messages go to exactly the subscribers, each has one fate at each of them,
    once; after hosts stopped and started, and after two could not reach the other two for a while,
    messages flow again; what hosts believe is true then; timers come to rest; the same seed, and
    the same hosts in another order, give the same trace.
    """
    check_form("middleware", cls, params)
    with own_streams(cls):
        digest = _played(cls, HOSTS, patience, params)
        turned = _played(cls, HOSTS[::-1], patience, params)
    if turned != digest:
        need(_played(cls, HOSTS, patience, params) == digest, cls,
             "give the same trace for the same seed: keep state in self, and iterate over no set")
        need(False, cls, "give the same trace in whatever order hosts are declared")


def _played(cls: PluginClass[Middleware], hosts: Sequence[str], patience: Patience,
            params: dict[str, object]) -> str:
    """The digest of the whole play."""
    fleet = Fleet(made(cls, params), hosts)
    fleet.talk(patience.find_ns)
    _check_flow(cls, fleet, patience, f"{patience.find_ns / NS_PER_S:g} s after the start")
    before = _check_rest(cls, fleet, patience)
    again = f"{patience.again_ns / NS_PER_S:g} s after"
    for host in patience.stops:
        fleet.stop(host)
        fleet.talk(patience.down_ns)
        fleet.start(host)
        fleet.talk(patience.again_ns)
        _check_flow(cls, fleet, patience, f"{again} {fleet.hosts[host].name} was started again")
    fleet.apart.groups[:2] = [1, 1]
    fleet.talk(patience.apart_ns)
    fleet.apart.groups[:2] = [0, 0]
    fleet.talk(patience.again_ns)
    _check_flow(cls, fleet, patience, f"{again} hosts could reach each other again")
    after = _check_rest(cls, fleet, patience)
    need(after <= 1.5 * before + 10.0, cls, f"come to rest after outages: without messages there "
         f"are {after:g} events a simulated second now, before it were {before:g}")
    need(not fleet.open(), cls, f"deliver or drop every message: {fleet.open()} are left over "
                                "although nobody has said anything for a while")
    _check_end(cls, fleet, patience)
    return fleet.trace.digest()


def _check_flow(cls: PluginClass[Middleware], fleet: Fleet, patience: Patience, when: str) -> None:
    since = len(fleet.said)
    fleet.talk(_WINDOW_NS)
    fleet.run(patience.arrive_ns)
    need(not fleet.faults, cls,
         f"take each message to whoever listens, once: {_first(fleet.faults)}")
    unheard = fleet.unheard(since)
    need(not unheard, cls, f"bring subscribers and publishers together: {when} {_first(unheard)}")
    beliefs = fleet.graph.context.beliefs
    if beliefs is not None:
        need(not beliefs.missing and not beliefs.ghosts, cls,
             f"say by context.knows what hosts believe: {when} messages flow, but {beliefs.missing}"
             f" matches of {beliefs.matches} are missing and there are {beliefs.ghosts} ghosts")


def _check_rest(cls: PluginClass[Middleware], fleet: Fleet, patience: Patience) -> float:
    """Events a simulated second while nobody says anything."""
    events = fleet.kernel.events
    fleet.run(_QUIET_NS)
    rate = (fleet.kernel.events - events) * NS_PER_S / _QUIET_NS
    need(rate <= patience.events_per_s, cls, f"let timers rest: without messages there are {rate:g}"
         f" events a simulated second, more than {patience.events_per_s:g}")
    return rate


def _check_end(cls: PluginClass[Middleware], fleet: Fleet, patience: Patience) -> None:
    for host in range(len(fleet.hosts)):
        fleet.stop(host)
    fleet.run(patience.again_ns)
    events = fleet.kernel.events
    fleet.run(_QUIET_NS)
    events = fleet.kernel.events - events
    need(not events, cls, f"do nothing when no host runs: {events} events in "
                          f"{_QUIET_NS / NS_PER_S:g} s")
    need(not fleet.faults, cls, f"leave stopped hosts alone: {_first(fleet.faults)}")


def _first(faults: list[str]) -> str:
    more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
    return "".join(faults[:1]) + more

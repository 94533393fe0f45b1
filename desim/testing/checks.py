"""Checks of network models, rules, strategies and cases: does a class keep its contract?"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from inspect import isfunction
from itertools import zip_longest
from typing import cast

import numpy as np

from desim import ports
from desim.netcases.case import play
from desim.network.passages import Passages
from desim.network.scoped_rule import scoped
from desim.ports.cases import Case
from desim.testing.advice import PluginClass, check_form, complaint, made, need, parsed
from desim.testing.capabilities import (
    Retrying,
    check_claims,
    check_parts,
    check_switching,
    check_transmissions,
)
from desim.testing.medium_bench import HOUR_NS, Bench, Fate, ImmediateNetwork
from desim.units import NS_PER_S

_FRAMES = 300
_BURSTS = 150
_WITHIN_NS = (200_000, 200_000_000, 2 * NS_PER_S, 300 * NS_PER_S)  # of the start
_HOSTS = {"host_1": (0.0, 0.0), "host_2": (5.0, 0.0), "host_3": (60.0, 10.0),
          "host_10": (190.0, -20.0), "host_11": (900.0, 900.0), "nowhere": (np.nan, np.nan)}
_SILENT = {"host_4": (1.0, 1.0)}  # sorts into the middle, so that it moves the others' indices
_CROWD = {f"host_{number}": (number / 10, 3.0) for number in range(20, 60)}  # hear bursts


def check_network(cls: PluginClass[ports.NetworkModel] | type[ports.Builds], **params: object
                  ) -> None:
    """Check a ``ports.NetworkModel``: declarations, one settlement per receiver and one fate of
    each packet of a train, repeatability, random numbers from the context alone, that a silent host
    changes nothing, and each capability that it claims: for instance, that nothing arrives where
    ``reach_m`` or ``separates`` says that nothing can."""
    _check_declarations("network", cls, params)

    def model() -> ports.NetworkModel:
        return ports.model_of(cls, parsed(cls, params))

    def make(rules: Sequence[ports.Rule] = (), passages: Passages | None = None) -> Bench:
        return Bench(model(), _HOSTS, rules=rules, passages=passages)

    check_parts(cls, make(passages=Passages()), _play, _play(make()))
    _check_play(cls, make, lambda: Bench(model(), _HOSTS | _SILENT))
    _check_many(cls, lambda: Bench(model(), _HOSTS | _CROWD))
    check_switching(cls, make(), _play)
    check_transmissions(cls, make, _play)


def check_rule(rule: PluginClass[ports.Rule] | ports.RuleFunction, **params: object) -> None:
    """Check a ``ports.Rule``, a class or a plain function, in the same way."""
    cls = cast(PluginClass[ports.Rule],  # isfunction says nothing of what is no function
               ports.function_rule(rule) if isfunction(rule) else rule)
    _check_declarations("rule", cls, params)
    for model in ImmediateNetwork, Retrying:
        _check_play(cls, lambda: Bench(model(), _HOSTS, rules=[made(cls, params)]),  # noqa: B023
                    lambda: Bench(model(), _HOSTS | _SILENT,  # noqa: B023 - called right away
                                  rules=[made(cls, params)]))
        _check_many(cls, lambda: Bench(model(), _HOSTS | _CROWD,  # noqa: B023
                                       rules=[made(cls, params)]))
    _check_scope(cls, params)


def _check_scope(cls: PluginClass[ports.Rule], params: dict[str, object]) -> None:
    """Check that the rule keeps its contract within a scope, and a link its fates there: what it
    does to a frame hangs on who sends it to whom, in which order, and not on what becomes of it."""
    def log(scope: ports.Params, hosts: dict[str, tuple[float, float]] = _HOSTS) -> Bench:
        return Bench(ImmediateNetwork(), hosts, rules=[scoped(made(cls, params), scope)])

    links = ports.Targets(links=[("host_1", "host_2"), ("host_3", "host_1*")])
    window = ports.TimeWindow(**{"from": "500 ms", "until": "1500 ms"})
    for scope in links, window, ports.Topics(topics=["/host_[12]/frames"]):
        _check_play(cls, lambda: log(scope), lambda: log(scope, _HOSTS | _SILENT))  # noqa: B023


def check_case(cls: PluginClass[Case], **params: object) -> None:
    """Check a ``ports.cases.Case``: its options are described, its setup fits together, something
    becomes of what is sent, and the same seed gives the same measures."""
    check_form("case", cls, params)
    case = made(cls, params)
    setup = case.setup()
    for flow in setup.flows:
        strangers = {flow.source, *flow.receivers} - set(setup.places)
        need(not strangers, cls, f"give a place to {', '.join(sorted(strangers))}")
        need(flow.source not in flow.receivers, cls, f"not let {flow.source} send to itself")
    need(0 <= setup.warm_up_ns < setup.duration_ns, cls, "measure after the warm-up, not "
         f"{setup.duration_ns - setup.warm_up_ns} ns")
    measures = play(setup)
    need(measures["delivered"] + sum(measures["lost"].values()) > 0, cls,
         "last so long that frames are settled")
    need(play(case.setup()) == measures, cls, "give the same measures for the same seed: make the "
                                              "setup anew, and draw from context.stream(name)")


def _check_declarations(kind: str, cls: PluginClass[object], params: dict[str, object]) -> None:
    check_form(kind, cls, params)
    refuses = getattr(cls, "refuses", ())
    need(isinstance(refuses, tuple) and {*refuses} <= {*getattr(cls, "reasons", ())}, cls,
         f"declare in refuses some of its reasons, not {refuses!r}")


def _check_play(cls: PluginClass[object], make: Callable[[], Bench],
                make_larger: Callable[[], Bench]) -> None:
    bench = make()
    with own_streams(cls):
        log = _play(bench)
    medium = bench.medium
    need(not medium.in_flight(), cls, f"settle every frame at every receiver: an hour after the "
                                      f"last one {medium.in_flight()} were not")
    fates = len(log) - medium.copies
    need(medium.intended == medium.delivered + sum(medium.dropped.values()) == fates, cls,
         "settle each receiver exactly once")
    need(medium.packets_intended == medium.packets_delivered + sum(
        medium.packets_dropped.values()), cls, "name each lost packet of a train once")
    need(_play(make()) == log, cls, "give the same fates for the same seed: keep state in self, "
                                    "and iterate over no set")
    check_claims(cls, bench)
    _check_links(cls, make())
    need(_play(make_larger()) == log, cls, "give the same fates when a host is added that says "
                                           "nothing: draw from streams named by host, not index")


def _check_links(cls: PluginClass[object], bench: Bench) -> None:
    everybody = np.arange(len(bench.hosts))
    links: dict[object, np.ndarray | None] = {}

    def sample(label: int) -> None:
        links[label] = bench.medium.linked(everybody)

    for _, label, source, receiver, fate in _play(bench, sample):
        known = links[label]
        linked = known is None or known[bench.hosts.index(source), bench.hosts.index(receiver)]
        need(linked or not fate.startswith("arrived"), cls,
             "deliver nothing beyond reach_m and nothing between hosts that it separates")


def _play(bench: Bench, sample: Callable[[int], None] | None = None) -> list[Fate]:
    """Play a seeded load of unicast and broadcast frames, single packets and trains. ``sample`` is
    called with the label of each just before it is sent."""
    draw = random.Random(1)
    hosts = sorted(_HOSTS, key=ports.natural_key)
    for label in range(_FRAMES):
        source = draw.choice(hosts)
        others = [host for host in hosts if host != source]
        broadcast = draw.random() < 0.3
        segments = draw.choice([1, 1, 1, 2, 10, 100])
        time_ns = draw.randrange(2 * NS_PER_S)
        if sample is not None:
            bench.book(time_ns, sample, label)
        bench.send(time_ns, source,
                   draw.sample(others, draw.randint(1, len(others))) if broadcast
                   else draw.choice(others), segments * draw.randint(64, 1518), segments, label,
                   broadcast)
    return bench.run(2 * NS_PER_S + HOUR_NS)


def _check_many(cls: PluginClass[object], make: Callable[[], Bench]) -> None:
    """Check that many frames at once meet the fates that each of them would meet for itself, and
    keep a medium busy for as long."""
    if not any(isinstance(part, ports.SendsMany | ports.PassesMany)
               for part in (make().medium.model, *make().medium.rules)):
        return
    advice = "treat many frames (send_many, all_pass) as each of them for itself (send, judge)"
    many, each = make(), make()
    together, alone = _play_bursts(many, singly=False), _play_bursts(each, singly=True)
    for one, other in zip_longest(together, alone):
        need(one == other, cls, f"{advice}; of these fates (ns, label, source, receiver, fate) the "
                                f"first that differ are {one} at once, {other} one by one")
    busy_ns = [bench.medium.model.busy_ns(range(len(bench.hosts))) for bench in (many, each)
               if isinstance(bench.medium.model, ports.CountsBusyTime)]
    need(busy_ns[:1] == busy_ns[1:], cls, f"{advice}; busy_ns at once and one by one: {busy_ns}")


def _play_bursts(bench: Bench, singly: bool) -> list[Fate]:
    """Play a seeded load of bursts, to one host or to dozens, some of them close together, with
    single frames between."""
    draw = random.Random(1)
    for label in range(_BURSTS):
        source, *others = draw.sample(bench.hosts, len(bench.hosts))
        receivers = others[:draw.choice([1, 5, draw.randint(1, len(others)), len(others)])]
        time_ns = draw.randrange(draw.choice(_WITHIN_NS))
        segments = draw.choice([1, 1, 3, 40])
        size_bytes = segments * draw.randint(64, 1518)
        bench.send_burst(time_ns, source, receivers, size_bytes, segments, label, singly)
        bench.send(time_ns + draw.randrange(100_000), others[-1], source, 1000, 1, -label)
    return sorted(bench.run(), key=str)


@contextmanager
def own_streams(cls: object) -> Iterator[None]:
    """Check that nothing draws from the global generators meanwhile, or ends the program."""
    def state() -> tuple[object, ...]:
        legacy = np.random.get_state(legacy=False)["state"]  # noqa: NPY002 - watched only
        return random.getstate(), legacy["key"].tolist(), legacy["pos"]

    before = state()
    try:
        yield
    except SystemExit as error:  # it would end the whole test run
        raise complaint(cls, "not call sys.exit()") from error
    need(state() == before, cls, "draw from context.stream(name) only, not from random or "
                                 "numpy.random")

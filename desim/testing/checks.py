"""Does a network model, a rule, a strategy or a case keep its contract?"""

from __future__ import annotations

import random
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from inspect import isfunction
from typing import Any

import numpy as np
from pydantic import ValidationError

from desim import ports
from desim.engine.kernel import Kernel, Phase
from desim.engine.streams import Streams
from desim.engine.trace import Names
from desim.netcases.case import play
from desim.network.medium import Medium
from desim.network.place import Still
from desim.units import NS_PER_S

HOUR_NS = 3600 * NS_PER_S
_FRAMES = 300
_HOSTS = {"host_1": (0.0, 0.0), "host_2": (5.0, 0.0), "host_3": (60.0, 10.0),
          "host_10": (190.0, -20.0), "host_11": (900.0, 900.0), "nowhere": (np.nan, np.nan)}
_SILENT = {"host_4": (1.0, 1.0)}  # sorts into the middle, so that it moves the others' indices


class Bench:
    """A medium on a kernel of its own, with named hosts at fixed places and a log of every fate.

    ``places``: host name to x, y in m (NaN: none), or a number of hosts without a place, called
    ``host_1``, ``host_2``, ... ``log`` has (time_ns, label, source, receiver, fate), the fate being
    ``"arrived"`` or the reason of a drop; ``"arrived in part"`` for a train that lost some packets,
    which ``parts`` names (label, receiver, packet number to reason); ``"repeated"`` for a copy
    behind an arrival.
    """

    def __init__(self, model: ports.NetworkModel,
                 places: dict[str, tuple[float, float]] | int = 4, *,
                 rules: Sequence[ports.Rule] = (), seed: int = 0) -> None:
        if isinstance(places, int):
            places = {f"host_{i}": (np.nan, np.nan) for i in range(1, places + 1)}
        self.hosts = tuple(sorted(places, key=ports.natural_key))
        self.kernel = Kernel()
        self.names = Names()
        self.log: list[tuple[int, Any, str, str, str]] = []
        self.parts: list[tuple[Any, str, dict[int, str]]] = []
        place = Still(np.array([places[host] for host in self.hosts]))
        self.medium = Medium("bench", model, rules, kernel=self.kernel, names=self.names,
                             streams=Streams(seed), hosts=self.hosts, place=place)

    def send(self, time_ns: int, source: str, receivers: str | Sequence[str], size_bytes: int,
             segments: int = 1, label: Any = None, broadcast: bool = False) -> None:
        """Book a frame. It is logged under ``label``."""
        receivers = (receivers,) if isinstance(receivers, str) else tuple(receivers)
        indices = tuple(sorted(map(self.hosts.index, receivers)))

        def transmit(_: Any) -> None:
            self.medium.transmit(self.hosts.index(source), indices, size_bytes, segments, broadcast,
                                 self, (label, source))

        self.kernel.at(time_ns, Phase.CONTROL, self.names.id(source), transmit)

    def run(self, until_ns: int = HOUR_NS) -> list[tuple[int, Any, str, str, str]]:
        """Play what is booked; returns ``log``."""
        self.kernel.run(until_ns)
        return self.log

    def arrived(self, token: tuple[Any, str], receiver: int) -> None:
        self._note(token, receiver, "arrived")

    def arrived_in_part(self, token: tuple[Any, str], receiver: int, lost: dict[int, str]) -> None:
        self.parts.append((token[0], self.hosts[receiver], lost))
        self._note(token, receiver, "arrived in part")

    def lost(self, token: tuple[Any, str], receiver: int, reason: str) -> None:
        self._note(token, receiver, reason)

    def missed(self, token: tuple[Any, str], receivers: Collection[int], reason: str,
               medium: Medium) -> None:
        for receiver in receivers:
            self._note(token, receiver, reason)

    def repeated(self, token: tuple[Any, str], receiver: int) -> None:
        self._note(token, receiver, "repeated")

    def _note(self, token: tuple[Any, str], receiver: int, fate: str) -> None:
        self.log.append((self.kernel.now_ns, *token, self.hosts[receiver], fate))


class Instant:
    """The network model behind a rule under test: everything arrives at once."""

    Params = ports.Params
    reasons = ()

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self._context = context

    def send(self, frame: ports.Frame) -> None:
        self._context.settle_many(frame, frame.receivers, ports.Deliver(0))


def check_network(cls: type, **params: Any) -> None:
    """Check a ``ports.NetworkModel``: declarations, one settlement per receiver and one fate of
    each packet of a train, repeatability, no luck but the context's, that a silent host changes
    nothing, and that nothing arrives where ``reach_m`` or ``separates`` says that nothing can."""
    _check_declarations(cls, params)
    _check_play(cls, lambda: Bench(cls(cls.Params(**params)), _HOSTS),
                lambda: Bench(cls(cls.Params(**params)), _HOSTS | _SILENT))


def check_rule(cls: type | ports.RuleFunction, **params: Any) -> None:
    """Check a ``ports.Rule``, a class or a plain function, in the same way."""
    cls = ports.function_rule(cls) if isfunction(cls) else cls
    _check_declarations(cls, params)
    _check_play(cls, lambda: Bench(Instant(), _HOSTS, rules=[cls(cls.Params(**params))]),
                lambda: Bench(Instant(), _HOSTS | _SILENT,
                              rules=[cls(cls.Params(**params))]))


def check_strategy(cls: type, **params: Any) -> None:
    """Check a ``ports.Strategy``: it takes one of the frontiers that it is shown, or None when
    there is none, and takes the same one when asked again."""
    check_parameters(cls, params)
    frontiers = [ports.Frontier(4.0, 0.0, 4.0, 12), ports.Frontier(0.0, 9.0, 11.0, 80),
                 ports.Frontier(-30.0, 2.0, 45.0, 7)]
    need(cls(cls.Params(**params)).choose(_View([])) is None, cls,
         "return None when there is no frontier")
    choices = [cls(cls.Params(**params)).choose(_View(frontiers)) for _ in range(2)]
    need(choices[0] is None or choices[0] in frontiers, cls,
         f"return one of view.frontiers() or None, not {choices[0]!r}")
    need(choices[0] == choices[1], cls, f"choose alike in like situations, got {choices}")


class _View:
    """A robot at the origin that heard of one other robot."""

    name = "robot_1"
    now_ns = 10 * NS_PER_S
    pose = (0.0, 0.0, 0.0)

    def __init__(self, frontiers: list[ports.Frontier]) -> None:
        self._frontiers = frontiers
        self.peers = {"robot_2": ports.Peer(5.0, 5.0, 0.0, 9 * NS_PER_S)}

    def frontiers(self, limit: int | None = None) -> list[ports.Frontier]:
        return self._frontiers[:limit]

    def stream(self, *name: str | int) -> np.random.Generator:
        return Streams(0)("view", *name)


def check_case(cls: type, **params: Any) -> None:
    """Check a ``ports.cases.Case``: its options are described, its setup fits together, something
    becomes of what is sent, and the same seed gives the same measures."""
    check_parameters(cls, params)
    case = cls(cls.Params(**params))
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


def _check_declarations(cls: type, params: dict[str, Any]) -> None:
    reasons = getattr(cls, "reasons", None)
    need(isinstance(reasons, tuple) and all(isinstance(reason, str) for reason in reasons), cls,
         f"declare reasons = ('...',), a tuple of names, not {reasons!r}")
    refuses = getattr(cls, "refuses", ())
    need(isinstance(refuses, tuple) and set(refuses) <= set(reasons), cls,
         f"declare in refuses some of its reasons, not {refuses!r}")
    check_parameters(cls, params)


def check_parameters(cls: type, params: dict[str, Any]) -> None:
    """It says what its options are, and where their defaults come from; ``params`` can be written
    into a scenario with all others and read again."""
    need(isinstance(getattr(cls, "Params", None), type) and issubclass(cls.Params, ports.Params),
         cls, "have a class Params(desim.ports.Params)")
    for name, field in cls.Params.model_fields.items():
        need(field.description or field.is_required(), cls,
             f"say where the default of parameter {name!r} comes from: Field(default, "
             "description=...)")
    written = cls.Params(**params).model_dump_json(by_alias=True)
    try:
        again = cls.Params.model_validate_json(written, strict=True).model_dump_json(by_alias=True)
    except ValidationError as error:
        again = "; ".join(f"{'.'.join(map(str, one['loc']))}: {one['msg']}"
                          for one in error.errors())
    need(again == written, cls, f"read its parameters as it writes them; {written} gave {again}")


def _check_play(cls: type, make: Callable[[], Bench], make_larger: Callable[[], Bench]) -> None:
    bench = make()
    with own_luck(cls):
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
    _check_links(cls, make())
    need(_play(make_larger()) == log, cls, "give the same fates when a host is added that says "
                                           "nothing: draw from streams named by host, not index")


def _check_links(cls: type, bench: Bench) -> None:
    everybody, links = np.arange(len(bench.hosts)), {}

    def look(label: int) -> None:
        links[label] = bench.medium.linked(everybody)

    for _, label, source, receiver, fate in _play(bench, look):
        linked = links[label] is None or links[label][bench.hosts.index(source),
                                                      bench.hosts.index(receiver)]
        need(linked or not fate.startswith("arrived"), cls,
             "deliver nothing beyond reach_m and nothing between hosts that it separates")


def _play(bench: Bench, look: Callable[[int], None] | None = None
          ) -> list[tuple[int, Any, str, str, str]]:
    """A seeded load of unicast and broadcast frames, single packets and trains. ``look`` is called
    with the label of each just before it is sent."""
    draw = random.Random(1)
    hosts = sorted(_HOSTS, key=ports.natural_key)
    for label in range(_FRAMES):
        source = draw.choice(hosts)
        others = [host for host in hosts if host != source]
        broadcast = draw.random() < 0.3
        segments = draw.choice([1, 1, 1, 2, 10, 100])
        time_ns = draw.randrange(2 * NS_PER_S)
        if look is not None:
            bench.kernel.at(time_ns, Phase.WORLD, 0, look, label)
        bench.send(time_ns, source,
                   draw.sample(others, draw.randint(1, len(others))) if broadcast
                   else draw.choice(others), segments * draw.randint(64, 1518), segments, label,
                   broadcast)
    return bench.run(2 * NS_PER_S + HOUR_NS)


@contextmanager
def own_luck(cls: type) -> Iterator[None]:
    """Whatever happens here draws nothing from the global generators."""
    def state() -> Any:
        return random.getstate(), np.random.get_state()[1].tolist()  # noqa: NPY002 - watched only

    before = state()
    yield
    need(state() == before, cls, "draw from context.stream(name) only, not from random or "
                                 "numpy.random")


def need(kept: Any, cls: type, advice: str) -> None:
    """Raises ``AssertionError`` with ``advice`` for the author of ``cls`` unless it is ``kept``."""
    if not kept:
        raise AssertionError(f"{cls.__module__}.{cls.__qualname__} must {advice}")

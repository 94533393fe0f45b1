"""Our own plug-ins keep the contracts, and the kit finds those that do not.

The contracts are as short as promised: a rule in 17 lines, a contention model in 40.
"""

import inspect
import math
import random
from functools import partial
from itertools import count

import pytest
from pydantic import Field, model_validator

from desim import plugins, ports
from desim.errors import InputError, KernelError, ModelError
from desim.robot.coordination.strategies.nearest_frontier import NearestFrontier
from desim.robot.coordination.strategies.random_frontier import RandomFrontier
from desim.testing import (
    Bench,
    Fleet,
    ImmediateNetwork,
    check_middleware,
    check_network,
    check_rule,
    check_strategy,
)
from desim.units import BitRate, airtime_ns

NETWORKS = [("ideal", {}), ("ideal", {"delay": "3 ms"}), ("disk", {}), ("disk", {"range": "50 m"}),
            ("distance", {"delivery": [["10 m", 1], ["60 m", "50 %"], ["200 m", 0.1]]}),
            ("gz_rfcomms", {}), ("gz_rfcomms", {"range": "200 m", "capacity": "1 Mb/s"}),
            ("subt", {}), ("argos_rab", {}),
            ("argos_rab", {"range": "70 m", "size": "100 kB", "drop_probability": "20 %"}),
            ("webots_emitter", {}),
            ("webots_emitter", {"type": "infra-red", "range": "70 m", "baud_rate": "1 Mb/s",
                                "buffer": "100 kB"}), ("link", {}),
            ("link", {"rate": "1 Mb/s", "latency": "20 ms", "queue": "10 kB"}),
            ("switch", {}), ("switch", {"rate": "10 Mb/s", "buffer": "20 kB"}),
            ("switch", {"rate": "10 Mb/s", "queue": "pfifo"}),
            ("switch", {"ports": {"node": ["host_1", "host_10"]}}),
            ("packet_by_packet:PacketByPacket", {}),
            ("bus", {}), ("bus", {"arbitration": "csma"}), ("bus", {"arbitration": "fifo"})]
RULES = [("range", {"distance": "50 m"}), ("latency", {"delay": "5 ms", "jitter": "2 ms"}),
         ("loss", {"probability": "10 %"}), ("bandwidth", {"rate": "1 Mb/s", "backlog": "50 kB"}),
         ("partition", {"groups": [["host_1*"], ["nowhere"]], "from": "1 s", "until": "1.5 s"}),
         ("latency", {"delay": "5 ms", "jitter": "2 ms", "distribution": "gamma"}),
         ("gilbert_elliott", {"p": "5 %", "r": "20 %"}), ("duplication", {"probability": 0.3}),
         ("reordering", {"probability": 0.3, "delay": "5 ms"}),
         ("outage", {"hosts": ["host_1*"], "until": "100 ms", "every": "300 ms"}),
         ("flapping", {"hosts": ["nowhere"], "links": [["host_1", "*"]], "up": "1 s",
                       "down": "100 ms"}),
         ("jamming", {"at": ["0 m", "0 m"], "radius": "5 m", "probability": 0.5})]


@pytest.mark.parametrize(("name", "params"), NETWORKS)
def test_network_models_keep_their_contract(name, params):
    check_network(plugins.load("network", name), **params)


@pytest.mark.parametrize(("name", "params"), RULES)
def test_rules_keep_their_contract(name, params):
    check_rule(plugins.load("rule", name), **params)


def test_direct_middleware_keeps_its_contract():
    check_middleware(plugins.load("middleware", "direct"))


def test_the_kit_checks_the_parameters_of_a_middleware():
    direct = plugins.load("middleware", "direct")
    wrong = type("Wrong", (direct,), {"Params": Unsourced.Params})
    with pytest.raises(AssertionError, match="where the default of parameter 'rate' comes from"):
        check_middleware(wrong)


def test_a_fleet_hears_all_at_once_unless_its_model_says_otherwise():
    direct = plugins.load("middleware", "direct")
    near, silent = (Fleet(direct(direct.Params()), **given)
                    for given in ({}, {"model": Silent()}))
    for fleet in (near, silent):
        fleet.talk(10**9)
    assert near.said and not near.unheard() and not near.faults
    assert silent.said and not silent.times


@pytest.mark.parametrize("cls", [NearestFrontier, RandomFrontier])
def test_strategies_keep_their_contract(cls):
    check_strategy(cls)


class Curfew:
    """A rule: silence in the first part of every second."""

    class Params(ports.Params):
        share: float = Field(0.5, description="of each second (half)")

    reasons = ("curfew",)

    def __init__(self, params):
        self.silent_ns = int(params.share * 10**9)

    def start(self, context, hosts):
        self.context = context

    def judge(self, frame, receivers):
        silent = self.context.now_ns % 10**9 < self.silent_ns
        return [ports.Drop("curfew") if silent else ports.PASS] * len(receivers)


class Aloha:
    """Pure ALOHA (Abramson 1970): who has something to say says it at once; frames that overlap
    in time are lost at everybody, and a sender does not hear while it talks."""

    class Params(ports.Params):
        rate_bps: BitRate = Field("1 Mb/s", description="of the one channel (any)")

    reasons = ("collision",)

    def __init__(self, params):
        self.rate_bps = params.rate_bps
        self.on_air = {}  # frame id to whether it is corrupted

    def start(self, context, hosts):
        self.context = context

    def send(self, frame):
        corrupted = bool(self.on_air)
        for other in self.on_air:
            self.on_air[other] = True
        self.on_air[frame.id] = corrupted
        end_ns = self.context.now_ns + airtime_ns(frame.size_bytes, self.rate_bps)
        self.context.at(end_ns, self.end, frame)

    def end(self, frame):
        fate = ports.Drop("collision") if self.on_air.pop(frame.id) else ports.Deliver(0)
        self.context.settle_many(frame, frame.receivers, fate)


def test_a_rule_is_complete_in_17_lines():
    check_rule(Curfew)
    assert len([line for line in inspect.getsource(Curfew).splitlines() if line]) <= 17


@pytest.mark.parametrize(("params", "says"), [
    ({"share": "0.5"}, "test_conformance.Curfew: share: must be a number, got '0.5'"),
    ({"shar": 0.5}, "test_conformance.Curfew: shar: unknown key (did you mean 'share'?); allowed: "
                    "share")])
def test_parameters_are_read_as_those_of_a_scenario_are(params, says):
    with pytest.raises(InputError) as caught:
        check_rule(Curfew, **params)
    assert str(caught.value) == says


def test_a_class_that_breaks_the_form_of_its_contract_is_refused():
    class Half:
        Params = ports.Params

        def start(self, context):
            """There is nothing to do."""

    with pytest.raises(AssertionError) as caught:
        check_rule(Half)
    assert str(caught.value).endswith(
        "Half must take (params) in __init__, not (), and take (self, context, hosts) in start, "
        "not (self, context), and have a method judge(self, frame, receivers), and declare reasons "
        "= ('...',), a tuple of names, not None")


def test_a_contention_model_is_complete_in_40_lines():
    check_network(Aloha)
    assert len(inspect.getsource(Aloha).splitlines()) <= 40


def aloha_share(load, size_bytes):
    """The share of 20,000 Poisson frames that get through, where 125 B are a unit of time."""
    draw, bench, time_s, frames = random.Random(7), Bench(Aloha(Aloha.Params())), 0.0, 20_000
    for label in range(frames):
        time_s += draw.expovariate(load / 0.001)  # 125 B at 1 Mb/s last 1 ms
        bench.send(round(time_s * 1e9), "host_1", "host_2", size_bytes, label=label)
    return sum(fate == "arrived" for *_, fate in bench.run()) / frames


@pytest.mark.parametrize("load", [0.25, 0.5, 1.0])
def test_aloha_carries_what_abramson_says(load):
    """A frame gets through with probability exp(-2 G): S = G exp(-2 G), at most 1/2e. Standard
    error of the share below 0.0035; tolerance 4 of them."""
    assert abs(aloha_share(load, 125) - math.exp(-2 * load)) < 4 * 0.0035


@pytest.mark.parametrize("load", [0.25, 0.5, 1.0])
def test_the_twin_frames_a_tenth_longer_collide_more(load):
    assert abs(aloha_share(load, 137) - math.exp(-2 * load)) > 4 * 0.0035


class Broken(ImmediateNetwork):
    """Everything right but what a test makes wrong."""

    class Params(ports.Params):
        pass

    def __init__(self, params=None):
        pass


class Forgetful(Broken):
    def send(self, frame):
        if frame.id % 7:
            super().send(frame)


class Twice(Broken):
    def send(self, frame):
        super().send(frame)
        self._context.settle(frame, frame.receivers[0], ports.Deliver(0))


class Returning(Broken):
    """Right: it says when, instead of settling."""

    def send(self, frame):
        return 0


class Both(Broken):
    def send(self, frame):
        super().send(frame)
        return 0


class BothBroadcast(Broken):
    def send(self, frame):
        super().send(frame)
        return 0 if frame.broadcast else None


class FloatingReturn(Broken):
    def send(self, frame):
        return 1e6


class PastReturn(Broken):
    def send(self, frame):
        return -1


class Undeclared(Broken):
    def send(self, frame):
        self._context.settle_many(frame, frame.receivers, ports.Drop("bad luck"))


class Floating(Broken):
    def send(self, frame):
        self._context.settle_many(frame, frame.receivers, ports.Deliver(1e6))


class Past(Broken):
    def send(self, frame):
        self._context.settle_many(frame, frame.receivers, ports.Deliver(-1))


class Stranger(Broken):
    def send(self, frame):
        super().send(frame)
        self._context.settle(frame, frame.source, ports.Deliver(0))


class Gambler(Broken):
    def send(self, frame):
        self._context.settle_many(frame, frame.receivers, ports.Deliver(random.randrange(1000)))


class ByIndex(Broken):
    def send(self, frame):
        draw = self._context.stream("delay", frame.source)
        self._context.settle_many(frame, frame.receivers, ports.Deliver(int(draw.integers(1000))))


class Overreaching(Broken):
    reach_m = 50.0


class Parted(Broken):
    def separates(self, host, other):
        return host == 0


class Silent(ImmediateNetwork):
    reasons = ("silence",)

    def send(self, frame):
        self._context.settle_many(frame, frame.receivers, ports.Drop("silence"))


class Unsourced(Broken):
    class Params(ports.Params):
        rate: int = 3


class Illegible(Broken):
    class Params(ports.Params):
        relays: tuple[str, ...] = Field((), description="hosts (none)")

        @model_validator(mode="before")
        @classmethod
        def _from_preset(cls, values):
            return dict(values)  # which makes the list of a file one of Python's, and no tuple


class Reasonless(Broken):
    reasons = "lost"


@pytest.mark.parametrize(("cls", "error", "says"), [
    (Forgetful, AssertionError, "settle every frame"),
    (Twice, ModelError, "settled already or was never intended"),
    (Stranger, ModelError, r"at receiver \d, which is settled already or was never intended"),
    (Undeclared, ModelError, "does not declare"),
    (Floating, KernelError, "must be an int"),
    (Past, KernelError, "must be an int >= 0"),
    (Both, ModelError, "settled already or was never intended"),
    (BothBroadcast, ModelError, "settled already or was never intended"),
    (FloatingReturn, ModelError, "delivers after 1000000.0; wanted: an int >= 0"),
    (PastReturn, ModelError, "delivers after -1; wanted: an int >= 0"),
    (Gambler, AssertionError, "not from random"),
    (ByIndex, AssertionError, "named by host, not index"),
    (Overreaching, AssertionError, "deliver nothing beyond reach_m"),
    (Parted, AssertionError, "nothing between hosts that it separates"),
    (Unsourced, AssertionError, "where the default of parameter 'rate' comes from"),
    (Illegible, AssertionError, "read its parameters as it writes them.* relays: Input should be"),
    (Reasonless, AssertionError, "a tuple of names"),
])
def test_the_kit_names_what_is_wrong(cls, error, says):
    with pytest.raises(error, match=says):
        check_network(cls)


def test_a_model_may_return_when_a_frame_is_there():
    check_network(Returning)


class Explorer:
    """A strategy that is right but for what a test makes wrong."""

    class Params(ports.Params):
        pass

    def __init__(self, params):
        pass

    def choose(self, view):
        return next(iter(view.frontiers()), None)


class Restless(Explorer):
    def choose(self, view):
        return super().choose(view) or ports.Frontier(0.0, 0.0, 0.0, 1)


class Inventive(Explorer):
    def choose(self, view):
        return ports.Frontier(1.0, 1.0, 1.0, 1) if view.frontiers() else None


class Fickle(Explorer):
    turns = 0

    def choose(self, view):
        Fickle.turns += 1
        return view.frontiers()[Fickle.turns % 2] if view.frontiers() else None


class Secretive(Explorer):
    """Keeps its turns where nobody looks."""

    turn = staticmethod(partial(next, count()))

    def choose(self, view):
        return view.frontiers()[self.turn() % 2] if view.frontiers() else None


@pytest.mark.parametrize(("cls", "says"), [
    (Restless, r"return one of frontiers\(\), a Place or None"),
    (Inventive, r"return one of frontiers\(\), a Place or None"),
    (Fickle, "keep its state in self: Fickle.turns changed, and all robots share it"),
    (Secretive, "choose alike in like situations"),
])
def test_the_kit_names_what_is_wrong_with_a_strategy(cls, says):
    check_strategy(Explorer)
    with pytest.raises(AssertionError, match=says):
        check_strategy(cls)


def test_a_strategy_that_fails_without_a_frontier_or_draws_globally_is_refused():
    class Empty(NearestFrontier):
        def choose(self, view):
            return view.frontiers()[0]

    class Global(NearestFrontier):
        def choose(self, view):
            return random.choice([None])

    with pytest.raises(AssertionError, match="must return None when there is no frontier; choose "
                                             "raised IndexError: list index out of range"):
        check_strategy(Empty)
    with pytest.raises(AssertionError, match="not from random or numpy.random$"):
        check_strategy(Global)


def test_a_rule_that_miscounts_or_turns_back_time_is_refused():
    class Short(Curfew):
        def judge(self, frame, receivers):
            return [ports.PASS] * (len(receivers) - 1)

    class Early(Curfew):
        def judge(self, frame, receivers):
            return [ports.Deliver(-5)] * len(receivers)

    class Vague(Curfew):
        def judge(self, frame, receivers):
            return [None] * len(receivers)

    class Copier(Curfew):
        def judge(self, frame, receivers):
            return [ports.Duplicate(-1)] * len(receivers)

    for cls, says in [(Short, "verdicts for"), (Early, "int >= 0"), (Vague, "no verdict"),
                      (Copier, "makes a copy after -1; wanted: an int >= 0")]:
        with pytest.raises(ModelError, match=says):
            check_rule(cls)


@pytest.mark.parametrize(("kind", "name", "params", "says"), [
    ("network", "switch", {"ports": {"node": ["host_7"]}},
     ".ports.node: no host 'host_7' (did you mean 'host_4'?); hosts are {hosts}"),
    ("network", "switch", {"ports": {"a": ["host_1"], "b": ["host_1"]}},
     ".ports.b: host 'host_1' has a port already"),
    ("rule", "partition", {"groups": [["host_1"], ["host_2", "robot_*"]]},
     ".rules.0.groups.1.1: 'robot_*' names no host; hosts are {hosts}"),
    ("rule", "partition", {"groups": [["host_1"], ["host_?"]]},
     ".rules.0.groups.1.0: host 'host_1' is in more than one group"),
    ("rule", "outage", {"hosts": ["*", "host_5"]},
     ".rules.0.hosts.1: 'host_5' names no host (did you mean 'host_4'?); hosts are {hosts}"),
    ("rule", "flapping", {"links": [["*", "base"]], "up": "1 s", "down": "1 s"},
     ".rules.0.links.0.1: 'base' names no host; hosts are {hosts}"),
    ("rule", "outage", {"links": [["host_1", "host_1"]]},
     ".rules.0.links.0: 'host_1' and 'host_1' name one host only"),
])
def test_unknown_hosts_in_parameters_are_input_errors(kind, name, params, says):
    cls = plugins.load(kind, name)
    plugin = cls(cls.Params(**params))
    with pytest.raises(InputError) as caught:
        Bench(*([plugin] if kind == "network" else [ImmediateNetwork()]),
              rules=[plugin] if kind == "rule" else [])
    assert str(caught.value) == says.format(hosts="host_1, host_2, host_3, host_4")

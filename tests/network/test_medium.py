"""The medium's account: every frame meets one fate at every receiver, and rules stack up."""

import numpy as np
import pytest
import simpy
from hypothesis import given, settings
from hypothesis import strategies as st
from packet_by_packet import PacketByPacket

from desim import plugins, ports
from desim.engine.kernel import Kernel
from desim.engine.streams import Streams
from desim.engine.trace import Names
from desim.errors import ModelError
from desim.network.carrier import Carrier
from desim.network.medium import Medium
from desim.network.scoped_rule import scoped
from desim.testing import Bench, ImmediateNetwork
from netmodels.access_link import AccessLink
from netmodels.disk import Disk
from netmodels.rules.bandwidth import Bandwidth
from netmodels.rules.loss import Loss
from netmodels.rules.timing import Latency
from netmodels.switch import Switch

MS = 10**6


def rule(cls, **params):
    return cls(cls.Params(**params))


def test_the_whole_log_of_three_frames():
    bench = Bench(rule(AccessLink, rate="1 Mb/s", latency="1 ms"), 3)
    bench.send(0, "host_1", "host_2", 125, label="first")
    bench.send(0, "host_1", "host_3", 125, label="second, behind the first")
    bench.send(500_000, "host_2", "host_1", 250, label="the other way")
    assert bench.run() == [
        (2 * MS, "first", "host_1", "host_2", "arrived"),
        (3 * MS, "second, behind the first", "host_1", "host_3", "arrived"),
        (3_500_000, "the other way", "host_2", "host_1", "arrived")]
    assert bench.medium.bytes_on_air == 500
    assert bench.medium.tx_bytes == [250, 250, 0]
    assert list(bench.medium.rx_bytes) == [250, 125, 125]


def test_each_receiver_of_a_broadcast_receives_its_bytes():
    """With a host that is down the frame is delivered one by one, with none all at once."""
    bench = Bench(rule(AccessLink, rate="1 Mb/s"), 4)
    bench.send(0, "host_1", ["host_2", "host_3"], 125, broadcast=True)
    bench.run()
    assert list(bench.medium.rx_bytes) == [0, 125, 125, 0]
    assert bench.medium.tx_bytes == [125, 0, 0, 0]


def test_a_model_that_returns_a_verdict_fails_with_what_to_return():
    class Judges(ImmediateNetwork):
        def send(self, frame):
            return ports.Drop("said")

    bench = Bench(Judges(), 2)
    bench.send(0, "host_1", "host_2", 125)
    with pytest.raises(ModelError, match=r"Judges .* returned Drop\(reason='said', packets=None\)"
                                         r" from send; wanted: a delay in ns, or None and"):
        bench.run()


def test_what_a_full_queue_refuses_was_never_on_the_air():
    """Room for one frame that waits: of three the last one is refused, and of three broadcasts."""
    bench = Bench(rule(AccessLink, rate="1 Mb/s", queue="2000 B"), 3)
    for _ in range(3):
        bench.send(0, "host_1", "host_2", 1000)
        bench.send(0, "host_2", ["host_1", "host_3"], 1000, broadcast=True)
    bench.run()
    medium = bench.medium
    assert medium.dropped == {"queue_full": 1 + 2}
    assert (medium.tx_bytes, medium.bytes_on_air) == ([2000, 2000, 0], 4000)
    assert medium.refused_bytes == 2000


def test_what_a_switch_drops_at_its_exit_was_on_the_wire():
    bench = Bench(rule(Switch, rate="1 Mb/s", buffer="1000 B"), 4)
    for source in "host_1", "host_2", "host_3":
        bench.send(0, source, "host_4", 1000)
    bench.run()
    assert bench.medium.dropped["queue_full"] >= 1
    assert (bench.medium.bytes_on_air, bench.medium.refused_bytes) == (3000, 0)


def test_rules_delays_add_up_and_the_first_drop_wins():
    class Deaf(Latency):
        reasons = ("deaf",)

        def judge(self, frame, receivers):
            asked.append(receivers)
            return [ports.Drop("deaf") if receiver == 1 else ports.PASS for receiver in receivers]

    asked = []
    bench = Bench(ImmediateNetwork(), 3, rules=[
        rule(Latency, delay="2 ms"), rule(Deaf, delay="0 s"),
        rule(Deaf, delay="0 s"), rule(Latency, delay="3 ms")])
    bench.send(0, "host_1", ["host_2", "host_3"], 100, broadcast=True)
    bench.send(0, "host_1", "host_2", 60)
    assert bench.run() == [(0, None, "host_1", "host_2", "deaf"),
                           (0, None, "host_1", "host_2", "deaf"),
                           (5 * MS, None, "host_1", "host_3", "arrived")]
    assert asked == [(1, 2), (2,), (1,)]
    assert bench.medium.dropped == {"deaf": 2}
    assert bench.medium.bytes_on_air == 100, "the second frame never reached the model"


def test_arrivals_of_one_instant_come_in_the_order_of_names():
    def log(hosts):
        bench = Bench(ImmediateNetwork(), dict.fromkeys(hosts, (0.0, 0.0)))
        for host in hosts:
            bench.send(5, host, [other for other in sorted(hosts) if other != host], 100,
                       broadcast=True)
        return bench.run()

    hosts = [f"robot_{i}" for i in range(12)]
    assert log(hosts) == log(hosts[::-1])


@pytest.mark.parametrize("rules", [[], ["1 ms"]])
@pytest.mark.parametrize("broadcast", [False, True])
def test_arrivals_of_one_instant_come_by_source_and_then_by_receiver(rules, broadcast):
    bench = Bench(ImmediateNetwork(), 6, rules=[rule(Latency, delay=delay) for delay in rules])
    hosts = [f"host_{i}" for i in range(1, 7)]
    for source in hosts:
        others = [host for host in hosts if host != source]
        for receivers in [others] if broadcast else others:
            bench.send(5, source, receivers, 100, broadcast=broadcast)
    got = [(source, receiver) for _, _, source, receiver, _ in bench.run()]
    ids = Names()
    assert got == sorted(got, key=lambda pair: (ids.id(pair[0]), ids.id(pair[1])))
    assert len(got) == 30


def test_a_host_that_is_down_receives_nothing():
    bench = Bench(rule(AccessLink, rate="1 Mb/s"), 3)
    bench.send(0, "host_1", "host_2", 125, label="too late")
    bench.send(0, "host_1", "host_3", 125, label="in time")
    bench.medium.flights.up[1] = False
    assert [(label, fate) for _, label, _, _, fate in bench.run()] == [
        ("too late", "host_down"), ("in time", "arrived")]
    assert list(bench.medium.rx_bytes) == [0, 0, 125]


class Recorder(Carrier):
    """A carrier that writes down what it is told."""

    def __init__(self):
        self.log = []

    def arrived(self, token, receiver):
        self.log.append((token, receiver, "arrived"))

    def lost(self, token, receiver, reason):
        self.log.append((token, receiver, reason))


@pytest.mark.parametrize("rules, down, due_ns, notices", [
    ((), None, 5_000_528, []),
    ((rule(Latency, delay="2 ms"),), None, None, [("ack", 1, "arrived")]),
    ((rule(Loss, probability=1.0),), None, None, [("ack", 1, "random_loss")]),
    ((), 1, None, [("ack", 1, "host_down")]),
])
def test_a_posted_packet_needs_no_event_where_its_fate_is_known(rules, down, due_ns, notices):
    bench = Bench(rule(AccessLink, rate="1 Gb/s", latency="5 ms"), 2, rules=rules)
    carrier = Recorder()
    if down is not None:
        bench.medium.flights.up[down] = False
    assert bench.medium.post(0, (1,), 66, carrier, "ack") == due_ns
    settled = bench.medium.delivered + sum(bench.medium.dropped.values())
    assert bench.medium.intended == 1 == settled + bench.medium.in_flight()
    bench.run()
    assert carrier.log == notices
    assert bench.medium.rx_bytes[1] == (0 if notices and notices[0][2] != "arrived" else 66)


def test_a_packet_whose_fate_is_not_known_yet_is_not_posted():
    bench = Bench(rule(Switch, rate="1 Mb/s"), 2)
    carrier = Recorder()
    bench.medium.transmit(0, (1,), 15_180, 10, False, carrier, "train")
    assert bench.medium.post(0, (1,), 1518, carrier, "beside it") is None
    bench.run()
    assert carrier.log == [("train", 1, "arrived"), ("beside it", 1, "arrived")]


class NewestOnly:
    """One frame waits at each host for 1 ms; a newer one takes its place."""

    Params = ports.Params
    reasons = ("overtaken",)

    def start(self, context, hosts):
        self._context, self._waiting = context, {}

    def send(self, frame):
        older = self._waiting.get(frame.source)
        self._waiting[frame.source] = frame
        if older is not None:
            self._context.settle(older, older.receivers[0], ports.Drop("overtaken"))
        self._context.at(self._context.now_ns + MS, self._leave, frame)

    def _leave(self, frame):
        if self._waiting.get(frame.source) is frame:
            del self._waiting[frame.source]
            self._context.settle(frame, frame.receivers[0], ports.Deliver(0))


class Stubborn(Recorder):
    """Sends what is lost once more, at once."""

    def __init__(self, medium):
        super().__init__()
        self._medium = medium

    def lost(self, token, receiver, reason):
        super().lost(token, receiver, reason)
        if len(self.log) < 4:
            self._medium.transmit(0, (receiver,), 100, 1, False, self, token + " again")


def test_a_frame_that_is_sent_while_another_one_is_being_sent():
    """The second frame drops the first, whose carrier sends a third before the model has answered
    for the second; that one drops the second, and so on."""
    bench = Bench(NewestOnly(), 2)
    carrier = Stubborn(bench.medium)
    for token in "first", "second":
        bench.medium.transmit(0, (1,), 100, 1, False, carrier, token)
    assert bench.medium.in_flight() == 1
    bench.run()
    assert carrier.log == [("first", 1, "overtaken"), ("second", 1, "overtaken"),
                           ("first again", 1, "overtaken"), ("second again", 1, "overtaken"),
                           ("first again again", 1, "arrived")]
    assert (bench.medium.intended, bench.medium.delivered, bench.medium.in_flight()) == (5, 1, 0)


class Hasty(NewestOnly):
    """The same, but what is sent to host_3 is there at once."""

    def send(self, frame):
        if frame.receivers == (2,):
            return 0
        super().send(frame)
        return 5 if frame.size_bytes == 66 else None


class Detour(Recorder):
    """Sends what is lost to host_3 instead."""

    def __init__(self, medium):
        super().__init__()
        self._medium = medium

    def lost(self, token, receiver, reason):
        self._medium.transmit(0, (2,), 100, 1, False, self, token)


def test_what_is_sent_because_of_a_post_is_not_posted():
    """The acknowledgement takes the place of a frame, whose carrier sends that to somebody else."""
    bench = Bench(Hasty(), 3)
    carrier = Detour(bench.medium)
    bench.medium.transmit(0, (1,), 100, 1, False, carrier, "data")
    assert bench.medium.post(0, (1,), 66, carrier, "ack") == 5
    assert bench.medium.in_flight() == 1
    bench.kernel.run(1000)
    assert carrier.log == [("data", 2, "arrived")]


@pytest.mark.parametrize("delay_ns", [-5, 1.5, np.int64(5), True])
def test_what_is_posted_takes_an_int_of_nanoseconds(delay_ns):
    model = ImmediateNetwork()
    model.send = lambda frame: delay_ns
    bench = Bench(model, 2)
    with pytest.raises(ModelError, match="delivers after .*; wanted: an int >= 0 of nanoseconds"):
        bench.medium.post(0, (1,), 66, Recorder(), "ack")


class Careless:
    """Another model that loses every third packet of a train on the way, at each receiver."""

    Params = ports.Params

    def __init__(self, model):
        self._model = model
        self.reasons = (*model.reasons, "careless")

    def start(self, context, hosts):
        self._context = context
        self._model.start(context, hosts)

    def send(self, frame):
        lost = tuple(range(2, frame.segments, 3))
        if lost:
            self._context.settle_many(frame, frame.receivers, ports.Drop("careless", lost))
        return self._model.send(frame)


frames = st.lists(st.tuples(
    st.integers(0, 50 * MS), st.integers(1, 4), st.sets(st.integers(1, 4), min_size=1),
    st.integers(64, 1518), st.sampled_from([1, 1, 2, 40]), st.booleans()), max_size=40)
models = st.sampled_from([
    lambda: rule(Disk, range="70 m", rate="10 Mb/s"),
    lambda: rule(AccessLink, rate="10 Mb/s", queue="20 kB"),
    lambda: rule(Switch, rate="10 Mb/s", buffer="20 kB", ports={"node": ["host_1", "host_2"]}),
    lambda: rule(PacketByPacket, rate="10 Mb/s", buffer="20 kB")])


@settings(max_examples=60, deadline=None)
@given(models, frames, st.integers(0, 100 * MS), st.integers(0, 3),
       st.sampled_from([None, "10 ms", "60 ms"]))
def test_frames_are_conserved_at_every_instant(model, traffic, stop_ns, down, until):
    slow = plugins.parameters("rule", "bandwidth")(rate="20 Mb/s", backlog="30 kB", until=until)
    bench = Bench(Careless(model()), {f"host_{i}": (30.0 * i, 0.0) for i in range(1, 5)},
                  rules=[rule(Loss, probability="20 %"), scoped(Bandwidth(slow), slow)])
    medium, intended, packets = bench.medium, 0, {}
    for number, (time_ns, source, receivers, size_bytes, segments, broadcast) in enumerate(traffic):
        to = sorted(f"host_{i}" for i in receivers - {source})
        if to:
            to = to if broadcast else to[0]
            intended += len(to) if broadcast else 1
            packets[number] = segments
            bench.send(time_ns, f"host_{source}", to, size_bytes * segments, segments, number,
                       broadcast=broadcast)
    bench.run(stop_ns)
    assert medium.intended == medium.delivered + sum(medium.dropped.values()) + medium.in_flight()
    assert len(bench.log) == medium.delivered + sum(medium.dropped.values())
    medium.flights.up[down] = False
    bench.run(3600 * 10**9)
    assert medium.in_flight() == 0
    assert medium.intended == intended == len(bench.log)
    assert sum(medium.rx_bytes) >= 64 * medium.packets_delivered
    missing = {(label, receiver): len(lost) for label, receiver, lost in bench.parts}
    arrived = sum(packets[label] - missing.get((label, receiver), 0)
                  for _, label, _, receiver, fate in bench.log if fate.startswith("arrived"))
    assert medium.packets_delivered == arrived
    assert medium.packets_intended == arrived + sum(medium.packets_dropped.values()) == sum(
        packets[label] for _, label, _, _, _ in bench.log)


class Named:
    """Settles a broadcast at the hosts that it is told, and then at all others."""

    Params = ports.Params
    reasons = ("near", "far")

    def __init__(self, *named):
        self.named = named

    def start(self, context, hosts):
        self.context = context

    def send(self, frame):
        for receivers, verdict in self.named:
            self.context.settle_many(frame, receivers, verdict)
        self.context.settle_many(frame, None, ports.Drop("far"))


def test_whom_nobody_names_is_counted_and_not_looked_for():
    class Counting(Bench):
        def missed(self, token, receivers, reason, medium):
            counted.append((reason, len(receivers)))

    counted = []
    bench = Counting(Named(([4, 2], ports.Deliver(5)), ([7], ports.Drop("near"))), 1000)
    bench.send(0, "host_1", bench.hosts[1:], 100, broadcast=True)
    assert {receiver for *_, receiver, _ in bench.run()} == {"host_3", "host_5"}
    assert counted == [("near", 1), ("far", 996)]
    assert bench.medium.dropped == {"near": 1, "far": 996}
    assert bench.medium.intended == 999 and bench.medium.in_flight() == 0


def test_the_rest_are_those_whom_nobody_named():
    bench = Bench(Named(([1], ports.Deliver(0)), ([4], ports.Drop("near"))), 5)
    bench.send(0, "host_1", ["host_2", "host_4", "host_5"], 100, broadcast=True)
    assert sorted((receiver, fate) for *_, receiver, fate in bench.run()) == [
        ("host_2", "arrived"), ("host_4", "far"), ("host_5", "near")]


@pytest.mark.parametrize("named", [
    [([1], ports.Drop("near")), ([1], ports.Drop("near"))], [([2, 2], ports.Deliver(0))],
    [([0], ports.Deliver(0))], [([3], ports.Drop("near"))], [(None, ports.Drop("far")), ([1],
     ports.Deliver(0))]], ids=["twice", "twice at once", "sender", "not meant", "after the rest"])
def test_a_broadcast_is_settled_once_where_it_was_meant_for(named):
    bench = Bench(Named(*named), 5)
    bench.send(0, "host_1", ["host_2", "host_3", "host_5"], 100, broadcast=True)
    with pytest.raises(ModelError, match="settled already or was never intended"):
        bench.run()


@given(st.one_of(st.sets(st.integers(0, 12), min_size=2), st.just(set(range(12)))),
       st.integers(0, 13), st.lists(st.integers(-1, 14)))
def test_who_is_among_the_receivers(receivers, source, hosts):
    receivers = receivers - {source}
    frame = ports.Frame(1, source, tuple(sorted(receivers)), 100, 1, True)
    assert frame.among(hosts) == [host for host in hosts if host in receivers]


def test_it_serves_a_plain_simpy_program():
    env = simpy.Environment(initial_time=0)
    names, log = Names(), []

    class Sender(Carrier):
        def arrived(self, token, receiver):
            log.append((env.now, token, receiver))

    medium = Medium("lan", rule(AccessLink, rate="1 Mb/s"), kernel=Kernel.inside(env), names=names,
                    streams=Streams(0), hosts=["a", "b"])

    def life():
        for word in ("hello", "again"):
            yield env.timeout(10 * MS)
            medium.transmit(0, (1,), 125, 1, False, Sender(), word)

    env.process(life())
    env.run()
    assert log == [(11 * MS, "hello", 1), (21 * MS, "again", 1)]


def test_a_nowhere_medium_has_no_obstacles():
    context = Bench(ImmediateNetwork(), 2).medium
    assert context.obstacles.epoch == 0
    assert context.obstacles.crossings(context.positions(0).repeat(2, axis=1)).shape == (0, 2)


def test_a_rule_cannot_act():
    latency = rule(Latency, delay="1 s")
    Bench(ImmediateNetwork(), 2, rules=[latency])
    for action in ("at", "settle", "settle_many", "transmit"):
        with pytest.raises(AttributeError):
            getattr(latency._context, action)


def test_frames_that_carriers_expected_are_entered_for_each_receiver():
    """Three trains of two packets for one host, one for another."""
    medium = Bench(ImmediateNetwork(), 3).medium
    medium.flights.count = 4
    medium.flights.landed_each([1, 2], 100, 2, [3, 1])
    assert (medium.delivered, medium.packets_delivered, medium.in_flight()) == (4, 8, 0)
    assert medium.rx_bytes.tolist() == [0, 300, 100]


def test_a_rule_may_deliver_without_a_delay():
    bench = Bench(ImmediateNetwork(), 2, rules=[rule(Latency, delay="0 ns")])
    bench.send(5, "host_1", "host_2", 100)
    assert [(time_ns, fate) for time_ns, *_, fate in bench.run()] == [(5, "arrived")]

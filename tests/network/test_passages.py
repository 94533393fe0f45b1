"""The parts of single frames' time, compared with what they have to be."""

import random

import pytest
from packet_by_packet import PacketByPacket
from pydantic import Field

from desim import ports
from desim.errors import ModelError
from desim.network import passages
from desim.network.carrier import Carrier
from desim.network.passages import Passages
from desim.network.taps import tap
from desim.ports import TimePart
from desim.testing import Bench, ImmediateNetwork, check_network
from netmodels.ideal import Ideal
from netmodels.multihop import Multihop
from netmodels.radio.radio import Radio
from netmodels.radio.standards import STANDARDS, chosen_rates, psdu_bytes
from netmodels.rules.timing import Latency
from netmodels.switch import Switch

FULL, PACKET_NS, GAP_NS, CABLE_NS = 1518, 8 * 1538, 8 * 12, 500  # on 1 Gb/s
AIR_NS = PACKET_NS - GAP_NS


def bench(model, *frames, rules=(), hosts=4):
    """A bench with a ledger, on which the frames (time_ns, source, receivers, ...) are played."""
    one = Bench(model, hosts, rules=rules, passages=Passages())
    for label, frame in enumerate(frames):
        one.send(*frame[:5], label, *frame[5:])
    one.run()
    return one


def parts(one):
    """By label and receiver: part, host, ns."""
    return {(label, receiver): [(stamp.part, one.hosts[stamp.host], stamp.time_ns)
                                for stamp in stamps]
            for label, _, receiver, _, stamps in one.spent}


def switch(model=Switch, **params):
    return model(Switch.Params(**params))


def test_one_frame_through_a_switch():
    one = bench(switch(), (0, "host_1", "host_2", FULL, 1))
    assert parts(one)[0, "host_2"] == [
        (TimePart.AIRTIME, "host_1", AIR_NS), (TimePart.PROPAGATION, "host_1", CABLE_NS),
        (TimePart.AIRTIME, "host_2", AIR_NS), (TimePart.PROPAGATION, "host_2", CABLE_NS)]
    assert one.log[0][0] == 2 * (AIR_NS + CABLE_NS)


@pytest.mark.parametrize("model", [Switch, PacketByPacket])
def test_the_second_frame_at_an_exit_waits_for_the_first_ones_serialization(model):
    one = bench(switch(model), (0, "host_1", "host_3", FULL, 1),
                (0, "host_2", "host_3", FULL, 1))
    first, second = parts(one)[0, "host_3"], parts(one)[1, "host_3"]
    assert [part for part, *_ in first].count(TimePart.QUEUE) == 0
    assert [(host, time_ns) for part, host, time_ns in second
            if part == TimePart.QUEUE] == [("host_3", PACKET_NS)]


def test_the_second_frame_of_a_host_waits_at_its_interface():
    one = bench(switch(), (0, "host_1", "host_2", FULL, 1), (0, "host_1", "host_3", FULL, 1))
    assert parts(one)[1, "host_3"][0] == (TimePart.QUEUE, "host_1", PACKET_NS)


@pytest.mark.parametrize("model", [Switch, PacketByPacket])
def test_the_last_packet_of_a_train_stands_for_it(model):
    one = bench(switch(model), (0, "host_1", "host_2", 9 * FULL + 64, 10))
    last_ns = 8 * (64 + 20)
    assert parts(one)[0, "host_2"] == [
        (TimePart.AIRTIME, "host_1", 9 * PACKET_NS + last_ns - GAP_NS),
        (TimePart.PROPAGATION, "host_1", CABLE_NS),
        # The exit still sends the packet before, which is longer.
        (TimePart.AIRTIME, "host_2", AIR_NS), (TimePart.PROPAGATION, "host_2", CABLE_NS)]


def test_hosts_of_one_port_and_a_broadcast():
    model = switch(ports={"node": ["host_1", "host_2"]}, local_latency="3 us")
    one = bench(model, (0, "host_1", ["host_2", "host_3", "host_4"], FULL, 1, True))
    assert parts(one)[0, "host_2"] == [(TimePart.PROPAGATION, "host_1", 3000)]
    for host in "host_3", "host_4":
        assert [place for *_, place, _ in parts(one)[0, host]] == ["host_1", "host_1", host, host]


@pytest.mark.parametrize("queue", ["pfifo", "fq_codel"])
@pytest.mark.parametrize("buffer", ["4 MB", "6 kB"])
def test_whole_frames_have_the_parts_of_the_reference_packet_by_packet(queue, buffer):
    draw, frames = random.Random(5), []
    for _ in range(400):
        source, receiver = draw.sample(["host_1", "host_2", "host_3", "host_4"], 2)
        segments = draw.choice([1, 1, 3, 12])
        frames.append((draw.randrange(3_000_000), source, receiver,
                       segments * draw.randint(64, FULL), segments))
    params = {"queue": queue, "buffer": buffer, "rate": "100 Mb/s"}
    quick = switch(**params)
    quick._ahead_ns = -1  # the shortcut ahead of time has times of its own
    slow = bench(switch(PacketByPacket, **params), *frames)
    assert slow.medium.packets_dropped or buffer == "4 MB"
    assert parts(bench(quick, *frames)) == parts(slow)


def test_rules_and_models_that_say_nothing():
    model = Ideal(Ideal.Params(delay="2 ms"))
    rule = Latency(Latency.Params(delay="1 ms"))
    one = bench(model, (0, "host_1", "host_2", 100, 1), rules=[rule])
    assert parts(one)[0, "host_2"] == [(TimePart.PROPAGATION, "host_1", 2_000_000),
                                       (TimePart.RULES, "host_1", 1_000_000)]
    one = bench(Silent(), (0, "host_1", ["host_2", "host_3"], 100, 1, True), rules=[rule])
    for host in "host_2", "host_3":
        assert parts(one)[0, host] == [(TimePart.MEDIUM, "host_1", 7),
                                       (TimePart.RULES, "host_1", 1_000_000)]


class Silent(ImmediateNetwork):
    """A model of somebody who tells no parts."""

    def send(self, frame):
        return 7


class Telling(ImmediateNetwork):
    """A model that tells its parts; ``wrong_ns`` too much."""

    class Params(ports.Params):
        wrong_ns: int = Field(0, description="(none)")

    def __init__(self, params):
        self._wrong_ns, self._ledger = params.wrong_ns, None

    def itemize(self, ledger):
        self._ledger = ledger

    def send(self, frame):
        if self._ledger is not None:
            self._ledger.spent(frame, TimePart.QUEUE, 10)
            for receiver in frame.receivers:
                self._ledger.spent(frame, TimePart.AIRTIME, 20 + self._wrong_ns, receiver)
        return 30


class Shy(Telling):
    """A model that does something else where it is looked at."""

    def send(self, frame):
        super().send(frame)
        return 30 if self._ledger is None else 31


def test_the_kit_checks_the_parts_of_a_model():
    check_network(Telling)
    with pytest.raises(AssertionError, match=r"tell parts that sum up \(itemize\): frame \d+ from "
                                             r"\w+ to \w+ took 30 ns, its parts are queue 10, "
                                             r"airtime 21: 31 ns"):
        check_network(Telling, wrong=1)
    with pytest.raises(AssertionError, match=r"do the same with a ledger as without one"):
        check_network(Shy)


def test_what_is_settled_is_forgotten():
    one = bench(Silent(), *((k, "host_1", "host_2", 100, 1) for k in range(5000)))
    assert len(one.medium._ledger.open) < 3000


def test_a_wrong_delay_is_still_an_error():
    class Backwards(ImmediateNetwork):
        def send(self, frame):
            return -1

    with pytest.raises(ModelError, match="delivers after -1"):
        bench(Backwards(), (0, "host_1", "host_2", 100, 1))


class FirstIsLost:
    """A rule that takes the first transmission."""

    Params = ports.Params
    reasons = ("spilt",)
    per_transmission = True

    def __init__(self):
        self._left = 1

    def start(self, context, hosts):
        pass

    def judge(self, frame, receivers):
        self._left -= 1
        return [ports.Drop("spilt")] if self._left == 0 else None


def radio_bench(*frames, rules=()):
    one = Bench(Radio.build(Radio.Params()), {"a": (0, 0), "b": (5, 0), "c": (0, 5)}, rules=rules,
                passages=Passages())
    for label, frame in enumerate(frames):
        one.send(*frame[:5], label, *frame[5:])
    one.run()
    return one


def test_a_lost_packet_of_a_radio_is_a_retransmission():
    standard = STANDARDS["11g"]
    rate, _ = chosen_rates(standard, "11g", 54_000_000, None)
    air_ns = standard.airtime_ns(psdu_bytes(FULL, 1), rate)
    lone = parts(radio_bench((0, "a", "b", FULL, 1)))[0, "b"]
    assert lone == [(TimePart.AIRTIME, "a", air_ns)]
    one = radio_bench((0, "a", "b", FULL, 1), rules=[FirstIsLost()])
    (again, *_, again_ns), sent = parts(one)[0, "b"]
    assert again == TimePart.RETRANSMISSION and sent == (TimePart.AIRTIME, "a", air_ns)
    # The lost one, the wait for its acknowledgement, DIFS and whole slots of backoff.
    timeout_ns = standard.sifs_ns + standard.slot_ns + standard.rates[
        standard.reply_rate(rate)].payload_ns
    slots, rest_ns = divmod(again_ns - air_ns - timeout_ns - standard.difs_ns, standard.slot_ns)
    assert 0 <= slots <= 2 * standard.cw_min + 1 and rest_ns == 0
    assert one.log[0][0] == again_ns + air_ns


def test_a_radio_waits_for_the_others_and_for_its_own():
    one = radio_bench((0, "a", "b", FULL, 1), (50_000, "c", "b", FULL, 1),
                      (60_000, "c", "b", FULL, 1))
    (wait, host, wait_ns), _ = parts(one)[1, "b"]
    assert (wait, host) == (TimePart.CONTENTION, "c") and wait_ns > one.log[0][0] - 50_000
    assert [part for part, *_ in parts(one)[2, "b"]] == [
        TimePart.QUEUE, TimePart.CONTENTION, TimePart.AIRTIME]


def test_several_hops_have_their_parts_each():
    model = Multihop(Multihop.Params(hop="disk", disk={"range": "50 m", "rate": "1 Mb/s"},
                                     routing="static"))
    one = Bench(model, {"a": (0, 0), "b": (40, 0), "c": (80, 0)}, passages=Passages())
    one.send(0, "b", "c", 1000, 1, "before")
    one.send(0, "a", "c", 1000, 1, "through")
    one.send(0, "b", "c", 1000, 1, "behind")
    one.run()
    assert parts(one)["through", "c"] == [
        (TimePart.AIRTIME, "a", 8_000_000), (TimePart.QUEUE, "b", 8_000_000),
        (TimePart.AIRTIME, "b", 8_000_000)]


class Later(Telling):
    """A model that settles after 30 ns, and enters the parts then."""

    def start(self, context, hosts):
        self._context = context

    def send(self, frame):
        self._context.at(self._context.now_ns + 30, self._settle, frame)

    def _settle(self, frame):
        self._ledger.spent(frame, TimePart.QUEUE, 30)
        self._context.settle(frame, frame.receivers[0], ports.Deliver(0))


def posted(model):
    """A bench with a ledger on which 5000 frames were posted at once, as acknowledgements are."""
    one = Bench(model, 2, passages=Passages())
    for label in range(5000):
        one.medium.post(0, (1,), 100, one, (label, "host_1"))
    return one


def test_the_ledger_forgets_frames_that_are_counted_as_delivered():
    assert len(posted(Ideal(Ideal.Params())).medium._ledger.open) <= 1024


def test_the_ledger_keeps_frames_until_the_model_has_settled_them():
    one = posted(Later(Later.Params()))
    one.run()
    assert parts(one) == {(label, "host_2"): [(TimePart.QUEUE, "host_1", 30)]
                          for label in range(5000)}


def test_of_relayed_messages_the_last_ones_are_remembered(monkeypatch):
    monkeypatch.setattr(passages, "RELAYED", 2)
    known = Passages()
    known.relay("unseen", 1, 5)
    known.arriving = known.begin(0, 0, 1, Carrier(), None, 3)
    for number in range(3):
        known.relay(number, 1, 10 + number)
    assert {key: time_ns for key, (_, time_ns) in known.relays.items()} == {(1, 1): 11, (2, 1): 12}


@pytest.mark.parametrize("ledger", [None, Passages()])
def test_a_ledger_hides_no_protocol_and_no_connection(ledger):
    one, seen = Bench(Ideal(Ideal.Params()), passages=ledger), []
    one.protocol = "tcp"
    tap(one.medium, lambda frame, carrier, token: seen.append(
        (carrier.protocol, carrier.conversation, carrier.socket)))
    one.send(0, "host_1", "host_2", 100)
    one.run()
    assert seen == [("tcp", one, one)]

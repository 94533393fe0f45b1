"""The energy of robots, against what can be computed by hand.

Twins have a model that is wrong, and are caught.
"""

import re
from dataclasses import dataclass, field
from fractions import Fraction

import numpy as np
import pytest
from graphs import MS, Net, S, talker
from hypothesis import given
from hypothesis import strategies as st

from desim.engine.streams import Streams
from desim.errors import ModelError
from desim.monitor.meters.energy_use import EnergyUse
from desim.monitor.meters.meter import Second
from desim.scenario.schema.environment import Environment, Shape
from desim.scenario.schema.fleet import BodyType
from desim.scenario.schema.power import PowerParams
from desim.testing import Bench
from desim.world.fleet import RobotSpec
from desim.world.plane import Plane
from netmodels.disk import Disk
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.standards import ACK_BYTES, G, psdu_bytes

PIONEER = PowerParams()
DRIVE, COMPUTE, RADIO = 0, 2, 3
A_MAP = object()  # of software that runs


@dataclass
class Robot:
    """A host without a network."""

    name: str = "robot_0"
    index: int = 0
    media: list = field(default_factory=list)
    computer: None = None


def metering(hosts, power, travelled_m=0.0):
    """The energy of ``hosts``, which are all switched on now, at the start."""
    meter = EnergyUse(hosts, [power] * len(hosts), lambda: np.full(len(hosts), travelled_m))
    for host in hosts:
        meter.watch(host.name, A_MAP, 0)
    return meter


def used(hosts, power, now_ns, travelled_m=0.0):
    """The energy that each of ``hosts`` has used, all switched on at the start."""
    return metering(hosts, power, travelled_m).joules(now_ns)


# ------------------------------------------------------------------------------------- driving


def test_ten_seconds_straight_ahead():
    """12 m at 1.2 m/s take 10 s, in which base and motors draw 4.6 W + 10.6 W."""
    (joules,) = used([Robot()], PIONEER, 10 * S, 12.0)
    assert joules.tolist() == pytest.approx([152.0, 220.0, 80.0, 8.2], abs=1e-12)


def driven(power_w, seconds=5):
    """The way of a body that speeds up, turns and brakes; and the integral of ``power_w`` of its
    speed, tick by tick."""
    plane = Plane(Environment(terrain=Shape(size=("40 m", "40 m"))),
                  [RobotSpec("robot_0", BodyType(), -10.0, 0.0, 0.0)], Fraction(60), Streams(1))
    integral_j, then_m, then_ns = 0.0, 0.0, 0
    for tick in range(1, 60 * seconds + 1):
        now_ns = tick * S // 60
        plane.command(0, *((1.2, 0.0, 0.5) if tick < 150 else (0.3, 0.0, 0.0)))
        plane.advance(now_ns)
        dt_s, way_m = (now_ns - then_ns) / S, float(plane.travelled_m()[0])
        integral_j += power_w((way_m - then_m) / dt_s) * dt_s
        then_ns, then_m = now_ns, way_m
    return then_m, integral_j


def line_w(speed_mps):
    return 7.4 + 6.5 * speed_mps


def test_the_way_gives_the_integral_of_a_line_over_speed():
    way_m, integral_j = driven(line_w)
    assert way_m > 3.0
    assert used([Robot()], PIONEER, 5 * S, way_m)[0, DRIVE] == pytest.approx(integral_j, rel=1e-9)


def test_the_twin_that_grows_with_the_square_of_speed_is_caught():
    way_m, integral_j = driven(lambda speed_mps: 7.4 + 6.5 * speed_mps ** 2 / 1.2)
    assert used([Robot()], PIONEER, 5 * S, way_m)[0, DRIVE] > 1.05 * integral_j


# ----------------------------------------------------------------------------------- computing


class Costs:
    """A callback takes 30 ms, messages nothing."""

    def callback_ns(self, work):
        return 30 * MS

    def send_ns(self, topic, size_bytes, links):
        return 0

    def receive_ns(self, topic, size_bytes):
        return 0


def ticking(processor_w, processors=1):
    """The computer's energy in 2 s, of two nodes with a timer of 10 Hz each."""
    def begin(node):
        node.timer(10, lambda k: None, "zero", name="beat")

    net = Net({"robot_0": {"one": begin, "other": begin}}, costs=Costs(), processors=processors)
    net.run(2 * S - 1)
    power = PowerParams(computer={"idle": "8 W", "processor": f"{processor_w} W"})
    return used(net.graph.hosts, power, 2 * S)[0, COMPUTE]


def test_busy_processors():
    """20 callbacks of 30 ms on each of two nodes are 1.2 s of processor time, on one or on two."""
    assert ticking(3.5) == ticking(3.5, processors=2) == pytest.approx(8 * 2 + 3.5 * 1.2, rel=1e-12)


def test_the_twin_that_charges_the_computer_and_not_its_processors_is_caught():
    """Both nodes tick at once: one of two processors is busy for 0.6 s."""
    whole_computer_j = 8 * 2 + 3.5 * 0.6
    assert ticking(3.5, processors=2) > 1.1 * whole_computer_j


# ------------------------------------------------------------------------------------- sending


def test_bytes_take_their_time_where_no_airtime_is_counted():
    """10 messages of 1000 B, with the headers that the account has, at 1 Mb/s."""
    net = Net({"robot_0": talker([(k * 100 * MS, "hear!") for k in range(10)], size_bytes=1000),
               "robot_1": lambda node: node.subscribe("/talk", lambda message: None)},
              Disk(Disk.Params(range="100 m")))
    power = PowerParams(radio={"idle": "1 W", "receive": "2 W", "send": "4 W", "rate": "1 Mb/s"})
    meter = metering(net.graph.hosts, power)
    net.run(2 * S)
    sender, receiver = net.graph.hosts
    assert sender.tx_bytes > 10 * 1000 and receiver.rx_bytes == sender.tx_bytes
    for host, joules in zip(net.graph.hosts, meter.joules(2 * S), strict=True):
        assert joules[RADIO] == pytest.approx(
            1 * 2 + 3 * host.tx_bytes * 8e-6 + 1 * host.rx_bytes * 8e-6, rel=1e-12)


PACKETS = 50


def over_the_air(until_ns=S, dies_ns=None):
    """The radios' energy, above idle, of a sender, its receiver and one who overhears them: 50
    packets of 1000 B far apart, where receiving draws 1 W more and sending 3 W. The software of the
    third one runs until ``dies_ns`` (None: to the end)."""
    bench = Bench(DcfRadio(DcfRadio.Params()), {f"host_{i}": (3.0 * i, 0.0) for i in (1, 2, 3)})
    for k in range(PACKETS):
        bench.send(k * 10 * MS, "host_1", "host_2", 1000)
    power = PowerParams(radio={"idle": "0 W", "receive": "1 W", "send": "3 W"})
    meter = metering([Robot(name, i, [bench.medium]) for i, name in enumerate(bench.hosts)], power)
    if dies_ns is not None:
        bench.run(dies_ns)
        meter.watch("host_3", None, dies_ns)
    bench.run(until_ns)
    return meter.joules(until_ns)[:, RADIO]


def standard_s(ack_bytes=ACK_BYTES):
    """Airtimes of data and acknowledgements, of a packet each; others notice them after 4 us."""
    rate = G.rate(54)
    return (G.airtime_ns(psdu_bytes(1000, 1), rate) / S,
            G.airtime_ns(ack_bytes, G.reply_rate(rate)) / S, 4e-6)


def test_known_airtimes():
    data_s, ack_s, unnoticed_s = standard_s()
    assert over_the_air().tolist() == pytest.approx([
        PACKETS * (3 * data_s + ack_s - unnoticed_s),
        PACKETS * (3 * ack_s + data_s - unnoticed_s),
        PACKETS * (data_s + ack_s - 2 * unnoticed_s)], rel=1e-9)


def test_a_frame_that_is_under_way_counts_as_far_as_it_has_come():
    """The first one begins at once, as the medium is idle."""
    assert over_the_air(100_000).tolist() == pytest.approx([3 * 100e-6, 96e-6, 96e-6], rel=1e-9)


def test_the_twins_without_acknowledgements_and_by_bytes_alone_are_caught():
    data_s, ack_s, _ = standard_s()
    sender_j, receiver_j, _ = over_the_air()
    assert receiver_j > 1.2 * PACKETS * data_s
    by_bytes_s = 1000 * 8 / 54e6
    assert sender_j > 1.2 * PACKETS * 3 * by_bytes_s


def test_airtimes_that_are_none():
    bench = Bench(DcfRadio(DcfRadio.Params()), 1)
    bench.medium.model.airtime_ns = lambda hosts: [(0.5, 0)]
    with pytest.raises(ModelError, match=re.escape(
            ") has the airtimes [[0.5, 0.0]]; wanted: a pair of whole nanoseconds for each "
            "host")):
        used([Robot(media=[bench.medium])], PIONEER, S)


# ------------------------------------------------------------------------------------ whole robots


def test_what_is_switched_off_draws_nothing():
    meter = EnergyUse([Robot()], [PIONEER], lambda: np.zeros(1))
    for robot_map, now_s in ((A_MAP, 1), (None, 4), (A_MAP, 10)):
        meter.watch("robot_0", robot_map, now_s * S)
    assert meter.joules(12 * S).sum() == pytest.approx((3 + 2) * (7.4 + 22 + 8 + 0.82))
    meter.watch("robot_0", None, 12 * S)
    assert meter.joules(99 * S).sum() == meter.joules(12 * S).sum()


def test_what_a_radio_hears_while_it_is_switched_off_costs_nothing():
    """The sender's 25th packet is sent at 0.24 s, the next one at 0.25 s."""
    assert over_the_air(dies_ns=S // 4 - MS)[2] == pytest.approx(over_the_air()[2] / 2, rel=1e-9)


def test_the_twin_that_goes_on_hearing_is_caught(monkeypatch):
    alive = EnergyUse.watch
    monkeypatch.setattr(EnergyUse, "watch", lambda meter, robot, robot_map, now_ns:
                        alive(meter, robot, A_MAP, now_ns))
    assert over_the_air(dies_ns=S // 4 - MS)[2] == over_the_air()[2]


@given(st.lists(st.integers(0, 10**12), min_size=1, max_size=8))
def test_energy_does_not_depend_on_when_it_was_looked_at(times_ns):
    meter, other = (EnergyUse([Robot()], [PIONEER], lambda: np.ones(1)) for _ in range(2))
    for one in (meter, other):
        one.watch("robot_0", A_MAP, 0)
    seen = [meter.joules(time_ns).sum() for time_ns in sorted(times_ns)]
    assert seen == sorted(seen)
    assert (meter.joules(10**13) == other.joules(10**13)).all()


def test_a_fleet_of_which_some_are_measured():
    robots = [Robot("robot_0"), Robot("robot_1", 1)]
    meter = EnergyUse(robots, [None, PIONEER], lambda: np.array([5.0, 2.0]))
    for robot in robots:
        meter.watch(robot.name, A_MAP, 0)
    first, second = meter.by_host(10 * S).values()
    assert set(first.values()) == {None}
    assert second["energy_j"] == pytest.approx(10 * (7.4 + 22 + 8 + 0.82) + 13)
    assert second["battery_life_s"] == pytest.approx(260 * 3600 / (second["energy_j"] / 10))
    assert meter.summary(10 * S)["energy_j"] == second["energy_j"]
    assert meter.quantities(10 * S) == {"energy_j": pytest.approx(second["energy_j"])}
    nobody = EnergyUse(robots, [None, None], lambda: np.zeros(2))
    assert (nobody.quantities(S), nobody.track(Second(S, np.empty(0), np.zeros(2), None))
            ) == ({}, {})
    assert set(nobody.summary(S).values()) == {None}

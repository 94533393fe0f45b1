"""``argos_rab`` and ``webots_emitter`` do what ARGoS' source and Webots' manual say."""

import math

import numpy as np
import pytest

from desim.ports import Obstacles
from desim.testing import Bench
from desim.world.scenery import crossing
from netmodels.compatible.argos_rab import ArgosRab
from netmodels.compatible.webots_emitter import WebotsEmitter

MS = 10**6


def rab(places, **params):
    return Bench(ArgosRab(ArgosRab.Params(**params)), places)


def webots(places, **params):
    return Bench(WebotsEmitter(WebotsEmitter.Params(**params)), places)


def walled(bench, x_m):
    """With a wall across the x axis."""
    bench.medium._place.obstacles = Obstacles(
        np.array([[x_m, -1.0, x_m, 1.0]]), np.zeros(1, np.int64), np.array([0.1]), np.array([2.0]),
        ("brick",), 0, crossing)
    return bench


def fates(bench):
    return sorted((str(label), to, time_ns // MS, fate)
                  for time_ns, label, _, to, fate in bench.run())


LINE = {"a": (0.0, 0.0), "near": (2.99, 0.0), "edge": (3.0, 0.0), "up": (0.0, 2.0),
        "none": (math.nan, 0.0)}


def test_a_rab_message_is_there_at_the_end_of_the_tick_within_the_range_and_without_walls():
    """The range is exclusive in ARGoS."""
    bench = walled(rab(LINE), 1.0)
    bench.send(30 * MS, "a", ("near", "edge", "up", "none"), 56, label="all", broadcast=True)
    bench.send(100 * MS, "up", "a", 56, label="in step")
    bench.send(250 * MS, "a", "edge", 56, label="far")
    assert fates(bench) == [
        ("all", "edge", 100, "out_of_reach"), ("all", "near", 100, "obstructed"),
        ("all", "none", 100, "out_of_reach"), ("all", "up", 100, "arrived"),
        ("far", "edge", 300, "out_of_range"), ("in step", "a", 200, "arrived")]


def test_a_rab_has_one_message_of_a_fixed_size_a_tick():
    bench = rab(LINE)
    for label, size_bytes in enumerate((56, 57, 50, 56)):
        bench.send(label * MS, "a", "near", size_bytes, label=label)
    bench.send(5 * MS, "up", "a", 56, label="another's")
    bench.send(105 * MS, "a", "near", 2 * 51, 2, label="two packets")
    assert fates(bench) == [
        ("0", "near", 2, "overwritten"), ("1", "near", 1, "too_long"),
        ("2", "near", 3, "overwritten"), ("3", "near", 100, "arrived"),
        ("another's", "a", 100, "arrived"), ("two packets", "near", 200, "arrived")]


def delivered(probability, frames=10_000):
    bench = rab(LINE, drop_probability=probability)
    for label in range(frames):
        bench.send(label * 100 * MS, "a", "near", 56, label=label)
    return sum(fate == "arrived" for *_, fate in bench.run()) / frames


def test_a_rab_drops_packets_by_chance():
    error = math.sqrt(0.3 * 0.7 / 10_000)
    assert abs(delivered(0.3) - 0.7) < 3.3 * error
    assert abs(delivered(0.33) - 0.7) > 3.3 * error


def test_webots_packets_leave_at_the_baud_rate_and_arrive_at_the_end_of_a_step():
    """100 B at 8 kb/s take 100 ms: the steps of 32 ms end at 128, 224 and 320 ms. Without a rate a
    packet takes a step."""
    bench = webots({"a": (0, 0), "b": (9, 0)}, baud_rate="8 kb/s")
    for label in range(3):
        bench.send(0, "a", "b", 100, label=label)
    assert fates(bench) == [("0", "b", 128, "arrived"), ("1", "b", 224, "arrived"),
                           ("2", "b", 320, "arrived")]
    bench = webots({"a": (0, 0), "b": (9, 0)})
    for label in range(3):
        bench.send(label * 32 * MS - label, "a", "b", 10**6, label=label)
    assert fates(bench) == [("0", "b", 32, "arrived"), ("1", "b", 64, "arrived"),
                           ("2", "b", 96, "arrived")]


@pytest.mark.parametrize(("byte_size", "arrives_ms"), [(8, 128), (11, 160)])
def test_control_bits_take_time(byte_size, arrives_ms):
    bench = webots({"a": (0, 0), "b": (9, 0)}, baud_rate="8 kb/s", byte_size=byte_size)
    bench.send(0, "a", "b", 100)
    assert bench.run()[0][0] == arrives_ms * MS


def test_the_twin_a_rate_of_a_third_less_misses_a_step():
    bench = webots({"a": (0, 0), "b": (9, 0)}, baud_rate="6 kb/s")
    bench.send(0, "a", "b", 100)
    assert bench.run()[0][0] == 160 * MS


def test_webots_buffer_counts_the_bytes_that_wait():
    bench = webots({"a": (0, 0), "b": (9, 0)}, baud_rate="8 kb/s", buffer="250 B")
    for label in range(3):
        bench.send(0, "a", "b", 100, label=label)
    bench.send(99 * MS, "a", "b", 50, label="fits")
    bench.send(99 * MS, "a", "b", 1, label="does not")
    bench.send(100 * MS, "a", "b", 100, label="later")
    assert {label: fate for _, label, _, _, fate in bench.run()} == {
        0: "arrived", 1: "arrived", 2: "queue_full", "fits": "arrived", "does not": "queue_full",
        "later": "arrived"}


def test_radio_goes_through_walls_and_infra_red_does_not():
    for kind, fate in ("radio", "arrived"), ("infra-red", "obstructed"):
        bench = walled(webots(LINE, type=kind, range="3 m"), 1.0)
        bench.send(0, "a", ("near", "edge", "up"), 10, label=kind, broadcast=True)
        bench.send(0, "a", "none", 10, label="to nowhere")
        assert fates(bench) == [
            (kind, "edge", 32, fate), (kind, "near", 32, fate), (kind, "up", 32, "arrived"),
            ("to nowhere", "none", 32, "out_of_range")]


def test_the_signal_falls_with_the_square_of_the_distance():
    model = webots(LINE, range="10 m").medium.model
    signal = model.signal(np.zeros(2), np.array([[1.0, 0], [3, 4], [0, 10], [0, 10.1]]))
    assert 10 ** (signal.power_dbm / 10) == pytest.approx([1, 1 / 25, 1 / 100, 1 / 102.01])
    assert signal.delivery.tolist() == [1, 1, 1, 0]

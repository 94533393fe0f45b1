"""ns-3's Wi-Fi as a network of desim: ``scenarios/foreign/ns3_network.py``."""

import subprocess
import sys
from collections import Counter
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from runs import HELLO, outcome_of

from desim import plugins
from desim.netcases.case import play
from desim.testing import Bench
from netmodels.cases.saturation import Saturation
from netmodels.radio.dcf.radio import DcfRadio

pytestmark = pytest.mark.skipif(find_spec("ns3") is None, reason="ns3 is not installed")

PLACE = f"{Path(__file__).resolve().parents[2]}/scenarios/foreign/ns3_network:Ns3"
SETTINGS = (f"network.media.lan.model={PLACE}", "stop.elapsed=3 s")
MS = 10**6


def ns3(**params):
    model = plugins.load("network", PLACE)
    return model(model.Params(**params))


def goodputs_mbps(stations, **params):
    """Of our radio, and of ns-3's."""
    setup = Saturation(Saturation.Params(stations=stations, duration="1 s")).setup()
    return [play(setup._replace(model=model))["goodput_mbps"]
            for model in (setup.model, ns3(**params))]


@pytest.mark.parametrize("stations", [2, 5, 10])
def test_saturated_stations_of_ours_carry_what_those_of_ns3_do(stations):
    ours_mbps, mbps = goodputs_mbps(stations)
    assert ours_mbps == pytest.approx(mbps, rel=0.03)


def test_at_another_rate_they_do_not():
    ours_mbps, mbps = goodputs_mbps(5, rate="48 Mb/s")
    assert ours_mbps != pytest.approx(mbps, rel=0.03)


def test_runs_are_equal_in_two_processes(tmp_path):
    settings = [part for setting in SETTINGS for part in ("--set", setting)]
    other = subprocess.run(
        [sys.executable, "-m", "desim.cli", "run", HELLO, "--out", tmp_path, *settings],
        text=True, capture_output=True, check=True)
    first, second = (outcome_of(HELLO, *SETTINGS).digest for _ in range(2))
    assert first == second
    assert f"digest {first}" in other.stdout


def test_radios_are_where_the_hosts_are():
    bench = Bench(ns3(), {"a": (0.0, 0.0), "b": (5.0, 0.0)})
    far = np.array([[0.0, 0.0], [60.0, 0.0]])
    bench.send(0, "a", "b", 1000, label="near")
    bench.book(50 * MS, lambda _: setattr(bench.medium, "positions", lambda time_ns: far), None)
    bench.send(51 * MS, "a", "b", 1000, label="far")
    assert [fate for *_, fate in bench.run(200 * MS)] == ["arrived", "retry_limit"]


def test_every_packet_has_a_fate():
    """Of 702 at once 500 find room, the broadcast first; and c is too far."""
    bench = Bench(ns3(), {"a": (0.0, 0.0), "b": (5.0, 0.0), "c": (60.0, 0.0)})
    bench.send(0, "a", ["b", "c"], 1000, label="broadcast", broadcast=True)
    bench.send(0, "a", "b", 700_000, segments=700, label="train")
    bench.send(0, "a", "b", 1000, label="last")
    assert [fate[1:] for fate in bench.run(1000 * MS)] == [
        ("last", "a", "b", "queue_full"),
        ("broadcast", "a", "b", "arrived"), ("broadcast", "a", "c", "missed"),
        ("train", "a", "b", "arrived in part")]
    assert bench.parts == [("train", "b", dict.fromkeys(range(499, 700), "queue_full"))]
    assert bench.medium.in_flight() == 0


def beside_a_lost_host(model):
    """Of 500 frames to b, and as many to c, who is not there: the numbers of each fate."""
    bench = Bench(model, {"a": (0.0, 0.0), "b": (5.0, 0.0), "c": (60.0, 0.0)})
    for k in range(1000):
        bench.send(k * 1_200_000, "a", "bc"[k % 2], 1518)
    counts = Counter((host, fate) for *_, host, fate in bench.run())
    return [counts[fate] for fate in (("b", "arrived"), ("c", "expired"), ("c", "retry_limit"))]


def ours(**constants):
    return DcfRadio(DcfRadio.Params(preset="ns3_3_44", walls=None, constants=constants))


def test_frames_behind_those_for_a_lost_host_have_the_fates_that_they_have_in_ns3():
    expected = pytest.approx(beside_a_lost_host(ns3()), abs=15)
    assert beside_a_lost_host(ours(lifetime="500 ms")) == expected
    assert beside_a_lost_host(ours()) != expected  # but for ns-3's lifetime of 500 ms

"""The picture of a radio's reach: its numbers, and its answers to wrong options."""

import numpy as np
import pytest
from typer.testing import CliRunner

from desim.cli import app
from desim.testing import Bench
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.radio import Radio

FIELD = """\
name: two
deployment: field
environment: {terrain: {size: [60 m, 10 m]}}
fleet: {size: 2, start: {poses: [{x: -28 m, y: 0 m}, {x: 28 m, y: 0 m}]}}
network: {media: {lan: null, air: {model: radio, rate: 6 Mb/s, fidelity: FIDELITY}}}
"""


def test_signal_is_the_link_budget():
    """16.02 dBm - 46.6777 dB - 30 log10(d) (log-distance, exponent 3)."""
    radio = DcfRadio(DcfRadio.Params(path_loss={"reference": "46.6777 dB"}))
    Bench(radio, 1)
    to_m = np.array([[1.0, 0.0], [10.0, 0.0], [0.0, 40.0]])
    power_dbm, delivery = radio.signal(np.zeros(2), to_m)
    assert power_dbm == pytest.approx([-30.6571, -60.6571, -78.7189], abs=1e-4)
    assert delivery[0] == 1.0 and delivery[2] < 0.01, "54 Mb/s wants more than -75 dBm"


def test_the_disk_is_all_or_nothing():
    disk = Radio.build(Radio.Params(fidelity="disk"))
    Bench(disk, 1)
    range_m = disk.range_m[0]
    to_m = np.array([[0.999 * range_m, 0.0], [1.001 * range_m, 0.0]])
    assert disk.signal(np.zeros(2), to_m).delivery.tolist() == [1.0, 0.0]


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "two.yaml").write_text(FIELD.replace("FIDELITY", "mac"))
    return tmp_path


def coverage(*arguments):
    done = CliRunner().invoke(app, ["coverage", "two.yaml", *arguments])
    assert "Traceback" not in done.stderr
    return done.exit_code, done.stdout, done.stderr


def test_the_picture_and_what_it_comes_to(here):
    code, said, _ = coverage("--at", "0 m, 0 m", "--to", "far.svg")
    assert code == 0
    assert said == ("100.0% of the reachable area gets 90% of packets from (0, 0) m; 1 of 1 links "
                    "between hosts at the start do\nfar.svg\n")
    assert (here / "far.svg").read_text().startswith("<?xml")


@pytest.mark.parametrize(("arguments", "complaint"), [
    (["--at", "robot_7"], "two.yaml: --at: 'robot_7' is no place (did you mean 'robot_1'?); "
     "allowed: a host's name, or as '3 m, -2.5 m'; hosts that have a place: robot_0, robot_1"),
    (["--at", "3, 4"], "two.yaml: --at: '3, 4' is no place; allowed: a host's name, or as "
     "'3 m, -2.5 m'; hosts that have a place: robot_0, robot_1"),
    (["--medium", "lan"], "two.yaml: --medium: no medium 'lan'; known: air"),
    (["--set", "network.media.air.fidelity=ideal"],
     "two.yaml:5:43: network.media.air.model: radio, fidelity ideal, does not say what comes in "
     "where; coverage is for models that do, as radio with fidelity disk, walls or mac and without "
     "access_points"),
    (["--set", "network.media.air={model: radio, access_points: [{at: [0 m, 0 m]}]}"],
     "--set network.media.air={model: radio, access_points: [{at: [0 m, 0 m]}]}: "
     "network.media.air.model: radio with access_points does not say what comes in where; coverage "
     "is for models that do, as radio with fidelity disk, walls or mac and without access_points"),
])
def test_wrong_questions(here, arguments, complaint):
    assert coverage(*arguments) == (2, "", f"{complaint}\n")
    assert not (here / "coverage.png").exists()

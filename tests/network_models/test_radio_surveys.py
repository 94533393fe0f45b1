"""The presets ``indoor`` and ``outdoor`` against what was measured: each comparison has a twin."""

import numpy as np
import pytest

from desim.netcases.case import play
from netmodels.radio import shadowing
from netmodels.radio.dcf import radio
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.presets import PRESETS
from netmodels.validation import surveys
from netmodels.validation.surveys import RadioInAStreet, RadioInRooms


@pytest.fixture(autouse=True)
def few(monkeypatch):
    """Means of fewer seeds than ``desim validate`` takes."""
    monkeypatch.setattr(surveys, "_SEEDS", range(1, 4))


def failing(group):
    return {check.what for check in group().checks(play) if not check.holds}


@pytest.mark.parametrize("group", [RadioInRooms, RadioInAStreet])
def test_the_presets_agree(group):
    assert failing(group) == set()


@pytest.mark.parametrize(("preset", "group", "values", "fail"), [
    ("indoor", RadioInRooms, {"path_loss": {"exponent": 3}}, {"exponent in sight"}),
    ("indoor", RadioInRooms, {"shadowing": {"sigma": "4.3 dB", "correlation": "8.3 m"}}, {
        "sigma", "correlation, 0.59 to 0.61 m", "correlation, 0.9 to 1.8 m",
        "correlation, 1.8 to 3 m", "correlation, 3 to 5 m"}),
    ("indoor", RadioInRooms, {"shadowing": {"sigma": "0 dB", "echoes": "3.9 dB"}}, {
        "correlation, 0.59 to 0.61 m", "correlation, 0.9 to 1.8 m", "correlation, 1.8 to 3 m"}),
    ("indoor", RadioInRooms, {"fading": {"rician_k": "7 dB"}}, {
        "lost by a robot that stands for a minute"}),
    ("outdoor", RadioInAStreet, {"shadowing": {"sigma": "4.6 dB"}}, {"outdoors: sigma"}),
    ("outdoor", RadioInAStreet, {"shadowing": {"correlation": "15 m"}}, {
        "outdoors: correlation, 5 m", "outdoors: correlation, 10 m",
        "outdoors: correlation, 20 m"}),
    ("outdoor", RadioInAStreet, {"path_loss": {"exponent": 2.2}}, {"outdoors: exponent"}),
])
def test_with_other_values_they_do_not(monkeypatch, preset, group, values, fail):
    for key, value in values.items():
        monkeypatch.setitem(PRESETS[preset], key, {**PRESETS[preset].get(key, {}), **value})
    assert failing(group) >= fail


def test_links_of_one_place_have_little_in_common(monkeypatch):
    """The twin: losses that belong to each end by itself."""
    def of_one_end(*args):
        waves = obstacles(*args)
        waves._numbers[0] = np.zeros_like(waves._numbers[0])
        return waves

    obstacles = shadowing._obstacles
    monkeypatch.setattr(shadowing, "_obstacles", of_one_end)
    assert "correlation of two links of a place" in failing(RadioInRooms)


def test_echoes_of_another_wavelength(monkeypatch):
    monkeypatch.setattr(radio, "LIGHT_MPS", 1.3 * radio.LIGHT_MPS)
    assert "correlation of echoes half a wavelength away" in failing(RadioInRooms)


def test_a_preset_is_completed_key_by_key_unless_another_model_is_named():
    indoor = DcfRadio.Params(preset="indoor", shadowing={"sigma": "5 dB"},
                             path_loss={"reference": "46.6777 dB"})
    assert (indoor.shadowing.sigma_db, indoor.shadowing.correlation_m, indoor.shadowing.echoes_db,
            indoor.path_loss.exponent) == (5.0, 3.0, 3.1, 1.8)
    bare = DcfRadio.Params(preset="indoor", shadowing=None,
                           path_loss={"model": "two_ray", "frequency": "2412 MHz"})
    assert (bare.shadowing, bare.path_loss.exponent) == (None, None)
    assert DcfRadio.Params(preset="ns3_3_44").broadcast_rate_bps == 1_000_000
    assert indoor.broadcast_rate_bps is None

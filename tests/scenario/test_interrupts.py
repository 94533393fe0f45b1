"""Ctrl-C while a scenario is serialized."""

import pickle

import pytest
from designs import BASE

import desim
from desim.scenario.resolved import resolved


def small(folder):
    (folder / "small.yaml").write_text(BASE)
    return desim.load(folder / "small.yaml").scenario


@pytest.mark.parametrize("serialize", [pickle.dumps, hash, resolved])
def test_ctrl_c_ends_what_serializes_a_scenario(tmp_path, monkeypatch, serialize):
    """As such: pydantic hides it in an error, and a sweep ended with code 1 in place of 130."""
    scenario = small(tmp_path)

    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(type(scenario.coordination.params), "model_dump", interrupted)
    with pytest.raises(KeyboardInterrupt):
        serialize(scenario)


def test_other_errors_of_serializers_stay_what_they_are(tmp_path, monkeypatch):
    scenario = small(tmp_path)
    monkeypatch.setattr(type(scenario.coordination.params), "model_dump", lambda *_, **__: 1 / 0)
    with pytest.raises(Exception, match="ZeroDivisionError"):
        hash(scenario)

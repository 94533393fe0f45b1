"""Each network model and rule has the capabilities that its docstring names, and no others."""

import re

import pytest

from desim import plugins
from desim.ports import capabilities, model_of
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.uncontended import Uncontended

CAPABILITIES = [value for value in vars(capabilities).values()
                if getattr(value, "_is_runtime_protocol", False)]
NEEDED = {"distance": {"delivery": [["10 m", 1]]}, "replay": {"file": "trace.csv"},
          "lora": {"gateway": "a"},
          "bandwidth": {"rate": "1 Mb/s"}, "duplication": {"probability": 0.1},
          "flapping": {"hosts": ["a"], "up": "1 s", "down": "1 s"}, "latency": {"delay": "1 ms"},
          "jamming": {"at": ["0 m", "0 m"], "radius": "1 m"}, "loss": {"probability": 0.1},
          "gilbert_elliott": {"p": 0.1, "r": 0.1}, "outage": {"hosts": ["a"]},
          "partition": {"groups": [["a"]]}, "reordering": {"probability": 0.1, "delay": "1 ms"},
          **{f"recorded_{what}": {"file": "trace.csv"} for what in ("loss", "delay", "rate")}}
PLUGINS = [(kind, name) for kind in ("network", "rule") for name, point
           in plugins.available(kind).items() if point.module.startswith("netmodels.")]


def named(cls: type) -> tuple[set[str], set[str]]:
    """The capabilities that a docstring names: those of each object, and those of some."""
    text = next((one.__doc__ for one in cls.__mro__ if "Capabilities:" in (one.__doc__ or "")), "")
    always, _, sometimes = text.partition("Capabilities:")[2].partition(";")
    return tuple({one.__name__ for one in CAPABILITIES if re.search(rf"\b{one.__name__}\b", part)}
                 for part in (always, sometimes))


def found(plugin: object) -> set[str]:
    return {one.__name__ for one in CAPABILITIES if isinstance(plugin, one)}


@pytest.mark.parametrize("kind, name", PLUGINS)
def test_a_docstring_names_the_capabilities(kind, name):
    cls = plugins.load(kind, name)
    params = NEEDED.get(name.removeprefix("residual_"), {})
    always, sometimes = named(cls)
    assert always <= found(model_of(cls, cls.Params(**params))) <= always | sometimes


def test_capabilities_of_some_objects():
    assert "Separates" in found(DcfRadio(DcfRadio.Params(channels={"a": 6})))
    emitter = plugins.load("network", "webots_emitter")
    assert "LimitsReach" in found(emitter(emitter.Params(range="5 m")))
    assert found(Uncontended(DcfRadio.Params(), open_air=True)) == named(Uncontended)[0]

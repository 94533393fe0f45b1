"""All that send frames are whole carriers: they have a method for all that can befall a frame."""

import ast
import importlib
from pathlib import Path

import pytest

from desim.netcases.case import play
from desim.network.carrier import Carrier
from desim.ports.cases import NOWHERE, Flow, Setup
from desim.testing import Bench
from netmodels.ideal import Ideal
from netmodels.rules.timing import Duplication

ROOT = Path(__file__).resolve().parents[2]
PARTS = {("arrived", 3), ("lost", 4)}  # a class with both methods hears of frames


def carriers():
    """Every class of desim that hears of frames, as (module, name)."""
    for file in sorted((ROOT / "desim").rglob("*.py")):
        text = file.read_text()
        for node in ast.walk(ast.parse(text)) if "def lost(" in text else ():
            if isinstance(node, ast.ClassDef) and {
                    part.name: len(part.args.args) for part in node.body
                    if isinstance(part, ast.FunctionDef)}.items() >= PARTS:
                module = ".".join(file.relative_to(ROOT).with_suffix("").parts)
                if module != "desim.network.carrier":
                    yield module.removesuffix(".__init__"), node.name


@pytest.mark.parametrize("module, name", list(carriers()))
def test_carriers_are_whole(module, name):
    cls = getattr(importlib.import_module(module), name)
    assert issubclass(cls, Carrier)


def test_the_search_finds_them():
    found = {name for _, name in carriers()}
    assert {"PacketSource", "StreamLink", "Datagram", "Sender", "Bench"} <= found


def test_a_carrier_is_a_socket_of_its_own_unless_it_says_otherwise():
    bench = Bench(Ideal(Ideal.Params()))
    assert bench.socket is bench


def test_a_case_may_have_a_rule_that_makes_copies():
    """Each frame has a copy, which is no further arrival."""
    def found(*rules):
        return play(Setup(Ideal(Ideal.Params()), {"a": NOWHERE, "b": NOWHERE},
                          [Flow("a", ("b",), 100, 60, "zero", 10**8)], 10**9, rules=rules))

    assert found(Duplication(Duplication.Params(probability=1.0))) == found()
    assert found()["delivered"] == 11


def test_the_twin_half_a_carrier_is_none():
    class Half:
        def arrived(self, token, receiver): ...
        def lost(self, token, receiver, reason): ...

    assert not issubclass(Half, Carrier)

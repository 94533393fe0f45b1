"""The kit's check of cost models: ours pass, and what breaks the contract is named."""

import random
import sys
from inspect import getsourcelines

import pytest
from pydantic import Field

from desim import plugins, ports
from desim.computers.costs.ideal import IdealComputers
from desim.computers.costs.table import TableOfCosts
from desim.errors import InputError, ModelError
from desim.testing import check_computers
from desim.units import Duration

MODELS = sorted({*plugins.available("computers"), "ideal", "measured", "table"})


@pytest.mark.parametrize("name", MODELS)
def test_every_cost_model_keeps_its_contract(name):
    check_computers(plugins.load("computers", name))


def test_a_table_keeps_it_with_rows():
    check_computers(TableOfCosts, callbacks={
        "move_base": {"control": {"fixed": "1 ms", "per": {"candidates": "3.5 us"}},
                      "any": {"fixed": "10 us"}}},
        send={"message": "5 us", "byte": "0.4 ns", "link": "8 us", "link_byte": "0.1 ns"},
        receive={"message": "9 us", "byte": "0.3 ns"})


def test_a_table_says_what_never_came_for_callbacks_that_were_called():
    params = TableOfCosts.Params.model_validate_json(
        '{"callbacks": {"slam": {"odom": {"per": {"beams": "1 us", "cells": "1 us"}}}}}')
    costs = TableOfCosts(params)
    cost_ns = costs.of_callback("slam", "odom")
    assert list(costs.unused_rows(["slam"])) == []
    assert cost_ns({"beams": 3, "bytes": 8}) == 3000
    assert list(costs.unused_rows(["slam"])) == [
        "computers: 'odom' of node 'slam' never declared cells; it declared: bytes, beams"]
    assert cost_ns({"cells": 2}) == 2000
    assert list(costs.unused_rows(["slam"])) == []


class PerBeam(IdealComputers):
    """A cost model from outside."""

    class Params(ports.Params):
        beam_ns: Duration = Field("2 us", description="of a beam (my laptop)")

    def __init__(self, params):
        self._beam_ns = params.beam_ns

    def callback_ns(self, work):
        return self._beam_ns * work.quantities.get("beams", 0)


def test_one_from_outside_keeps_it():
    check_computers(PerBeam, beam="3 us")


class Fractional(PerBeam):
    def callback_ns(self, work):
        return 0.5


class Chancy(PerBeam):
    def receive_ns(self, topic, size_bytes):
        return random.randrange(1000)


_RUNS = iter(range(10**9))


class Forgetful(PerBeam):
    def send_ns(self, topic, size_bytes, links):
        return next(_RUNS)


class Ignorant(PerBeam):
    def callback_ns(self, work):
        return {"slam": 5}[work.node]


class Leaving(PerBeam):
    def callback_ns(self, work):
        sys.exit(1)


class Short:
    Params = PerBeam.Params

    def __init__(self, params):
        pass

    def callback_ns(self, work):
        return 0


class HalfAMemory(PerBeam):
    def system_bytes(self):
        return 48_000_000


class WholeMemory(HalfAMemory):
    def process_bytes(self, kept):
        return 0


def test_memory_needs_both_of_its_methods():
    check_computers(WholeMemory)
    assert plugins.misfit("computers", WholeMemory) == ""
    assert plugins.misfit("computers", HalfAMemory) == (
        "have system_bytes and process_bytes, or none of them: it has no process_bytes")


@pytest.mark.parametrize(("twin", "error", "what"), [
    (HalfAMemory, AssertionError, "must have system_bytes and process_bytes, or none of them"),
    (Fractional, ModelError, ".Fractional.callback_ns (test_computers_conformance.py:{line}) "
     "answered 0.5 to Work(node='slam', trigger='odom'"),
    (Leaving, AssertionError, "Leaving must not call sys.exit()"),
    (Chancy, AssertionError, "must draw from context.stream(name) only"),
    (Forgetful, AssertionError, "must give the same costs in each run: keep state in self"),
    (Ignorant, KeyError, "localization"),
    (Short, AssertionError, "must have a method send_ns(self, topic, size_bytes, links), and have "
                            "a method receive_ns(self, topic, size_bytes)")])
def test_what_breaks_the_contract_is_named(twin, error, what):
    with pytest.raises(error) as refused:
        check_computers(twin)
    assert what.format(line=getsourcelines(twin.callback_ns)[1]) in str(refused.value)


@pytest.mark.parametrize(("row", "complaint"), [
    ({"per": {"beam": "1 us"}}, "callbacks.slam.odom.per.beam: no quantity of work (did you mean "
                                "'beams'?); allowed: bytes, scans, beams, particles, cells, "
                                "candidates, plans"),
    ({"fixed": "1"}, "callbacks.slam.odom.fixed: '1' has no unit; allowed: ms, us, ns, ps, s, µs, "
                     "e.g. '0.4 ns'"),
    ({"fixed": "-1 ms"}, "callbacks.slam.odom.fixed: '-1 ms' must not be negative"),
    ({"fix": "1 ms"}, "callbacks.slam.odom.fix: unknown key (did you mean 'fixed'?); allowed: "
                      "fixed, per")])
def test_a_wrong_row_of_a_table(row, complaint):
    with pytest.raises(InputError) as refused:
        check_computers(TableOfCosts, callbacks={"slam": {"odom": row}})
    assert complaint in str(refused.value)

"""Warnings about radios: marks that nobody reads, and access points out of reach; with twins."""

import pytest
from runs import HELLO, built

from desim.advice.warnings import warnings

MARKED = "topics={cmd_vel: {dscp: 48}}"
NO_EFFECT = ("topics.cmd_vel.dscp: no effect, because no medium of theirs has access categories (a "
             "radio has them since 802.11n, or with qos: true)")


def said(air, *overrides, elapsed="100 ms"):
    simulation = built(HELLO, f"stop.elapsed={elapsed}", "deployment=field",
                       f"network.media={{air: {air}}}", *overrides)
    simulation.run()
    return [text for text in warnings(simulation.monitor)
            if "dscp" in text or "access point" in text]


@pytest.mark.parametrize("air", [
    "{model: radio, standard: 11g}", "{model: switch}",
    "{model: radio, standard: 11n, channel: 36, fidelity: walls}"])
def test_a_mark_that_nobody_reads_is_said(air):
    assert said(air, MARKED) == [NO_EFFECT]


@pytest.mark.parametrize("air", [
    "{model: radio, standard: 11g, qos: true}", "{model: radio, standard: 11n, channel: 36}"])
def test_the_twins_with_access_categories_say_nothing(air):
    assert said(air, MARKED) == []


def wifi(x_m, more=""):
    return f"{{model: radio, access_points: [{{at: [{x_m} m, 0 m]}}]{more}}}"


def test_access_points_out_of_reach_are_said():
    assert said(wifi(4000), elapsed="12 s") == [
        "medium air: robot_0 and 2 more hung on no access point when the run began, and never did: "
        "are its access points in reach of them (network.media.air.access_points)?"]


def test_the_twins_within_reach_and_those_that_have_to_join_say_nothing():
    assert said(wifi(0)) == []
    assert said(wifi(0, ", infrastructure: {associated: false}"), elapsed="12 s") == []

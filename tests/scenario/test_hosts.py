"""Hosts of a scenario: their names, who listens, who collects, and who gets what is published."""

import pytest

from desim.errors import InputError
from desim.scenario.load import from_mapping
from desim.scenario.names import fleet_size, host_names, unknown
from desim.scenario.recipients import (
    carrying_software,
    listeners,
    monitors,
    recipients,
    topics_for,
)
from desim.scenario.schema.robot import Publication


def scenario(**keys):
    return from_mapping({"name": "x", **keys}).scenario


HOSTS = {"base": {"monitor": True}, "office": {}}


def test_a_testbed_has_a_workstation_that_collects():
    field, testbed = (scenario(deployment=kind, fleet={"size": 2}, hosts=HOSTS)
                      for kind in ("field", "testbed"))
    assert host_names(field) == ("base", "office", "robot_0", "robot_1")
    assert host_names(testbed) == (*host_names(field), "workstation")
    assert monitors(field) == ("base",)
    assert monitors(testbed) == ("base", "workstation")


def test_passive_robots_carry_no_software():
    fleet = scenario(deployment="field", fleet={"size": 3}, hosts=HOSTS,
                     robot={"passive": ["robot_1"]})
    assert carrying_software(fleet) == ("robot_0", "robot_2")
    assert listeners(fleet) == ("base", "office", "robot_0", "robot_2")


@pytest.mark.parametrize("fleet, size", [
    ({}, 1), ({"size": 3}, 3), ({"robots": [{"type": "a", "count": 2}, {"type": "b", "count": 3}],
                                 "types": {"a": {}, "b": {}}}, 5),
    ({"start": {"poses": [{"x": "0 m", "y": "0 m"}, {"x": "3 m", "y": "0 m"}]}}, 2)])
def test_a_fleet_has_as_many_robots_as_somebody_says(fleet, size):
    assert fleet_size(scenario(fleet=fleet).fleet) == size


def publication(**to):
    return Publication(topic="camera", size="1 kB", rate="1 Hz", **to)


ROBOTS, ALL = ("robot_0", "robot_1"), ("base", "robot_0", "robot_1")


@pytest.mark.parametrize("to, got", [
    ({}, ()), ({"to": "base"}, ("base",)), ({"to": "others"}, ("robot_1",)),
    ({"to": "*"}, ("base", "robot_1")), ({"to": ("b?se", "robot_1")}, ("base", "robot_1")),
    ({"to": "robot_0"}, ())])
def test_who_publishes_gets_nothing_of_it(to, got):
    assert recipients(publication(**to), "robot_0", ROBOTS, ALL) == got


def test_topics_are_those_of_the_robots_that_publish():
    fleet = scenario(deployment="field", fleet={"size": 2}, hosts=HOSTS)
    published = [("robot_0", publication(to="base")), ("robot_1", publication(to="others"))]
    assert topics_for("base", fleet, published) == ["/robot_0/camera"]
    assert topics_for("robot_0", fleet, published) == ["/robot_1/camera"]
    assert topics_for("robot_1", fleet, published) == []


def test_of_many_names_the_first_and_the_last_are_said():
    names = [f"robot_{i}" for i in range(9)]
    assert unknown("host", "zz", names[:8]) == (
        f"unknown host 'zz'; allowed: {', '.join(names[:8])}")
    assert unknown("host", "robot9", names) == (
        "unknown host 'robot9' (did you mean 'robot_8'?); allowed: robot_0, robot_1, robot_2, ..., "
        "robot_8")


@pytest.mark.parametrize(("own", "holds"), [
    ("{behind: 3 s}", False), ("{behind: 3 s, ahead: 0 s}", True), ("{ahead: 3 s}", True)])
def test_the_clock_of_a_type_is_that_of_all_robots_but_for_what_it_says_itself(own, holds):
    """All clocks are 5 s ahead, so one that is behind must not be ahead."""
    def load():
        return from_mapping({"name": "s"}, [
            "robot.clock.ahead=5 s", f"fleet.types.scout={{robot: {{clock: {own}}}}}",
            "fleet.robots=scout"])

    if holds:
        load()
    else:
        with pytest.raises(InputError, match=r"clock: must be ahead or behind, not both, got 5 s "
                                             "ahead and 3 s behind"):
            load()

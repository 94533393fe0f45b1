"""The receivers of what robots publish by declaration (``robot.publishes``)."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase

from desim.scenario.names import WORKSTATION, host_names, robot_names
from desim.scenario.schema.robot import OTHERS, Publication
from desim.scenario.schema.scenario import Scenario


def listeners(scenario: Scenario) -> tuple[str, ...]:
    """The hosts that can receive messages: all that carry software, in natural order."""
    passive = frozenset(scenario.robot.passive)
    return tuple([name for name in host_names(scenario) if name not in passive])


def carrying_software(scenario: Scenario) -> tuple[str, ...]:
    """The robots that carry software, in natural order."""
    passive = frozenset(scenario.robot.passive)
    return tuple([name for name in robot_names(scenario) if name not in passive])


def monitors(scenario: Scenario) -> tuple[str, ...]:
    """The hosts that collect maps and distances, in natural order."""
    named = frozenset(name for name, host in scenario.hosts.items() if host.monitor)
    testbed = scenario.deployment == "testbed"
    return tuple(name for name in host_names(scenario)
                 if name in named or (testbed and name == WORKSTATION))


def words_of(publication: Publication) -> tuple[str, ...]:
    """The names, patterns and words of ``to``, as they are written."""
    to = publication.to
    return () if to is None else (to,) if isinstance(to, str) else to


def recipients(publication: Publication, sender: str, robots: Sequence[str],
               hosts: Sequence[str]) -> tuple[str, ...]:
    """Those of ``hosts`` that receive what ``sender``, one of ``robots``, publishes."""
    words = words_of(publication)
    return tuple([host for host in hosts if host != sender and any(
        host in robots if word == OTHERS else fnmatchcase(host, word) for word in words)])


def topics_for(host: str, scenario: Scenario, publications: Sequence[tuple[str, Publication]]
               ) -> list[str]:
    """The topics that ``host`` listens to, of what is published: pairs of a robot and one of its
    publications."""
    robots, hosts = robot_names(scenario), listeners(scenario)
    return [f"/{robot}/{publication.topic}" for robot, publication in publications
            if host in recipients(publication, robot, robots, hosts)]

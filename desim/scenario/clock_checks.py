"""The checks of clocks: their offsets, and the time servers that they follow."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from desim.scenario.checks import Checks, Found
from desim.scenario.complete import media
from desim.scenario.names import WORKSTATION, host_names, robot_names, unknown
from desim.scenario.robot_types import (
    equipment_by_path,
    filled_in,
    type_names,
    types_by_name,
    used_types,
)
from desim.scenario.schema.clock import ClockParams
from desim.scenario.schema.scenario import Scenario
from desim.scenario.source_places import Folder, Path
from desim.units import DURATION

_ALL: tuple[Path, ...] = (("fleet",), ("hosts",), ("deployment",))
_CLOCKS: tuple[Path, ...] = (("robot", "clock"), ("testbed", "clock"))


class Client(NamedTuple):
    """An NTP client's server, and the path that names it."""

    server: str
    path: Path


def _servers(scenario: Scenario, _: Folder) -> Found:
    """NTP clients ask another host. Of robots that share a block one may be the server of all."""
    clocks: list[tuple[Path, ClockParams | None, str | None]] = [
        *((path, equipment.clock, None) for path, equipment in equipment_by_path(scenario)),
        (("testbed",), scenario.testbed.clock, WORKSTATION),
        *((("hosts", name), host.clock, name) for name, host in scenario.hosts.items())]
    for path, clock, own in clocks:
        if clock is None or clock.ntp is None:
            continue
        server, hosts = clock.ntp.server, host_names(scenario)
        if server not in hosts:
            yield (*path, "clock", "ntp", "server"), unknown("host", server, hosts)
        elif server == own:
            yield (*path, "clock", "ntp", "server"), (
                f"{server!r} is the host itself; allowed: another one")


def _reach(scenario: Scenario, _: Folder) -> Found:
    """NTP clients whose requests come to no server. Of those that share a block the first."""
    hosts, seen = host_names(scenario), set[Path]()
    for host, client in _clients(scenario).items():
        if client.path not in seen and client.server in hosts and not (
                _media_from(host, scenario) & _media_of(client.server, scenario)):
            seen.add(client.path)
            yield client.path, (
                f"{host} and {client.server} have no medium in common (network.media.*.hosts), and "
                f"no hosts forward from one to the other; allowed: a host that {host} can reach")


def _circles(scenario: Scenario, _: Folder) -> Found:
    """Clocks that follow each other, and none the true time."""
    clients = _clients(scenario)
    seen = set[str]()
    for host in clients:
        followed = list[str]()
        while host in clients and host not in seen:
            seen.add(host)
            followed.append(host)
            host = clients[host].server
        if host in followed:
            circle = [*followed[followed.index(host):], host]
            yield clients[host].path, (f"a circle: {' -> '.join(circle)}; allowed: one of them "
                                       "without ntp, or with a server outside of it")


def _offsets(scenario: Scenario, _: Folder) -> Found:
    """Clocks that are both ahead and behind."""
    usual = scenario.robot.clock
    clocks: list[tuple[Path, ClockParams | None]] = [
        *((path, equipment.clock if equipment.clock is None or usual is None else
           filled_in(equipment.clock, usual)) for path, equipment in equipment_by_path(scenario)),
        (("testbed",), scenario.testbed.clock),
        *((("hosts", name), host.clock) for name, host in scenario.hosts.items())]
    for path, clock in clocks:
        if clock is not None and clock.ahead_ns and clock.behind_ns:
            yield (*path, "clock"), (
                f"must be ahead or behind, not both, got {DURATION.format(clock.ahead_ns)} ahead "
                f"and {DURATION.format(clock.behind_ns)} behind")


def _clients(scenario: Scenario) -> Mapping[str, Client]:
    """The NTP client of each host that has one, and that is not its own server, by its name."""
    fleet = scenario.fleet
    of_type = {kind: _robot_clock(kind, scenario) for kind in used_types(fleet)}
    clocks = {name: of_type[kind] for name, kind in zip(
        robot_names(scenario), type_names(fleet), strict=False)}
    if scenario.deployment == "testbed":
        clocks[WORKSTATION] = ("testbed", "clock"), scenario.testbed.clock
    for name, stationary in scenario.hosts.items():
        clocks[name] = ("hosts", name, "clock"), stationary.clock
    return {name: Client(clock.ntp.server, (*path, "ntp", "server"))
            for name, (path, clock) in clocks.items()
            if clock is not None and clock.ntp is not None and clock.ntp.server != name}


def _robot_clock(kind: str, scenario: Scenario) -> tuple[Path, ClockParams | None]:
    """The clock of robots of this type, and the path of the block that has its NTP client."""
    usual, types = scenario.robot, types_by_name(scenario)
    own = types[kind].robot if kind in types else None  # an unknown type is complained of elsewhere
    if own is None or "clock" not in own.model_fields_set:
        return ("robot", "clock"), usual.clock
    clock = filled_in(own, usual).clock
    from_type = own.clock is None or "ntp" in own.clock.model_fields_set
    return (("fleet", "types", kind, "robot") if from_type else ("robot",)) + ("clock",), clock


def _media_of(host: str, scenario: Scenario) -> set[str]:
    """The media to which a host is attached."""
    return {name for name, medium in media(scenario).items()
            if not medium.inside and host in (medium.hosts or (host,))}


def _media_from(host: str, scenario: Scenario) -> set[str]:
    """The media that its frames can take, also where other hosts forward them."""
    reached, before = _media_of(host, scenario), set[str]()
    while reached != before:
        before = reached
        reached = before.union(*(stationary.forwards for stationary in scenario.hosts.values()
                                 if before.intersection(stationary.forwards)))
    return reached


CHECKS: Checks = (
    ((*_ALL, *_CLOCKS), _servers),
    ((*_ALL, *_CLOCKS, ("network", "media")), _reach),
    ((*_ALL, *_CLOCKS), _circles),
    ((*_CLOCKS, ("hosts",), ("fleet", "types")), _offsets),
)

"""The checks of SLAM on another host than the robot's."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress

from desim import plugins
from desim.errors import InputError
from desim.ports.localization import LocalizationTraits
from desim.ports.sharing import FollowsScans
from desim.scenario.checks import Checks, Found
from desim.scenario.names import unknown
from desim.scenario.recipients import listeners
from desim.scenario.robot_types import equipment_by_path
from desim.scenario.schema.robot import LocalizationChoice
from desim.scenario.schema.scenario import Scenario
from desim.scenario.source_places import Folder, Path


def _hosts(scenario: Scenario, _: Folder) -> Found:
    """Hosts that are not there, and localization that makes no map to send back."""
    for path, choice in _elsewhere(scenario):
        known = listeners(scenario)
        if choice.host not in known:
            yield (*path, "host"), unknown("host", str(choice.host), known)
        with suppress(InputError):  # no such plug-in, which is complained of where it is named
            if not _draws(plugins.load("localization", choice.model)):
                yield (*path, "host"), (
                    f"{plugins.bare(choice.model)!r} draws no map, so it runs on the robot; "
                    "allowed on another host: "
                    f"{', '.join(_installed('localization', _draws))}")


def _sharing(scenario: Scenario, _: Folder) -> Found:
    """Map sharing that follows each scan which the robot draws, where another host draws them."""
    exchange = scenario.coordination.exchange
    for path, choice in _elsewhere(scenario):
        with suppress(InputError):
            if exchange is not None and issubclass(plugins.load("sharing", exchange.model),
                                                   FollowsScans):
                others = _installed("sharing", lambda cls: not issubclass(cls, FollowsScans))
                yield (*path, "host"), (
                    f"{plugins.bare(exchange.model)!r} shares scans as the robot draws them, and "
                    f"{choice.host} draws them; allowed then: {', '.join(others)}")


def _elsewhere(scenario: Scenario) -> Iterator[tuple[Path, LocalizationChoice]]:
    """The localization that names a host, with its paths."""
    return (((*path, "localization"), equipment.localization)
            for path, equipment in equipment_by_path(scenario)
            if equipment.localization.host is not None)


def _draws(cls: type) -> bool:
    return LocalizationTraits.of(cls).draws_map


def _installed(kind: str, fits: Callable[[type], bool]) -> Iterator[str]:
    """The installed plug-ins of this kind that fit."""
    for name in plugins.available(kind):
        with suppress(InputError):  # somebody's plug-in that cannot be loaded
            if fits(plugins.load(kind, name)):
                yield name


CHECKS: Checks = (
    ((("robot", "localization"), ("robot", "passive"), ("fleet",), ("hosts",), ("deployment",)),
     _hosts),
    ((("robot", "localization"), ("fleet", "types"), ("coordination", "exchange")), _sharing),
)

"""All checks of a scenario beyond the types of its values, in the order in which they run."""

from __future__ import annotations

from desim.scenario import (
    body_checks,
    clock_checks,
    coordination_checks,
    environment_checks,
    equipment_checks,
    fault_checks,
    fleet_checks,
    loop_checks,
    measurement_checks,
    network_checks,
    remote_slam_checks,
)
from desim.scenario.complaints import Complaint
from desim.scenario.schema.scenario import Scenario
from desim.scenario.source_places import Folder, Path

_ROOMS = (environment_checks, fleet_checks, fault_checks, clock_checks, equipment_checks,
          body_checks, measurement_checks, network_checks, loop_checks, remote_slam_checks,
          coordination_checks)


def complaints(scenario: Scenario, folder: Folder, wrong: tuple[Path, ...]) -> list[Complaint]:
    """All that is wrong. Checks that read one of the ``wrong`` paths are left out: there stands a
    default now, and not what the user meant."""
    return [Complaint(path, text) for room in _ROOMS for families, check in room.CHECKS
            if not any(all(a == b for a, b in zip(path, family, strict=False))
                       for path in wrong for family in families)
            for path, text in check(scenario, folder)]

"""The quantities that the monitor offers to a scenario's expressions."""

from __future__ import annotations

import re
from collections.abc import Sequence

from desim.scenario.robot_types import are_metered
from desim.scenario.schema.experiment import ENERGY, QUANTITIES
from desim.scenario.schema.scenario import Scenario

ROBOTS = "robots"  # of a cost, beside the others: their number

_ENERGY = re.compile(rf"\b{ENERGY}\b")


def quantities(scenario: Scenario, of_task: Sequence[str]) -> tuple[str, ...]:
    """Those of every run, the energy where it is measured, and those of its task."""
    return (*QUANTITIES, *((ENERGY,) if are_metered(scenario) else ()), *of_task)


def wants_power(scenario: Scenario, text: str) -> bool:
    """Whether an expression names the energy, and no robot's is measured."""
    return _ENERGY.search(text) is not None and not are_metered(scenario)

"""The quantities that the monitor offers to a scenario's expressions."""

from __future__ import annotations

import re
from collections.abc import Sequence

from desim.scenario.robot_types import are_metered
from desim.scenario.schema.experiment import ENERGY, QUANTITIES
from desim.scenario.schema.scenario import Scenario

ROBOTS = "robots"  # of a cost, beside the others: their number
# The columns of samples.parquet beside the quantities; ``bytes_per_s`` stands for all topics'.
ALWAYS = ("time_s", "cause")
_SAMPLED = ("parts", "map_age_s", "stale_age_s", "registry_divergence", "ghosts", "cpu_percent",
            "node_cpu_percent", "ram_mb", "ram_percent", "rx_kBps", "tx_kBps", "bytes_per_s")
ROBOTS_TABLE = "robots"  # the rows of robots.parquet

_ENERGY = re.compile(rf"\b{ENERGY}\b")


def quantities(scenario: Scenario, of_task: Sequence[str]) -> tuple[str, ...]:
    """Those of every run, the energy where it is measured, and those of its task."""
    return (*QUANTITIES, *((ENERGY,) if are_metered(scenario) else ()), *of_task)


def measurements(of_task: Sequence[str]) -> tuple[str, ...]:
    """The names of what may have a period of its own, whether or not a run measures it."""
    names = (*QUANTITIES, ENERGY, *of_task, *_SAMPLED, ROBOTS_TABLE)
    return tuple(name for name in names if name not in ALWAYS)


def wants_power(scenario: Scenario, text: str) -> bool:
    """Whether an expression names the energy, and no robot's is measured."""
    return _ENERGY.search(text) is not None and not are_metered(scenario)

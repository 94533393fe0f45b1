"""The quantities that the monitor offers to a scenario's expressions."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

from desim.scenario.robot_types import are_metered
from desim.scenario.schema.experiment import ENERGY, OF_COMPUTERS, QUANTITIES
from desim.scenario.schema.scenario import Scenario

ROBOTS = "robots"  # of a cost, beside the others: their number
# The columns of samples.parquet beside the quantities; ``bytes_per_s`` stands for all topics'.
ALWAYS = ("time_s", "cause")
_SAMPLED = ("parts", "map_age_s", "stale_age_s", "registry_divergence", "ghosts",
            "matched_pairs", "cpu_percent", "node_cpu_percent", "ram_mb", "ram_percent", "rx_kBps",
            "tx_kBps", "bytes_per_s")
ROBOTS_TABLE = "robots"  # the rows of robots.parquet

_WORD = re.compile(r"\w+")


def quantities(scenario: Scenario, of_task: Sequence[str]) -> tuple[str, ...]:
    """The quantities of every run, those of power and computers where they are measured, and those
    of its task."""
    return (*QUANTITIES, *((ENERGY,) if are_metered(scenario) else ()),
            *(OF_COMPUTERS if _get_busy(scenario) else ()), *of_task)


def measurements(of_task: Sequence[str]) -> tuple[str, ...]:
    """The names of what may have a period of its own, whether or not a run measures it."""
    names = (*QUANTITIES, ENERGY, *OF_COMPUTERS, *of_task, *_SAMPLED, ROBOTS_TABLE)
    return tuple(dict.fromkeys(name for name in names if name not in ALWAYS))


def in_order(columns: Collection[str], of_task: Sequence[str]) -> list[str]:
    """The ``columns`` of samples.parquet, in the order in which they stand there."""
    known = [ALWAYS[0], *(name for name in measurements(of_task) if name in columns)]
    return [*known, *(name for name in columns if name not in (*known, *ALWAYS)), ALWAYS[1]]


def not_measured(scenario: Scenario, text: str) -> str:
    """A complaint of an expression about what ``scenario`` does not measure; empty without any."""
    named = set(_WORD.findall(text))
    if ENERGY in named and not are_metered(scenario):
        return (f"{ENERGY} is measured where robot.power says what robots draw, e.g. {{}} (a "
                "Pioneer 3-DX)")
    busy = [name for name in OF_COMPUTERS if name in named]
    if busy and not _get_busy(scenario):
        return f"{busy[0]} is measured where computers get busy, e.g. computers: measured"
    return ""


def _get_busy(scenario: Scenario) -> bool:
    return scenario.computers.model != "ideal"

"""The experiment family: the task, stop conditions, measurements, what is kept."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from desim.ports import Params
from desim.scenario.schema.communication import PluginChoice
from desim.units import Pace, Period, Ratio

# What the monitor offers to expressions.
QUANTITIES = (
    "time_s", "explored", "explored_union", "explored_all", "collisions", "recoveries",
    "messages_sent", "messages_delivered", "messages_dropped", "bytes_on_air", "distance_m",
    "partitions", "robots_moving",
)

ENERGY = "energy_j"  # beside these, where the robots' power is given
# Where computers get busy: of all robots so far; memory in use now, a mean over them; loads of the
# busiest host in the last 5 s.
OF_COMPUTERS = ("cpu_s", "missed_ticks", "ram_mb", "memory_kills", "max_cpu_percent",
                "max_ram_percent")


class TaskChoice(PluginChoice):
    """The task of the fleet."""

    kind, name_key = "task", "model"

    model: str = Field("exploration", description=(
        "a task plug-in: exploration, patrolling, coverage, search, pursuit, formation, delivery, "
        "journeys, none (the paper: exploration; without robots: none)"))


class Stop(Params):
    """The conditions that end the run: whichever holds first."""

    explored: Ratio = Field("99 %", gt=0, description=(
        "of the task exploration: share of the reachable free cells that some robot's own belief "
        "knows (the paper)"))
    by: Literal["any", "union", "all", "none"] = Field("any", description=(
        "of exploration: whose knowledge counts: any one robot's (the paper), the union, all "
        "robots', or none: exploration does not end the run"))
    elapsed_ns: Period = Field("2000 s", description="(the paper)")
    when: str | None = Field(None, description=(
        "an expression over the monitor's quantities, e.g. 'explored > 0.9 and collisions == 0' "
        "(what divides by zero is neither true nor false: docs/scenarios.md), or a function "
        "'package.module:function' of a mapping of them"))


class Measure(Params):
    """The samples that the monitor takes."""

    every_ns: Pace = Field("5 s", description="period of samples (the paper's robot log)")
    periods: dict[str, Pace] = Field({}, description=(
        "periods of single measurements in its place, by column of samples.parquet: {cpu_percent: "
        "1 s}; bytes_per_s: of all topics; robots: rows of robots.parquet, whole seconds (1 s)"))
    on: tuple[Literal["explored_10pct", "collision", "recovery", "partition"], ...] = Field(
        (), description="events that also cause a sample")
    when: tuple[str, ...] = Field((), description=(
        "expressions over the monitor's quantities, e.g. 'explored > 0.5': each causes a sample "
        "when it becomes true"))
    cost: str = Field("distance_m", min_length=1, description=(
        "the cost of the paper's equations 1 and 2, an expression over the monitor's quantities "
        "and robots, their number, e.g. 'energy_j' or '5 * robots + 0.1 * distance_m' (the ways "
        "of all robots: the paper)"))
    safety_scale: int = Field(100, ge=1, description=(
        "S of the paper's equation 3, safety = 1 - collisions / S (the paper leaves it open)"))


class TraceParams(Params):
    """The rows that are kept of the trace; the digest is the same either way."""

    keep: Literal["none", "messages", "replay", "all"] = Field("replay", description=(
        "none; messages: one row a message between hosts; replay: also what desim view shows; all: "
        "every trace row too"))
    ledger: bool = Field(False, description=(
        "keep the parts of each message's time, in ledger.parquet; without it desim why makes the "
        "run again"))

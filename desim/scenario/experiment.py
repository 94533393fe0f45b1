"""The experiment family: stop conditions, measurements, what is kept."""

from __future__ import annotations

from pydantic import Field

from desim.ports import Params
from desim.units import Duration, Ratio


class Stop(Params):
    """When the run ends: whichever comes first."""

    explored: Ratio = Field("99 %", description="share of the reachable free cells that some "
                                                "robot's own belief knows (the paper)")
    by: str = Field("any", pattern="^(any|union|all)$",
                    description="whose knowledge counts: any one robot's (the paper), the union, "
                                "or all robots'")
    elapsed_ns: Duration = Field("2000 s", description="(the paper)")
    when: str | None = Field(None, description="an expression over the monitor's quantities, e.g. "
                                               "'explored > 0.9 and collisions == 0'")


class Measure(Params):
    """What the monitor samples."""

    every_ns: Duration = Field("5 s", description="period of samples (the paper's robot log)")
    on: list[str] = Field([], description="events that also cause a sample: explored_10pct, "
                                          "collision, recovery, partition")


class TraceParams(Params):
    """What is kept of the trace; the digest is the same either way."""

    keep: str = Field("messages", pattern="^(none|messages|all)$",
                      description="none; messages: one row a message between hosts; all: every "
                                  "trace row too")

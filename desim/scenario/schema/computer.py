"""The computer of a robot or of a stationary host."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from desim.ports import Params
from desim.units import ByteSize, Period


class ComputerParams(Params):
    """A host's processors and memory. They have no effect where ``computers`` is ideal."""

    processors: int = Field(2, ge=1, le=1024, description=(
        "a callback uses one of them (the paper, with four robots on a node of eight)"))
    speed: float = Field(1.0, gt=0, le=1000, description=(
        "of a processor; at 1, callbacks take as long as the cost model says"))
    scheduling: Literal["processor_sharing", "fixed_priority", "fifo"] = Field(
        "processor_sharing", description=(
            "of nodes, if more are ready than there are processors: equal shares (Linux's "
            "default); fixed_priority: the highest of priorities, preemptive; fifo: in order of "
            "arrival, each until it is done"))
    priorities: dict[str, int] = Field({}, description=(
        "of nodes by name, with fixed_priority; the highest first (a node without one: 0)"))
    memory_bytes: ByteSize | None = Field(None, gt=0, description=(
        "of the host: if its processes need more, its software dies (null: no limit)"))
    respawn_delay_ns: Period = Field("5 s", description=(
        "from the death of the software until it starts again with empty memory"))


class WorkstationComputer(ComputerParams):
    """The computer of testbed's simulator and monitor."""

    processors: int = Field(8, ge=1, le=1024, description=(
        "(as many as a node of the paper's cluster has; our assumption)"))

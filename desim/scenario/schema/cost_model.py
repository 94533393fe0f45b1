"""The cost model: the processor time of callbacks and messages, and the memory of processes."""

from __future__ import annotations

from pydantic import Field

from desim.scenario.schema.communication import PluginChoice


class ComputersChoice(PluginChoice):
    """The time that callbacks and messages take on the hosts' processors."""

    kind, name_key = "computers", "model"

    model: str = Field("ideal", description=(
        "a cost model: ideal, nothing takes time; measured, as real software was measured; table, "
        "costs that the scenario lists"))

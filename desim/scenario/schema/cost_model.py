"""The cost model: what callbacks and messages take of the hosts' processors."""

from __future__ import annotations

from pydantic import Field

from desim.scenario.schema.communication import PluginChoice


class ComputersChoice(PluginChoice):
    """The time that callbacks and messages take on the hosts' processors."""

    kind, name_key = "computers", "model"

    model: str = Field("ideal", description=(
        "a cost model: ideal, callbacks take no time; measured, as real software was measured; "
        "table, as its keys say"))

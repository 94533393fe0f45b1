"""The communication family: media, rules, middleware, coordination, exchange of maps."""

from __future__ import annotations

from typing import Any

from pydantic import ConfigDict, Field

from desim.ports import Params
from desim.units import Duration, Position


class PluginChoice(Params):
    """A plug-in by name, with its own parameters beside the name."""

    model_config = ConfigDict(extra="allow")

    def parameters(self) -> dict[str, Any]:
        """The keys that belong to the plug-in."""
        return dict(self.model_extra or {})


class RuleChoice(PluginChoice):
    """One rule in front of a medium."""

    rule: str


class Medium(PluginChoice):
    """One medium: a network model with its parameters, and the rules in front of it."""

    model: str = Field(description="a network plug-in: ideal, disk, link, switch, ...")
    rules: list[RuleChoice] = []


class Network(Params):
    """The media by name. Default: in testbed one switched Gigabit LAN called ``lan``, in field one
    ``air`` of 200 m range (the paper)."""

    media: dict[str, Medium] = {}


class MiddlewareChoice(PluginChoice):
    """Who may talk to whom."""

    model: str = "direct"


class Exchange(Params):
    """How robots share their maps."""

    content: str | None = Field(None, pattern="^(full|changed_tiles)$",
                                description="full grids, or the tiles that changed since the last "
                                            "message (default: full in testbed, changed_tiles in "
                                            "field)")
    encoding: str | None = Field(None, pattern="^(raw|zlib)$",
                                 description="default: raw in testbed, zlib in field")
    period_ns: Duration = Field("5 s", description="(gmapping map_update_interval)")
    via: str = Field("unicast", pattern="^(unicast|broadcast)$")


class Coordination(PluginChoice):
    """Goal choice and map sharing."""

    strategy: str = "nearest_frontier"
    exchange: Exchange | None = Field(default_factory=Exchange,
                                      description="null: robots share nothing")


class StationaryHost(Params):
    """A computer without a body: a base station, a central coordinator."""

    at_m: tuple[Position, Position] | None = Field(None, description="where it stands; a host "
                                                                   "without a place is in reach "
                                                                   "of everybody")
    monitor: bool = Field(False, description="it receives each robot's map and distance at 1 Hz")


class Fault(Params):
    """A host stops, and starts again with empty memory."""

    at_ns: Duration
    host: str
    down_for_ns: Duration | None = Field(None, description="null: for good")

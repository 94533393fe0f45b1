"""The communication family: media, rules, middleware, coordination, exchange of maps."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field

from desim.ports import Params
from desim.units import Duration, Pace, Period, Position

Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]  # as ROS names are


class PluginChoice(Params):
    """A plug-in by name, with its own parameters beside the name."""

    model_config = ConfigDict(extra="allow")

    def parameters(self) -> dict[str, Any]:
        """The keys that belong to the plug-in; in a loaded scenario all of them, as text with
        units: ``Plugin.Params(**choice.parameters())``."""
        return dict(self.model_extra or {})


class RuleChoice(PluginChoice):
    """One rule in front of a medium."""

    rule: str = Field(description="a rule plug-in: range, latency, loss, bandwidth, partition, ...")


class Medium(PluginChoice):
    """One medium: a network model with its parameters, and the rules in front of it."""

    model: str = Field(description="a network plug-in: ideal, disk, link, switch, radio, ...")
    rules: tuple[RuleChoice, ...] = Field((), description="asked in this order")
    hosts: tuple[str, ...] | None = Field(None, min_length=2, description="who is attached to it "
                                                                          "(null: all)")


class Network(Params):
    """What carries the messages."""

    fidelity: Literal["ideal", "disk", "walls", "mac", "multihop"] | None = Field(
        None, description="of every medium whose model has this parameter, as radio has, in place "
                          "of what it says itself; one of them must have it (null: as they say)")
    media: dict[Name, Medium] = Field({}, description=(
        "media by name; two hosts take the first by name that both are attached to (default: in "
        "testbed one switched Gigabit LAN called lan, in field one air of 200 m range; the paper. "
        "In field with a fidelity: one air of radios)"))


class MiddlewareChoice(PluginChoice):
    """Who may talk to whom."""

    model: str = Field("direct", description="a middleware plug-in")


class Exchange(Params):
    """How robots share their maps."""

    content: Literal["full", "changed_tiles"] | None = Field(None, description=(
        "full grids, or the tiles that changed since the last message (default: full in testbed, "
        "the paper; changed_tiles in field)"))
    encoding: Literal["raw", "zlib"] | None = Field(None, description=(
        "(default: raw in testbed, the paper; zlib in field)"))
    period_ns: Pace = Field("5 s", description="(gmapping map_update_interval)")
    via: Literal["unicast", "broadcast"] = Field("unicast", description="(the paper: TCPROS)")


class Coordination(PluginChoice):
    """Goal choice and map sharing."""

    strategy: str = Field("nearest_frontier", description="a strategy plug-in (Yamauchi 1998)")
    exchange: Exchange | None = Field(default_factory=Exchange,
                                      description="null: robots share nothing")


class StationaryHost(Params):
    """A computer without a body: a base station, a central coordinator."""

    at_m: tuple[Position, Position] | None = Field(None, description=(
        "where it stands; a host without a place is in reach of everybody"))
    monitor: bool = Field(False, description="it receives each robot's map and distance at 1 Hz")


class Fault(Params):
    """A host stops, and starts again with empty memory."""

    at_ns: Duration = Field(description="when it stops")
    host: str = Field(description="a robot, one of hosts, or in testbed the workstation")
    down_for_ns: Period | None = Field(None, description="null: for good")

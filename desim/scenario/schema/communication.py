"""The communication family: media, rules, middleware, coordination, exchange of maps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, ClassVar, Literal, Self

from pydantic import (
    ConfigDict,
    Field,
    PrivateAttr,
    SerializationInfo,
    SerializerFunctionWrapHandler,
    model_serializer,
)

from desim.ports import Params
from desim.ports.antenna import Antenna
from desim.scenario.interrupts import interruptible
from desim.scenario.plugin_parameters import parse_parameters
from desim.scenario.schema.clock import ClockParams
from desim.scenario.schema.computer import ComputerParams
from desim.scenario.schema.shapes import BY_SHAPE
from desim.scenario.schema.sockets import Sockets
from desim.units import BitRate, ByteSize, Duration, Pace, Period, Position

Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]  # as ROS names are


class PluginChoice(Params):
    """A plug-in by name, with its own parameters beside the name.

    A scenario that was loaded has them parsed. A run's scenario that is read again has them as they
    are written, until somebody asks for ``params``.
    """

    model_config = ConfigDict(extra="allow")

    kind: ClassVar[str]  # of plug-in, as ``plugins`` calls it
    name_key: ClassVar[str]  # the key that has the plug-in's name

    _params: Params | None = PrivateAttr(None)

    @property
    def plugin(self) -> str:
        """The plug-in's name."""
        return getattr(self, self.name_key)

    @property
    def written(self) -> dict[str, object]:
        """The plug-in's parameters as text with units, until they are parsed."""
        return dict(self.model_extra or {})

    @property
    def params(self) -> Params:
        """The plug-in's parameters, an instance of its class ``Params``. Raises ``InputError``
        where the plug-in is not installed (any more)."""
        return self._params or parse_parameters(self.kind, self.plugin, self.written)

    def parsed(self) -> Self:
        """This choice with values in place of what was written."""
        choice = self.model_copy()
        choice._params = self.params
        (choice.model_extra or {}).clear()  # the copy's own
        return choice

    @model_serializer(mode="wrap")
    def _with_parameters(self, own: SerializerFunctionWrapHandler,
                         info: SerializationInfo) -> dict[str, object]:
        if self._params is None:
            return own(self)
        return {**own(self), **self._params.model_dump(mode=info.mode, by_alias=info.by_alias)}

    def __reduce__(self) -> tuple[Callable[..., PluginChoice], tuple[object, ...]]:
        # As text: a module that lies beside a scenario is found by the name that stands there.
        with interruptible():
            text = self.model_dump_json(by_alias=True)
        return _unpickled, (type(self), text, self._params is not None)


def _unpickled(choice: type[PluginChoice], text: str, parsed: bool) -> PluginChoice:
    written = choice.model_validate_json(text, strict=True)
    return written.parsed() if parsed else written


class RuleChoice(PluginChoice):
    """One rule in front of a medium."""

    kind, name_key = "rule", "rule"

    rule: str = Field(description="a rule plug-in: range, latency, loss, bandwidth, partition, ...")


class MediumChoice(PluginChoice):
    """One medium: a network model with its parameters, and the rules in front of it."""

    kind, name_key = "network", "model"

    model: str = Field(description="a network plug-in: ideal, disk, link, switch, radio, ...")
    rules: tuple[RuleChoice, ...] = Field((), description="asked in this order")
    hosts: tuple[str, ...] | None = Field(None, description=(
        "who is attached to it, at least two unless it is inside (null: all)"))
    inside: bool = Field(False, description=(
        "one of its own inside each robot that carries software, or inside each of hosts, between "
        "the nodes there: a bus of sensors; topics choose it"))
    metric: int = Field(0, ge=0, le=2**32 - 1, description=(
        "of its routes, as Linux has it: of the media that two hosts have in common they take that "
        "with the least, and of equal ones the first by name (NetworkManager: 100 for a cable, 600 "
        "for Wi-Fi)"))

    def parsed(self) -> Self:
        """The medium and its rules with values in place of what was written."""
        return super().parsed().model_copy(update={
            "rules": tuple(rule.parsed() for rule in self.rules)})


class Failover(Params):
    """The fallback to another medium where an interface has no carrier."""

    noticed_after_ns: Duration = Field("100 ms", description=(
        "a host notices that an interface of its own has lost its carrier, or has it back (bonding."
        "txt: a miimon of 100 ms is a good starting point)"))
    announce_every_ns: Pace | None = Field("1 s", description=(
        "while an interface has no carrier its host tells all others, at once and so often (our "
        "choice; null: never, as with Linux's static routes alone)"))


class Network(Params):
    """The media that carry the messages."""

    fidelity: Literal["ideal", "disk", "walls", "mac", "multihop"] | None = Field(
        None, description="overrides this parameter of every medium whose model has it, as radio "
                          "has; at least one must have it (null: each medium keeps its own)")
    media: dict[Name, MediumChoice] = Field({}, description=(
        "media by name; two hosts use that of the least metric among those that both are attached "
        "to, then the first by name (default: in testbed one switched Gigabit LAN called lan, the "
        "paper; in field one air, {model: radio, card: pi_4, preset: indoor}: a robot of 2020 to "
        "2024, docs/defaults.md)"))
    others: dict[Name, OtherHost] = Field({}, description=(
        "hosts outside of the fleet, by name, which take no part in the middleware"))
    background: tuple[Background, ...] = Field((), description=(
        "background traffic: flows of packets from hosts outside of the fleet"))
    sockets: Sockets = Field(default_factory=Sockets)
    failover: Failover | None = Field(None, description=(
        "hosts take another medium while one has no carrier; the rules outage and flapping of "
        "hosts take a carrier away (null: hosts do not notice a missing carrier)"))


class OtherHost(Params):
    """A computer outside of the fleet, on its network. It runs no software of the fleet."""

    at_m: tuple[Position, Position] | None = Field(None, description=(
        "where it stands; without a place it is in reach of everybody on wires and with disk, and "
        "of nobody over radios"))
    antenna: Antenna = Field(default_factory=Antenna)


class Background(Params):
    """Packets of hosts outside of the fleet. On a wire they fill it and its queues, on a radio the
    air."""

    medium: str
    between: tuple[str, str] = Field(description=(
        "from one of network.others to another one, or to a host that is no robot's"))
    rate_bps: BitRate = Field(description="on the average, with all headers")
    size_bytes: ByteSize = Field("1518 B", ge=64, le=1518, description=(
        "of a packet, with all headers (a full one on Ethernet)"))
    pattern: Literal["poisson", "periodic", "on_off"] = Field("poisson", description=(
        "exponential times between packets, equal ones, or equal ones in exponential spells"))
    on_ns: Pace = Field("1 s", description="mean spell of on_off (our choice)")
    off_ns: Pace = Field("1 s", description="mean time between two spells (our choice)")
    start_ns: Duration = Field("0 ns", alias="from", description="when it begins")
    until_ns: Duration | None = Field(None, description="when it ends (null: never)")
    grain_ns: Duration = Field("1 ms", description=(
        "packets that are due within so long after another go with it as a train, which saves "
        "events (0 ns: each on its own)"))


class TopicChoice(Params):
    """The network of some topics."""

    medium: Annotated[str | tuple[str, ...], BY_SHAPE] = Field((), description=(
        "the medium of their messages, or several in order of preference: no other is taken (all, "
        "by metric)"))
    dscp: int = Field(0, ge=0, le=63, description=(
        "the mark of their packets, by which radios with QoS choose an access category: 8 (CS1) "
        "background, 34 (AF41) or 46 (EF) video, 48 (CS6) voice (0: best effort, as ROS sends)"))

    @property
    def media(self) -> tuple[str, ...]:
        """The names, in order of preference."""
        return (self.medium,) if isinstance(self.medium, str) else self.medium


class MiddlewareChoice(PluginChoice):
    """The middleware, which decides who may talk to whom."""

    kind, name_key = "middleware", "model"

    model: str = Field("direct", description="a middleware plug-in")


class Exchange(PluginChoice):
    """The sharing of maps between robots."""

    kind, name_key = "sharing", "model"

    model: str = Field("own_maps", description=(
        "a sharing plug-in: own_maps, mrs_testbed, frontiers, scans, submaps, relayed; "
        "registered_maps: starts are unknown"))
    fusion: Literal["evidence", "max", "greedy"] | None = Field(None, description=(
        "one map of several sources: their sum, the stronger statement, or the first that knows a "
        "cell, its own first (default: as the plug-in says, greedy of mrs_testbed, else evidence)"))


class TeamStateParams(Params):
    """The announcement of poses and goals within a team."""

    period_ns: Pace = Field("1 s", description="(as the monitor's map and distance, the paper)")
    via: Literal["unicast", "broadcast"] = Field("unicast", description="(the paper: TCPROS)")
    transport: Literal["stream", "datagram"] = Field("stream", description=(
        "(the paper: TCPROS; a broadcast is always by datagram)"))


class StrategyChoice(PluginChoice):
    """A strategy with its parameters."""

    kind, name_key = "strategy", "strategy"

    strategy: str = Field("nearest_frontier", description="a strategy plug-in (Yamauchi 1998)")


class Coordination(StrategyChoice):
    """Goal choice and map sharing."""

    exchange: Exchange | None = Field(default_factory=Exchange,
                                      description="null: robots share nothing")
    team_state: TeamStateParams | None = Field(None, description=(
        "poses and goals for teammates, beside those that come with maps (default: every second "
        "where the strategy or a local planner reads them, else null)"))
    lost_after_ns: Period = Field("30 s", description=(
        "a teammate that was not heard of for so long counts as lost (six periods of the exchange)"
        ))

    def parsed(self) -> Self:
        """The strategy and the sharing with values in place of what was written."""
        choice = super().parsed()
        return choice if self.exchange is None else choice.model_copy(
            update={"exchange": self.exchange.parsed()})


class StationaryHost(Params):
    """A computer without a body: a base station, a central coordinator."""

    at_m: tuple[Position, Position] | None = Field(None, description=(
        "where it stands; without a place it is in reach of everybody on wires and with disk, and "
        "of nobody over radios"))
    antenna: Antenna = Field(default_factory=Antenna)
    computer: ComputerParams = Field(default_factory=ComputerParams)
    clock: ClockParams | None = Field(None, description="(null: it shows the true time)")
    monitor: bool = Field(False, description="it receives each robot's map and distance at 1 Hz")
    forwards: tuple[str, ...] = Field((), description=(
        "media between which it forwards frames (IP forwarding with static routes)"))
    strategy: StrategyChoice | None = Field(None, description=(
        "a strategy that runs here: a central coordinator, which receives the robots' maps"))

    def parsed(self) -> Self:
        """The host with the values of its strategy's parameters in place of what was written."""
        return self if self.strategy is None else self.model_copy(
            update={"strategy": self.strategy.parsed()})


class Fault(Params):
    """A host or its software stops, and starts again with empty memory; or a robot is stuck."""

    kind: Literal["stop", "software", "stuck"] = Field("stop", description=(
        "stop: the host stops, and starts again with empty memory | software: the same of its "
        "programs alone, whose computer stays with its access point | stuck: the drive of a robot "
        "is blocked: it brakes and stands, and its software goes on"))
    at_ns: Duration = Field(description="when it begins")
    host: str = Field(description=(
        "a robot, or for a stop one of hosts, in testbed the workstation, or an access point"))
    down_for_ns: Period | None = Field(None, description="how long it lasts; null: for good")

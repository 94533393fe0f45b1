"""The parameters of ROS 1 client libraries and masters."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, NamedTuple

from pydantic import Field, model_validator

from desim import ports
from desim.middleware.tcp import TcpParams
from desim.units import NS_PER_S, Duration, Pace, Period


class RosConstants(ports.Constants):
    """The constants of roscpp and rosmaster."""

    ascending = ("reconnect_first_ns", "reconnect_most_ns"),

    master_retry_ns: Pace = Field("50 ms", description=(
        "a registration that failed is tried again after (roscpp 50 ms, master.cpp; rospy 200 ms, "
        "registration.py)"))
    reconnect_first_ns: Pace = Field("0.1 s", description=(
        "a link that broke is tried again after (roscpp 0.1 s, transport_publisher_link.cpp); "
        "rospy asks then, where it did not reach the publisher, whether that still is one (1 s, "
        "tcpros_pubsub.py)"))
    reconnect_most_ns: Pace = Field("20 s", description=(
        "longest time between two such tries, to which they double (roscpp 20 s)"))
    connect_timeout_ns: Period | None = Field(None, description=(
        "patience with a connection and with requestTopic (null: TCP's; roscpp null, rospy 60 s, "
        "tcpros_pubsub.py, masterslave.py)"))
    poll_ns: Duration = Field("100 ms", description=(
        "rounds of a roscpp process between which it sends requestTopic, and looks whether that "
        "has been answered (xmlrpc_manager.cpp server_.work; rospy 0 s: at once)"))
    parameters: int = Field(5, ge=0, le=1000, description=(
        "parameters that a roscpp process asks its master for, one after another, before it "
        "registers a subscription (statistics.cpp; rospy 0)"))
    start_ns: Duration = Field("10 ms", description=(
        "the first round of a process begins up to so long before its nodes (ours, for hosts that "
        "start in one instant)"))
    workers: int = Field(3, ge=1, le=1000, description=(
        "threads that tell subscribers of new publishers (rosmaster master_api.py)"))
    worker_poll_ns: Duration = Field("100 ms", description=(
        "how often each of them looks whether there is something to tell, when it had nothing to "
        "do (rosmaster threadpool.py)"))
    local_call_ns: Duration = Field("1 ms", description=(
        "an XML-RPC call within a host (ours)"))


class Retries(NamedTuple):
    """The schedule of new tries: after ``first_ns``, then after times that double up to
    ``most_ns``, if the failure had one of these ``reasons`` (None: any)."""

    first_ns: int
    most_ns: int
    reasons: tuple[str, ...] | None

    def after(self, period_ns: int) -> int:
        """The time to wait after a wait of ``period_ns`` (0: the first time)."""
        return min(2 * period_ns, self.most_ns) if period_ns else self.first_ns

    def covers(self, reason: str | None) -> bool:
        """Whether a failure for ``reason`` is tried again."""
        return self.reasons is None or reason in self.reasons


CLIENTS: dict[str, ports.Preset] = {"rospy": {"constants": {
    "master_retry": "200 ms", "reconnect_first": "1 s", "connect_timeout": "60 s", "poll": "0 s",
    "parameters": 0}}}
# ENETUNREACH, ETIMEDOUT, EHOSTUNREACH and the like, after which rospy does not close a link at once
# (tcpros_base.py, connect).
UNREACHED = ("timeout", "unreachable")


class RosParams(ports.Params):
    """The parameters of all ROS 1 middleware. Each host's nodes are one process with one address,
    as nodelets are: its calls to the master are made one after another, and no callback waits for
    them."""

    client: Literal["roscpp", "rospy"] = Field("roscpp", description=(
        "whose schedules: that of C++ or of Python nodes (noetic)"))
    polling_ns: Pace | None = Field(None, description=(
        "each process asks a master on another host for all published topics so often, as "
        "yzrobot/map_merging does ten times a second (null: never)"))
    polled_topics: int | None = Field(None, ge=0, le=1000, description=(
        "that its answer has for each polling process (20 on a robot of the paper's; null: those "
        "that are registered)"))
    tcp_nodelay: bool = Field(False, description=(
        "subscribers ask for links without Nagle's algorithm (roscpp default)"))
    tcp: TcpParams = Field(default_factory=TcpParams, description="see docs/middleware/tcp.md")
    constants: RosConstants = Field(default_factory=RosConstants, description=(
        "(those of the client's library and of rosmaster)"))

    @property
    def connections(self) -> Retries:
        """The new tries of a connection of TCPROS: roscpp's, rospy makes none."""
        return Retries(self.constants.reconnect_first_ns, self.constants.reconnect_most_ns, None)

    @property
    def requests(self) -> Retries | None:
        """The new tries of requestTopic; None: it is not tried again."""
        if self.client != "rospy":
            return None
        return Retries(NS_PER_S, 32 * NS_PER_S, (*UNREACHED, "reset", "fin"))

    def without_effect(self, scenario: object) -> Iterator[ports.UnusedKeys]:
        """See ``ports.KnowsUnusedKeys``."""
        if self.polling_ns is None:
            yield ports.UnusedKeys(ports.changed_keys(self, "polled_topics"),
                                   "middleware.polling is null")

    @model_validator(mode="before")
    @classmethod
    def _of_client(cls, given: object) -> object:
        return ports.with_preset(given, "client", "roscpp", CLIENTS)

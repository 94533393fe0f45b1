"""What ROS 1 client libraries and masters do when, as parameters."""

from __future__ import annotations

from typing import Literal, NamedTuple

from pydantic import Field, model_validator

from desim import ports
from desim.middleware.tcp import TcpParams
from desim.middleware.tcp.parameters import in_order
from desim.units import Duration, Pace, Period


class Retries(NamedTuple):
    """Try again after ``first_ns``, then after times that double up to ``most_ns``, when what
    failed did so for one of these ``reasons`` (None: for any)."""

    first_ns: int
    most_ns: int
    reasons: tuple[str, ...] | None

    def after(self, period_ns: int) -> int:
        """How long to wait when the last time it was ``period_ns`` (0: the first time)."""
        return min(2 * period_ns, self.most_ns) if period_ns else self.first_ns


# What rospy tries again: ENETUNREACH, ETIMEDOUT, EHOSTUNREACH and the like, but no refusal and no
# reset (tcpros_base.py).
_UNREACHED = ("timeout", "unreachable")


class RosParams(ports.Params):
    """Of all ROS 1 middleware. Each host's nodes are one process with one address, as nodelets are:
    its calls to the master are made one after another, and no callback waits for them."""

    client: Literal["roscpp", "rospy"] = Field("roscpp", description=(
        "whose schedules: that of C++ or of Python nodes (noetic)"))
    master_retry_ns: Pace | None = Field(None, description=(
        "a registration that failed is tried again after (null: 50 ms in roscpp, master.cpp; "
        "200 ms in rospy, registration.py)"))
    reconnect_first_ns: Pace | None = Field(None, description=(
        "a link that broke is tried again after (null: 0.1 s in roscpp, "
        "transport_publisher_link.cpp; 1 s in rospy, tcpros_base.py)"))
    reconnect_most_ns: Pace | None = Field(None, description=(
        "longest time between two such tries, to which they double (null: 20 s in roscpp, 32 s "
        "in rospy)"))
    connect_timeout_ns: Period | None = Field(None, description=(
        "patience with a connection (null: TCP's in roscpp; 30 s in rospy, tcpros_base.py)"))
    poll_ns: Duration = Field("100 ms", description=(
        "rounds of a roscpp process between which it sends requestTopic, and looks whether that "
        "has been answered (xmlrpc_manager.cpp server_.work); 0 s: at once, as rospy does"))
    parameters: int = Field(5, ge=0, description=(
        "parameters that a roscpp process asks its master for, one after another, before it "
        "registers a subscription (statistics.cpp)"))
    start_ns: Duration = Field("10 ms", description=(
        "the first round of a process begins up to so long before its nodes (ours, for hosts that "
        "start in one instant)"))
    workers: int = Field(3, ge=1, description=(
        "threads that tell subscribers of new publishers (rosmaster master_api.py)"))
    worker_poll_ns: Duration = Field("100 ms", description=(
        "how often each of them looks whether there is something to tell, when it had nothing to "
        "do (rosmaster threadpool.py)"))
    local_call_ns: Duration = Field("1 ms", description=(
        "an XML-RPC call within a host (ours)"))
    tcp_nodelay: bool = Field(False, description=(
        "subscribers ask for links without Nagle's algorithm (roscpp default)"))
    tcp: TcpParams = Field(default_factory=TcpParams, description="see docs/middleware/tcp.md")

    @model_validator(mode="after")
    def _retries_in_order(self) -> RosParams:
        connections = schedules(self).connections
        in_order("reconnect_first", connections.first_ns, "reconnect_most", connections.most_ns)
        return self


class Schedules(NamedTuple):
    """The times that a client library keeps. ``requests``: of requestTopic (None: it is not tried
    again). ``asks``: calls before each subscription is registered."""

    client: str
    master_retry_ns: int
    connections: Retries
    connect_timeout_ns: int | None
    requests: Retries | None
    poll_ns: int
    start_ns: int
    asks: int
    nodelay: bool


_S = 1_000_000_000


def schedules(params: RosParams) -> Schedules:
    """Those of ``params.client``, with what ``params`` says in place of it."""
    if params.client == "roscpp":
        master_retry_ns, first_ns, most_ns, patience_ns = _S // 20, _S // 10, 20 * _S, None
        reasons, requests = None, None
    else:
        master_retry_ns, first_ns, most_ns, patience_ns = _S // 5, _S, 32 * _S, 30 * _S
        reasons, requests = _UNREACHED, Retries(_S, 32 * _S, (*_UNREACHED, "reset", "fin"))
    return Schedules(
        params.client, params.master_retry_ns or master_retry_ns,
        Retries(params.reconnect_first_ns or first_ns, params.reconnect_most_ns or most_ns,
                reasons),
        params.connect_timeout_ns or patience_ns, requests,
        params.poll_ns if params.client == "roscpp" else 0, params.start_ns,
        params.parameters if params.client == "roscpp" else 0, params.tcp_nodelay)

"""The constants of ROS 1 client libraries and masters, with their sources."""

from __future__ import annotations

from pydantic import Field, model_validator

from desim import ports
from desim.middleware.tcp.constants import in_order
from desim.units import Duration, Pace, Period


class RosConstants(ports.Constants):
    """The constants of roscpp and rosmaster."""

    master_retry_ns: Pace = Field("50 ms", description=(
        "a registration that failed is tried again after (roscpp 50 ms, master.cpp; rospy 200 ms, "
        "registration.py)"))
    reconnect_first_ns: Pace = Field("0.1 s", description=(
        "a link that broke is tried again after (roscpp 0.1 s, transport_publisher_link.cpp; "
        "rospy 1 s, tcpros_base.py)"))
    reconnect_most_ns: Pace = Field("20 s", description=(
        "longest time between two such tries, to which they double (roscpp 20 s, rospy 32 s)"))
    connect_timeout_ns: Period | None = Field(None, description=(
        "patience with a connection (null: TCP's; roscpp null, rospy 30 s, tcpros_base.py)"))
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

    @model_validator(mode="after")
    def _retries_in_order(self) -> RosConstants:
        in_order("reconnect_first", self.reconnect_first_ns, "reconnect_most",
                 self.reconnect_most_ns)
        return self

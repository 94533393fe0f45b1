"""The constants of multimaster_fkie, with their sources."""

from __future__ import annotations

from pydantic import Field

from desim.middleware.ros1.constants import RosConstants
from desim.units import Duration, Frequency, Pace, Period


class MultimasterConstants(RosConstants):
    """The constants of master_discovery and master_sync, beside those of ROS 1. Where no source is
    named it is master_discovery (noetic)."""

    heartbeat_hz: Frequency = Field("2 Hz", description=(
        "own heartbeats (groovy 2 Hz, fkie_1_3 0.02 Hz)"))
    rosmaster_hz: Frequency = Field("1 Hz", description=(
        "how often the own master is asked for changes, and the others are looked after "
        "(rosmaster_hz)"))
    measurement_intervals: int = Field(5, ge=1, le=10**6, description=(
        "heartbeats are counted over so many seconds, or periods if these are longer "
        "(measurement_intervals)"))
    timeout_factor: float = Field(1.4, gt=0, le=1e6, description=(
        "silence of so many times that long means offline (groovy 1.4, fkie_1_3 10)"))
    remove_after_ns: Period = Field("300 s", description=(
        "silence after which a master is forgotten (remove_after)"))
    active_request_after_ns: Duration = Field("0 s", description=(
        "silence after which a master with slow heartbeats is asked whether it is there; 0 s: "
        "never (groovy never, fkie_1_3 60 s)"))
    offline_after_requests: int = Field(5, ge=1, description=(
        "so many unanswered requests mean offline (OFFLINE_AFTER_REQUEST_COUNT)"))
    first_notifications: int = Field(3, ge=1, description=(
        "heartbeats with a request at the start, where they are slow, one each time that the own "
        "master is asked (INIT_NOTIFICATION_COUNT)"))
    contact_after_ns: Duration = Field("100 ms", description=(
        "from a first heartbeat to the call that asks its sender who it is"))
    contact_timeout_ns: Period = Field("10 s", description=(
        "patience with the answer (general knowledge: the default timeout of sockets in noetic)"))
    contact_retry_ns: Pace = Field("5 s", description="a failed call is made again after")
    unreachable_retry_ns: Pace = Field("30 s", description=(
        "the same where there is no way, EHOSTUNREACH"))
    start_jitter_ns: Duration = Field("1 s", description=(
        "discovery begins up to so long after its host (ours)"))
    sync_delay_ns: Duration = Field("2 s", description=(
        "a change is fetched after a time drawn between 0 s and this (sync_thread.py)"))
    sync_restarts: int = Field(5, ge=0, description=(
        "times that another change in the meantime has this time start anew (sync_thread.py)"))
    sync_timeout_ns: Period = Field("20 s", description=(
        "patience with a remote master's answer (sync_thread.py)"))
    sync_poll_ns: Pace = Field("30 s", description=(
        "how often it is looked whether something was left out (master_sync.py)"))
    resync_on_reconnect_timeout_ns: Duration = Field("0 s", description=(
        "only after it was offline for so long (master_sync.py)"))

"""The parameters of multimaster_fkie: as in the paper's time, or as it is now."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import Literal, NamedTuple

from pydantic import Field, model_validator

from desim import ports
from desim.middleware.ros1.parameters import RosConstants, RosParams
from desim.units import NS_PER_S, Duration, Frequency, Pace, Period


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


PRESETS: dict[str, ports.Preset] = {"fkie_1_3": {"constants": {
    "heartbeat": "0.02 Hz", "timeout_factor": 10, "active_request_after": "60 s"}}}


class MultimasterParams(RosParams):
    """The parameters of ``multimaster``.

    Presets are named after the version that was measured, multimaster_fkie 1.3.2: ``fkie_1_3`` is
    as ROS noetic ships it; ``fkie_1_3_groovy`` is the same with the heartbeats of groovy's time
    (heartbeat_hz 2, timeout_factor 1.4), for multimaster_fkie of groovy itself was not measured.
    """

    preset: Literal["fkie_1_3_groovy", "fkie_1_3"] = Field("fkie_1_3_groovy", description=(
        "heartbeats of multimaster_fkie 1.3 as in ROS groovy, the paper's time, or its own"))
    multicast: bool = Field(True, description="heartbeats are multicast (send_mcast)")
    robot_hosts: list[str] = Field([], description=(
        "hosts that get each heartbeat by unicast, too (none)"))
    leave: bool = Field(False, description=(
        "a host that stops says so by a last heartbeat, as discovery does when it is shut down "
        "(ours: a host fails)"))
    resync_on_reconnect: bool = Field(True, description=(
        "whoever comes back online is unregistered and registered anew (master_sync.py)"))
    ignore_topics: list[str] = Field([], description=(
        "names or patterns with * and ? of topics that are not copied (none)"))
    constants: MultimasterConstants = Field(default_factory=MultimasterConstants, description=(
        "(those of the preset, and of roscpp and rosmaster)"))

    def without_effect(self, scenario: object) -> Iterator[ports.UnusedKeys]:
        """See ``ports.KnowsUnusedKeys``."""
        yield ports.UnusedKeys(ports.changed_keys(self, "polling_ns", "polled_topics"),
                               "each process has its master on its own host")

    @model_validator(mode="before")
    @classmethod
    def _filled(cls, given: object) -> object:
        return ports.with_preset(given, "preset", "fkie_1_3_groovy", PRESETS)

    @model_validator(mode="after")
    def _is_visible(self) -> MultimasterParams:
        if not self.multicast and not self.robot_hosts:
            raise ValueError("nobody is found with multicast: false and no robot_hosts; name "
                             "hosts, or take multicast: true")
        return self


class DiscoveryTiming(NamedTuple):
    """The times of discovery. ``counted``: heartbeats are quick enough to be counted, at the rate
    that they announce; ``expected``: the number of them in a window."""

    heartbeat_ns: int
    counted: bool
    expected: float
    tick_ns: int
    window_ns: int
    timeout_ns: int


def timing(constants: MultimasterConstants) -> DiscoveryTiming:
    """The times that follow from ``constants``."""
    hz = constants.heartbeat_hz
    window_ns = int(constants.measurement_intervals * NS_PER_S / min(hz, Fraction(1)))
    announced_hz = Fraction(int(hz * 10), 10)  # as in the heartbeat: 0.02 Hz is 0
    # Slower heartbeats do not show who is there: MIN_HZ_FOR_QUALITY.
    return DiscoveryTiming(
        int(NS_PER_S / hz), announced_hz >= Fraction(3, 10),
        float(announced_hz * window_ns / NS_PER_S),
        int(NS_PER_S / constants.rosmaster_hz), window_ns,
        round(window_ns * constants.timeout_factor))

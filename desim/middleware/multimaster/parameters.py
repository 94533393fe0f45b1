"""The parameters of multimaster_fkie: as in the paper's time, or as it is now."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import Literal, NamedTuple

from pydantic import Field, model_validator

from desim import ports
from desim.middleware.multimaster.constants import MultimasterConstants
from desim.middleware.ros1.parameters import RosParams
from desim.units import NS_PER_S

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

"""The clock of a robot's computer, of a stationary host's, or of the workstation."""

from __future__ import annotations

from pydantic import Field

from desim.ports import Params
from desim.units import Drift, Duration, Period


class NtpParams(Params):
    """An NTP client."""

    server: str = Field(description="the host whose clock it follows")
    poll_ns: Period = Field("64 s", description="between two requests (ntpd minpoll 6)")


class ClockParams(Params):
    """The errors of a host's clock."""

    ahead_ns: Duration = Field("0 s", description="ahead of the true time at the start")
    behind_ns: Duration = Field("0 s", description="behind the true time at the start")
    spread_ns: Duration = Field("0 s", description=(
        "standard deviation of an offset that each host adds, drawn by its name"))
    drift_ppb: Drift = Field("0 ppm", description="error of its rate; below 0: too slow")
    drift_spread_ppb: Drift = Field("0 ppm", ge=0, description=(
        "standard deviation of a drift that each host adds (a PC's quartz: 10 to 50 ppm)"))
    ntp: NtpParams | None = Field(None, description=(
        "an NTP client that corrects the clock over the network (null: none)"))

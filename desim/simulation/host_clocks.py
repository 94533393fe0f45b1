"""The clocks of a scenario's hosts, and the NTP clients that correct them."""

from __future__ import annotations

from collections.abc import Sequence

from desim.middleware.clocks import HostClock
from desim.middleware.graph import Graph
from desim.middleware.ntp import NtpClient
from desim.scenario.schema.clock import ClockParams
from desim.simulation.deployment import HostPlan


def set_clocks(graph: Graph, plans: Sequence[HostPlan]) -> None:
    """Give each host of ``graph`` the clock of its plan; without one it shows the true time."""
    by_name = {host.name: host for host in graph.hosts}
    for plan in plans:
        if plan.clock is None:
            continue
        host = by_name[plan.name]
        host.clock = clock = _drawn(graph, plan.name, plan.clock)
        ntp = plan.clock.ntp
        if ntp is not None and ntp.server != plan.name:  # one robot may be the server of all
            NtpClient(graph, host.index, clock, by_name[ntp.server].index, ntp.poll_ns)


def _drawn(graph: Graph, name: str, params: ClockParams) -> HostClock:
    """The clock of the host called ``name``: one draw for its start, one for its rate."""
    ahead, drift = graph.streams("clock", name).standard_normal(2).tolist()
    return HostClock(
        params.ahead_ns - params.behind_ns + round(params.spread_ns * ahead),
        params.drift_ppb + round(params.drift_spread_ppb * drift))

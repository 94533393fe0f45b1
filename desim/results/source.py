"""The source of a replay, or of messages for ROS tools: a recording, or a running simulation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
import pyarrow as pa

from desim.monitor.map_growth import Life, MapGrowth
from desim.monitor.recorder import ShownPlan, StandingWall
from desim.results.recording import Event, LinkChange, Poses
from desim.results.seal import Json
from desim.scenario.schema.scenario import Scenario
from desim.simulation.deployment import HostPlan


class RunFacts(Protocol):
    """The words and figures of a run, as ``results.Run`` has them."""

    @property
    def scenario(self) -> Scenario:
        """Every value spelled out."""

    @property
    def manifest(self) -> Json:
        """Its status, digest and versions."""

    @property
    def metrics(self) -> Json:
        """The summary."""

    @property
    def robots(self) -> Mapping[str, np.ndarray]:
        """The columns of ``robots.parquet``."""

    @property
    def samples(self) -> Mapping[str, np.ndarray]:
        """The columns of ``samples.parquet``."""

    @property
    def ledger(self) -> pa.Table | None:
        """The parts of messages' times."""

    def has(self, name: str) -> bool:
        """Whether there is this file."""


class ReplaySource(Protocol):
    """All that is shown of a run from ``begin_ns`` to ``end_ns``, as ``results.Recording`` has
    it. Maps and walls are whole, or none; all else is of that time."""

    @property
    def run(self) -> RunFacts:
        """Its words and figures."""

    @property
    def begin_ns(self) -> int:
        """The first instant, a full second."""

    @property
    def end_ns(self) -> int:
        """The last instant."""

    @property
    def robots(self) -> Sequence[str]:
        """In the order of ``poses``."""

    @property
    def hosts(self) -> Sequence[HostPlan]:
        """In index order."""

    @property
    def poses(self) -> Poses:
        """The robots' true poses."""

    @property
    def moving_obstacles(self) -> np.ndarray:
        """[n, obstacles, 3] x, y, radius in mm at the instants of ``poses``."""

    @property
    def lives(self) -> Sequence[Life]:
        """The times at which the software of robots with maps ran: all until ``end_ns``, in the
        order of their starts."""

    @property
    def growths(self) -> Sequence[MapGrowth]:
        """The robots' maps."""

    @property
    def walls(self) -> Sequence[StandingWall]:
        """The terrain."""

    @property
    def plans(self) -> Sequence[ShownPlan]:
        """Plans, goals and frontiers, by time."""

    @property
    def events(self) -> Sequence[Event]:
        """The rare rows of the trace, by time."""

    @property
    def links(self) -> Sequence[LinkChange]:
        """The changes of links, by time."""

    @property
    def messages(self) -> pa.Table:
        """As ``messages.parquet`` has them."""

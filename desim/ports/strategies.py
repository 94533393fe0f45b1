"""The contract of a strategy: where a robot explores next."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, Protocol

import numpy as np

from desim.ports import parameters


class Frontier(NamedTuple):
    """A cluster of known free cells beside the unknown.

    ``x_m, y_m`` the cell to drive to | ``path_m`` length of the way there | ``cells`` its size.
    """

    x_m: float
    y_m: float
    path_m: float
    cells: int


class Pose2D(NamedTuple):
    """A robot's place on the plane, and its heading."""

    x_m: float
    y_m: float
    yaw_rad: float


class Peer(NamedTuple):
    """The last that this robot heard of another one."""

    x_m: float
    y_m: float
    yaw_rad: float
    heard_ns: int


class ExplorationView(Protocol):
    """All that a strategy knows: what this robot has sensed and received."""

    @property
    def name(self) -> str:
        """The robot's."""

    @property
    def now_ns(self) -> int:
        """The time."""

    @property
    def pose(self) -> Pose2D:
        """The robot's own, as localization has it."""

    @property
    def peers(self) -> Mapping[str, Peer]:
        """The other robots that it has heard of, by name."""

    def frontiers(self, limit: int | None = None) -> list[Frontier]:
        """Reachable frontiers, those with the shortest way first; ``limit`` ends the search early.
        Blacklisted ones are left out."""

    def stream(self, *name: str | int) -> np.random.Generator:
        """Random numbers by name, this robot's own."""


class Strategy(Protocol):
    """Decides where a robot explores next. Built as ``Strategy(params)``."""

    @property
    def Params(self) -> type[parameters.Params]:
        """The class of its parameters, inside the plug-in's class."""

    def choose(self, view: ExplorationView) -> Frontier | None:
        """The frontier to drive to, or None when there is nothing left to explore."""

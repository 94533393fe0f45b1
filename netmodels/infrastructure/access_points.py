"""Access points: where they stand, and the surroundings of a medium with them as further hosts."""

from __future__ import annotations

from collections.abc import Sequence
from operator import attrgetter

import numpy as np
from pydantic import Field

from desim import ports
from desim.errors import InputError
from desim.ports.antenna import Antenna, table
from desim.units import Length, Position
from netmodels.radio.standards import Standard

STOPPED = "access_point_down"  # the reason of what is lost at one that has stopped


class AccessPoint(Antenna):
    """An access point: a radio on a channel of its own, with a cable."""

    at_m: tuple[Position, Position] = Field(examples=[["3 m", "-2.5 m"]],
                                            description="where it stands, x and y")
    channel: int = Field(1, ge=1, le=196, description="its number (that of the radio)")
    height_m: Length = Field("2.5 m", description=(
        "of its antenna above the ground (our estimate: under the ceiling of a room)"))


def with_channels(given: object) -> object:
    """Parameters of a radio whose access points have its channel where they name none."""
    if not isinstance(given, dict) or not isinstance(given.get("channel"), int):
        return given
    points = given.get("access_points")
    if not isinstance(points, list | tuple):
        return given
    return {**given, "access_points": tuple(
        {"channel": given["channel"], **one} if isinstance(one, dict) else one for one in points)}


def names_of(access_points: Sequence[AccessPoint], hosts: tuple[str, ...]) -> tuple[str, ...]:
    """Their names, ``ap_0``, ``ap_1``, ... in the order in which they are given. Raises
    ``InputError`` where a host has one of them."""
    names = tuple(f"ap_{k}" for k in range(len(access_points)))
    for taken in sorted({*names} & {*hosts}):
        raise InputError(f".access_points: a host is called {taken}, as the access points are; "
                         "allowed: another name for the host")
    return names


def check_channels(access_points: Sequence[AccessPoint], standard: Standard) -> None:
    """Raises ``InputError`` for channels that the standard does not have, and for different ones
    that overlap."""
    for k, one in enumerate(access_points):
        if complaint := standard.no_channel(one.channel):
            raise InputError(f".access_points.{k}.channel: {complaint}")
        for j, other in enumerate(access_points[:k]):
            if allowed := standard.overlap(one.channel, standard, other.channel):
                raise InputError(
                    f".access_points.{k}.channel: {one.channel} overlaps channel {other.channel} "
                    f"of access point {j}, which this model knows nothing of; allowed: {allowed}")


class WithAccessPoints:
    """The surroundings of a medium, with its access points behind its hosts. The other members of
    ``ports.Context`` are those of the medium."""

    def __init__(self, context: ports.Context, access_points: Sequence[AccessPoint]) -> None:
        self._context = context
        self._at_m = np.array([one.at_m for one in access_points])
        self._hosts: np.ndarray | None = None
        self.antennas = ports.Antennas(*map(np.concatenate, zip(
            context.antennas, table(access_points), strict=True)))
        self.at, self.stream, self.shared = context.at, context.stream, context.shared
        self.flow, self.left, self.dscp = context.flow, context.left, context.dscp
        self.settle, self.settle_many = context.settle, context.settle_many

    judge_transmission = None  # rules judge frames from host to host
    now_ns = property(attrgetter("_context.now_ns"))
    obstacles = property(attrgetter("_context.obstacles"))

    def positions(self, time_ns: int) -> np.ndarray:
        """[hosts and access points, 2] m, the same array until a host moves."""
        hosts = self._context.positions(time_ns)
        if hosts is not self._hosts:
            self._hosts, self._places = hosts, np.concatenate([hosts, self._at_m])
            self._places.flags.writeable = False
        return self._places

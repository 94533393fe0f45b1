"""The contracts of networks: a network model, a rule in front of it, and what both may ask.

``capabilities.py`` has what either *may* have besides.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol, TypeVar

import numpy as np

from desim.ports import parameters
from desim.ports.frames import Deliver, Drop, Frame, Verdict

T = TypeVar("T")


@dataclass(frozen=True)
class Obstacles:
    """Everything that stands between antennas, at one geometry epoch. The arrays are read-only.

    ``segments`` [n, 4] x1 y1 x2 y2 in m | ``material`` [n] index into ``materials`` |
    ``thickness_m`` [n] | ``height_m`` [n]. ``epoch`` grows when a door moves. ``block`` [n] bool:
    True for a block's face, False for a wall; None: unknown.

    A wall counts once, whether it is drawn as a line or shown by a map as cells. A block is thicker
    than walls are (1 m); it counts where a line goes in and where it comes out.

    ``people`` [n, 4] x, y, radius, height in m as of the last tick, a new array after each; None:
    there are none.
    """

    segments: np.ndarray
    material: np.ndarray
    thickness_m: np.ndarray
    height_m: np.ndarray
    materials: tuple[str, ...]
    epoch: int
    crossing: Callable[[np.ndarray, np.ndarray], np.ndarray]
    block: np.ndarray | None = None
    toll: Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray], np.ndarray] | None = None
    people: np.ndarray | None = None

    def crossings(self, pairs: np.ndarray) -> np.ndarray:
        """Walls and faces of blocks that the straight lines ``pairs`` [k, 4] x1 y1 x2 y2 in m go
        through; of a wall of cells, the face at one end of the way through it.

        Returns [c, 2] rows (index of the pair, index of the segment), sorted.
        """
        return self.crossing(self.segments, pairs)

    def tolls(self, pairs: np.ndarray, cost: np.ndarray, most: np.ndarray) -> np.ndarray:
        """[k] the sums of ``cost`` [n], not negative, of the segments that the straight lines
        ``pairs`` [k, 4] go through. A sum above ``most`` [k] may leave some of them out, but stays
        above it: of lines through many walls it is soon clear that they cost too much."""
        if self.toll is not None:
            return self.toll(self.segments, pairs, cost, most)
        line, segment = self.crossings(pairs).T
        return np.bincount(line, cost[segment], len(pairs))

    def people_on(self, pairs: np.ndarray, heights_m: np.ndarray) -> np.ndarray:
        """[k] the number of people on the straight lines ``pairs`` [k, 4], which run between
        ``heights_m`` [k, 2] m; none where a place is NaN."""
        if self.people is None:
            return np.zeros(len(pairs), np.int64)
        x_m, y_m, radius_m, top_m = self.people.T
        along_x, along_y = (pairs[:, 2:] - pairs[:, :2]).T[:, :, None]
        to_x, to_y = x_m - pairs[:, :1], y_m - pairs[:, 1:2]
        with np.errstate(divide="ignore", invalid="ignore"):
            long_m = np.hypot(along_x, along_y)
            share = (to_x * along_x + to_y * along_y) / long_m ** 2
            aside_m = np.abs(to_x * along_y - to_y * along_x) / long_m
        high_m = heights_m[:, :1] + share * (heights_m[:, 1:] - heights_m[:, :1])
        on = (share > 0.0) & (share < 1.0) & (aside_m < radius_m) & (high_m < top_m)
        found: np.ndarray = on.sum(axis=1)
        return found


class Antennas(NamedTuple):
    """The antennas of all hosts: ``height_m`` [hosts] above the ground | ``gain_db`` [hosts], by
    which they send and receive better than those of the medium | ``power_dbm`` [hosts] sent, NaN:
    as the medium says. Read-only."""

    height_m: np.ndarray
    gain_db: np.ndarray
    power_dbm: np.ndarray

    @classmethod
    def plain(cls, hosts: int) -> Antennas:
        """Those of the medium, on the ground."""
        return cls(np.zeros(hosts), np.zeros(hosts), np.full(hosts, np.nan))


class Handle(Protocol):
    """A call that is booked."""

    def cancel(self) -> None:
        """Do not call. Cancelling twice, or too late, is harmless."""


class RuleContext(Protocol):
    """The knowledge of a rule: time, places, obstacles, random numbers."""

    @property
    def now_ns(self) -> int:
        """The time."""

    @property
    def obstacles(self) -> Obstacles:
        """The obstacles at the present geometry epoch."""

    @property
    def antennas(self) -> Antennas:
        """The antennas of the hosts, the same for a whole run."""

    def positions(self, time_ns: int) -> np.ndarray:
        """[hosts, 2] x, y in m of every host as of the last world tick at or before ``time_ns``.
        A host without a place has NaN, now and always. Read-only; the array is reused until a host
        moves."""

    def stream(self, *name: str | int) -> np.random.Generator:
        """Random numbers by name, this medium's own."""


class Context(RuleContext, Protocol):
    """All that a network model may know and do."""

    @property
    def judge_transmission(self) -> Callable[[Frame, int], Drop | None] | None:
        """For a model that ``Retransmits``: the verdict of the rules that are ``per_transmission``
        on a packet (a frame of its own, with the number of the one that it is of) at a receiver; it
        may drop for their reasons. None: there is no such rule."""

    @property
    def dscp(self) -> Callable[[Frame], int] | None:
        """The mark of a frame that is being sent now (differentiated services code point, RFC 2474,
        0 to 63). None: no frame of this medium has one."""

    def at(self, time_ns: int, fn: Callable[[T], object], arg: T | None = None) -> Handle:
        """Call ``fn(arg)`` at ``time_ns`` in phase NETWORK."""

    def shared(self, name: str, make: Callable[[], T]) -> T:
        """An object that all media of a run have in common under this name. The first who asks
        makes it."""

    def settle(self, frame: Frame, receiver: int, verdict: Deliver | Drop) -> None:
        """Settle ``frame`` at one intended receiver: exactly once each, after any number of drops
        that name packets."""

    def settle_many(self, frame: Frame, receivers: Sequence[int] | None,
                    verdict: Deliver | Drop) -> None:
        """Give ``frame`` the same fate at several receivers. ``receivers`` None: at all remaining
        receivers. The drops of a broadcast make one trace row a call."""

    def left(self, frame: Frame) -> None:
        """``frame`` has left its sender, whose socket has room again. Without this call it has when
        it is settled: for a model that carries frames on behind their senders."""

    def flow(self, frame: Frame) -> Hashable:
        """Equal for all frames of one connection, or of one socket to the same receivers; ``frame``
        is being sent now."""


class Rule(Protocol):
    """A small verdict in front of any network model. Rules are asked in their order; delays add
    up, and the first drop of a frame or of one of its packets wins. Rules have no timers: a rule
    judges, the medium acts.

    Built as ``Rule(params)`` with an instance of its ``Params``. A rule may also have the
    capabilities ``LimitsReach``, ``Separates``, ``JudgesTransmissions`` and ``PassesMany``.
    """

    @property
    def reasons(self) -> tuple[str, ...]:
        """The drop reasons that it may give; an attribute of the class."""

    @property
    def Params(self) -> type[parameters.Params]:
        """The class of its parameters, inside the plug-in's class."""

    def start(self, context: RuleContext, hosts: tuple[str, ...]) -> None:
        """Called once, before the first frame, with the names of the hosts in index order. Raises
        ``InputError`` for parameters that do not fit them; a line that begins with a dot and a
        path, ``.groups: ...``, points at that parameter."""

    def judge(self, frame: Frame, receivers: tuple[int, ...]) -> Sequence[Verdict] | None:
        """One verdict for each of ``receivers``, in their order; None: all of them pass."""


class NetworkModel(Protocol):
    """Decides each frame's arrival or loss at each intended receiver.

    Built as ``Model(params)`` with an instance of its ``Params``, or by another class (``Builds``).
    One host may send several frames in one instant: the model has to queue them. A model may also
    have any of the capabilities below.
    """

    @property
    def reasons(self) -> tuple[str, ...]:
        """The drop reasons that it may give; an attribute of the class."""

    @property
    def Params(self) -> type[parameters.Params]:
        """The class of its parameters, inside the plug-in's class."""

    def start(self, context: Context, hosts: tuple[str, ...]) -> None:
        """Called once, before the first frame, with the names of the hosts in index order. Raises
        ``InputError`` for parameters that do not fit them, as a rule's ``start`` does."""

    def send(self, frame: Frame) -> int | None:
        """Take ``frame``; settle it now or later, once for each of its receivers. Or return the
        delay in ns after which it arrives at all of them; this settles it too, and is the cheapest
        way."""

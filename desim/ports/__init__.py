"""The contracts: what a plug-in sees of desim, and what desim asks of a plug-in.

A network plug-in needs this module, ``desim.units`` and ``desim.errors``, and nothing else of
desim. Values here stay small: what a model wants to remember about a frame it keeps in a table of
its own, keyed by the frame's id.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_left
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any, ClassVar, NamedTuple, Protocol

import numpy as np
from pydantic import BaseModel, ConfigDict

_UNIT = re.compile(r"_(ns|bps|bytes|m|mps|mps2|rad|radps|radps2|hz|db|dbm)$")


def yaml_key(field: str) -> str:
    """``rate_bps`` to ``rate``: in YAML the unit stands in the value, in Python in the name."""
    return _UNIT.sub("", field)


class Params(BaseModel):
    """Base of every parameter block: frozen, unknown keys are errors, defaults are checked.

    A field's Python name carries its unit (``rate_bps``); its YAML key, and the keyword to
    construct it with, does not (``rate``). Its description ends with the default's source in
    parentheses.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, validate_default=True,
                              alias_generator=yaml_key, protected_namespaces=())


class BesideScenario:
    """Marks the path of a file: in a scenario it is relative to the file that names it, a plug-in
    gets it absolute. What the file contains belongs to a run's identity."""


File = Annotated[str, BesideScenario()]  # the type of a parameter


def natural_key(name: str) -> tuple:
    """Sorts ``robot_2`` before ``robot_10``: the order of host and robot indices."""
    return tuple((0, int(part), "") if part.isdecimal() else (1, 0, part)
                 for part in re.split(r"(\d+)", name) if part), name


# ---------------------------------------------------------------------------------------- network


class Frame(NamedTuple):
    """What occupies a medium: one packet, or a train of packets of one message on one hop.

    ``source`` and ``receivers`` (ascending) are host indices (rows of ``Context.positions``).
    ``size_bytes`` is the whole train with its headers, ``segments`` how many packets it is. A
    unicast frame has one receiver and ``broadcast`` False.
    """

    id: int
    source: int
    receivers: tuple[int, ...]
    size_bytes: int
    segments: int
    broadcast: bool

    def among(self, hosts: Iterable[int]) -> list[int]:
        """Those of ``hosts`` that are receivers, in their order."""
        receivers, source = self.receivers, self.source
        last = receivers[-1]
        if len(receivers) == last + (source > last):  # all up to the last, but the source itself
            return [host for host in hosts if 0 <= host <= last and host != source]
        return [host for host in hosts
                if host <= last and receivers[bisect_left(receivers, host)] == host]


FULL_PACKET_BYTES = 1500 + 14 + 4  # Ethernet's MTU, its header and its check sequence


@lru_cache(maxsize=1 << 10)
def packet_sizes(size_bytes: int, segments: int) -> tuple[int, ...]:
    """The bytes of each packet of a train: full ones and a rest where that fits, else as equal as
    can be."""
    rest = size_bytes - (segments - 1) * FULL_PACKET_BYTES
    if 0 < rest <= FULL_PACKET_BYTES:
        return (FULL_PACKET_BYTES,) * (segments - 1) + (rest,)
    each, longer = divmod(size_bytes, segments)
    return (each + 1,) * longer + (each,) * (segments - longer)


class Pass(NamedTuple):
    """A rule has nothing to say about this receiver."""


class Deliver(NamedTuple):
    """Delivered, ``delay_ns`` (int >= 0) from now. From a rule: that much later than the network
    model says; the delays of several rules add up."""

    delay_ns: int


class Drop(NamedTuple):
    """Not delivered, for one of the reasons that the plug-in's class declares.

    ``packets`` are the numbers (ints from 0, ascending) of those packets of a train that are lost;
    None: the whole frame. A rule takes them out, and the rest goes on. A model that names packets
    has not settled the frame yet: it delivers or drops the rest later; naming the last ones that
    are left settles it.
    """

    reason: str
    packets: tuple[int, ...] | None = None


class Duplicate(NamedTuple):
    """From a rule: where all of the frame is delivered, a copy is ``after_ns`` (int >= 0) later. A
    stream ignores it, a datagram's message arrives once more. Copies of several rules add up."""

    after_ns: int


PASS = Pass()
Verdict = Pass | Deliver | Drop | Duplicate


@dataclass(frozen=True)
class Obstacles:
    """What stands between antennas, at one geometry epoch. The arrays are read-only.

    ``segments`` [n, 4] x1 y1 x2 y2 in m | ``material`` [n] index into ``materials`` |
    ``thickness_m`` [n] | ``height_m`` [n]. ``epoch`` grows when a door moves. ``block`` [n] bool:
    the face of a block, not a wall (None: nobody knows).

    A wall counts once, drawn as a line or shown by a map as cells; a block, which is thicker than
    walls are (1 m), where a line goes in and where it comes out.
    """

    segments: np.ndarray
    material: np.ndarray
    thickness_m: np.ndarray
    height_m: np.ndarray
    materials: tuple[str, ...]
    epoch: int
    crossing: Callable[[np.ndarray, np.ndarray], np.ndarray]
    block: np.ndarray | None = None

    def crossings(self, pairs: np.ndarray) -> np.ndarray:
        """Which walls and faces of blocks the straight lines ``pairs`` [k, 4] x1 y1 x2 y2 in m go
        through; of a wall of cells the face at one end of the way through it.

        Returns [c, 2] rows (index of the pair, index of the segment), sorted.
        """
        return self.crossing(self.segments, pairs)


class Context(Protocol):
    """All that a network model or a rule may know and do."""

    now_ns: int
    obstacles: Obstacles

    def at(self, time_ns: int, fn: Callable[[Any], Any], arg: Any = None) -> Any:
        """Call ``fn(arg)`` at ``time_ns`` in phase NETWORK; the handle has ``cancel()``."""

    def positions(self, time_ns: int) -> np.ndarray:
        """[hosts, 2] x, y in m of every host as of the last world tick at or before ``time_ns``.
        A host without a place has NaN. Read-only, and the same object until somebody moves."""

    def stream(self, *name: str | int) -> np.random.Generator:
        """Random numbers by name, this medium's own."""

    def shared(self, name: str, make: Callable[[], Any]) -> Any:
        """What all media of a run have in common under this name; who asks first makes it."""

    judge_transmission: Callable[[Frame, int], Drop | None] | None
    """For a model that ``judges_transmissions``: what rules that are ``per_transmission`` say of a
    packet (a frame of its own) at a receiver; it may drop for their reasons. None: no such rule."""

    def settle(self, frame: Frame, receiver: int, verdict: Deliver | Drop) -> None:
        """The fate of ``frame`` at one intended receiver: exactly once each, after any number of
        drops that name packets."""

    def settle_many(self, frame: Frame, receivers: Sequence[int] | None,
                    verdict: Deliver | Drop) -> None:
        """The same fate for several receivers; None: for all at whom ``frame`` is not settled yet,
        who need not be named. A broadcast's drops make one aggregate row."""

    def flow(self, frame: Frame) -> Hashable:
        """Equal for what one connection, or one socket to the same receivers, sends; ``frame`` is
        being sent now."""


class Rule(Protocol):
    """A small verdict in front of any network model. Rules are asked in their order; delays add
    up, the first drop of a frame or of a packet of it wins. No timers: a rule judges, the medium
    acts.

    A rule that is ``per_transmission`` (True) is not asked about frames where the model repeats
    what is lost and ``judges_transmissions``, but about each transmission of a packet at its
    receiver. It drops or passes.

    Two things that a rule or a network model may have beside, for the monitor to count the fleet's
    partitions by: ``reach_m``, the distance in m beyond which no frame gets, and
    ``separates(host, other) -> bool``, whether no frame gets between two hosts now.

    ``start`` is called once, before the first frame, with the names of the hosts in index order.
    It raises ``InputError`` for parameters that do not fit them; a line that begins with a dot and
    a path, ``.groups: ...``, points at that parameter.
    """

    reasons: ClassVar[tuple[str, ...]]
    Params: ClassVar[type[Params]]

    def start(self, context: Context, hosts: tuple[str, ...]) -> None: ...

    def judge(self, frame: Frame, receivers: tuple[int, ...]) -> list[Verdict] | None:
        """One verdict for each of ``receivers``, in their order; None: all of them pass."""


class Signal(NamedTuple):
    """``power_dbm`` [n] received, and ``delivery`` [n], the share of full packets (1518 B with
    Ethernet's headers) that get through when each is sent once and nobody else is on the air."""

    power_dbm: np.ndarray
    delivery: np.ndarray


class NetworkModel(Protocol):
    """Decides each frame's fate at each intended receiver: when it arrives, or why it does not.

    ``reasons`` are the drop reasons it may give. Built as ``Model(params)`` with an instance of
    its ``Params``; ``start`` as a rule's. One host may send several frames in one instant: to queue
    them is the model's task. It may have ``reach_m`` and ``separates`` as a rule may,
    ``refuses``, those of its ``reasons`` for which ``send`` takes nothing of a frame for anybody,
    so that its bytes were never sent,
    ``judges_transmissions`` (True), if its MAC repeats what is lost and it asks
    ``Context.judge_transmission`` each time,
    ``attempts() -> (int, int)``: transmissions so far, and how many of them failed,
    ``control() -> (int, int)``: frames and bytes that its protocols have sent so far,
    ``busy_ns(hosts) -> Sequence[int]``: for how long so far each part of it was in use that is one
    thing at a time, the air around each of ``hosts`` (those attached to it, indices), each of their
    ports or the one cable,
    ``switched(host, up)``, which is called when a host starts or stops, all being up before, and
    ``signal(from_m, to_m) -> Signal``: what comes in now at ``to_m`` [n, 2] m of somebody who sends
    at ``from_m`` [2] m.
    """

    reasons: ClassVar[tuple[str, ...]]
    Params: ClassVar[type[Params]]

    def start(self, context: Context, hosts: tuple[str, ...]) -> None: ...

    def send(self, frame: Frame) -> int | None:
        """Take ``frame``; settle it now or later, once for each of its receivers. Or return after
        how many ns it is at all of them, which settles it, too, and costs the least."""


# ------------------------------------------------------------------------------------------ world


class Snapshot(NamedTuple):
    """The matter at one instant, immutable: what a lazily computed reading is computed from.

    ``poses`` [robots, 3] x m, y m, yaw rad (read-only) | ``geometry`` opaque to all but the world.
    """

    time_ns: int
    poses: np.ndarray
    geometry: Any


class World(Protocol):
    """Matter: terrain, bodies, sensors, collisions. Robots are indices in sorted-name order."""

    robots: tuple[str, ...]

    @classmethod
    def build(cls, scenario: Any, streams: Any) -> World:
        """The world at time 0 of a complete ``desim.scenario.schema.whole.Scenario`` whose paths
        are absolute. Luck comes from ``streams`` (``desim.engine.streams.Streams``) by name. Raises
        ``InputError`` whose lines begin with the path of what is wrong, e.g. ``fleet.start: ``."""

    def advance(self, to_ns: int) -> None:
        """Move everything to ``to_ns``: one kernel call for the whole fleet."""

    def body(self, robot: int) -> Any:
        """The robot's type: ``desim.scenario.schema.fleet.BodyType``."""

    def grid(self, resolution_m: float) -> GridSpec:
        """The raster for maps of this terrain."""

    def ground(self, spec: GridSpec, robots: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
        """The truth that maps are judged by, [height, width]: uint8, 0 where a cell is free; bool,
        the free cells that lasers can come to see from where ``robots`` stand."""

    def travelled_m(self) -> np.ndarray:
        """[robots] m, the true way that each has gone."""

    def command(self, robot: int, forward_mps: float, left_mps: float, turn_radps: float) -> None:
        """Set the velocity that ``robot`` shall have; its motors get it there."""

    def snapshot(self) -> Snapshot:
        """The present state; the same object until ``advance`` is called."""

    def snapshot_at(self, time_ns: int) -> Snapshot:
        """The state at ``time_ns``, at most a tick ahead, with poses carried on from the last
        tick."""

    def scan(self, snapshot: Snapshot, robots: np.ndarray, tick: int) -> np.ndarray:
        """[len(robots), beams] float32 ranges in m, with noise number ``tick`` of each laser."""

    def odometry(self, snapshot: Snapshot, robot: int, tick: int) -> np.ndarray:
        """[3] x m, y m, yaw rad as this robot's odometry reports reading number ``tick``."""

    def contacts(self) -> list[tuple[int, int]]:
        """Collision episodes that began since the last call: (robot, other robot or -1 for wall),
        sorted."""

    def obstacles(self) -> Obstacles:
        """What the network sees of the terrain, at the present epoch."""


class GridSpec(NamedTuple):
    """The raster that the fleet's maps and the ground truth share.

    Cell (col, row) covers [x_m + col * resolution_m, ... + resolution_m) in x, and row likewise in
    y: (x_m, y_m) is the lower left corner of cell (0, 0). Arrays over it are [height, width].
    """

    resolution_m: float
    width: int
    height: int
    x_m: float
    y_m: float

    def cell(self, x_m: float, y_m: float) -> tuple[int, int]:
        """(col, row) of the cell that holds the point; it may lie outside the raster."""
        return (math.floor((x_m - self.x_m) / self.resolution_m),
                math.floor((y_m - self.y_m) / self.resolution_m))

    def bounds(self) -> tuple[float, float, float, float]:
        """x0, y0, x1, y1 in m of the whole raster."""
        return (self.x_m, self.y_m, self.x_m + self.width * self.resolution_m,
                self.y_m + self.height * self.resolution_m)


# ----------------------------------------------------------------------------------------- robots


class Frontier(NamedTuple):
    """A cluster of known free cells beside the unknown.

    ``x_m, y_m`` the cell to drive to | ``path_m`` length of the way there | ``cells`` its size.
    """

    x_m: float
    y_m: float
    path_m: float
    cells: int


class Peer(NamedTuple):
    """What this robot last heard of another one."""

    x_m: float
    y_m: float
    yaw_rad: float
    heard_ns: int


class ExplorationView(Protocol):
    """What a strategy may look at: what this robot has sensed and received, nothing else."""

    name: str
    now_ns: int
    pose: tuple[float, float, float]  # x m, y m, yaw rad, as localization has it
    peers: dict[str, Peer]

    def frontiers(self, limit: int | None = None) -> list[Frontier]:
        """Reachable frontiers in order of the length of the way; ``limit`` ends the search early.
        Blacklisted ones are left out."""

    def stream(self, *name: str | int) -> np.random.Generator:
        """Random numbers by name, this robot's own."""


class Strategy(Protocol):
    """What a robot decides to explore next."""

    Params: ClassVar[type[Params]]

    def choose(self, view: ExplorationView) -> Frontier | None:
        """The frontier to drive to, or None when there is nothing left to explore."""

"""The contracts of networks: a network model, a rule in front of it, and what both may ask.

The small protocols at the end are capabilities: what a rule or a network model *may* have besides.
A class claims one by having its members; nobody has to name the protocol. desim asks once, when the
medium is made.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol, TypeVar, runtime_checkable

import numpy as np

from desim.ports import parameters
from desim.ports.frames import Deliver, Drop, Frame, Frames, Verdict
from desim.ports.time_parts import Ledger

T = TypeVar("T")


@dataclass(frozen=True)
class Obstacles:
    """Everything that stands between antennas, at one geometry epoch. The arrays are read-only.

    ``segments`` [n, 4] x1 y1 x2 y2 in m | ``material`` [n] index into ``materials`` |
    ``thickness_m`` [n] | ``height_m`` [n]. ``epoch`` grows when a door moves. ``block`` [n] bool:
    True for a block's face, False for a wall; None: unknown.

    A wall counts once, whether it is drawn as a line or shown by a map as cells. A block is thicker
    than walls are (1 m); it counts where a line goes in and where it comes out.
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


@runtime_checkable
class LimitsReach(Protocol):
    """A rule or a network model that lets no frame get farther than ``reach_m`` m. The monitor
    counts the fleet's partitions by it."""

    @property
    def reach_m(self) -> float:
        """A number of metres >= 0, known as soon as the object is made."""


@runtime_checkable
class Separates(Protocol):
    """A rule or a network model that knows between whom no frame gets now. The monitor counts the
    fleet's partitions by it."""

    def separates(self, host: int, other: int) -> bool:
        """Whether no frame gets from ``host`` to ``other`` now."""


@runtime_checkable
class CutsCarrier(Protocol):
    """A rule that takes the carrier from interfaces, as an unplugged cable does. Hosts notice that
    where they fall back to another medium (``network.failover``)."""

    def carrier(self, host: int) -> tuple[bool, int | None]:
        """Whether the interface of ``host`` has a carrier now, and when (ns) that changes next;
        None: never."""


@runtime_checkable
class JudgesTransmissions(Protocol):
    """A rule that judges transmissions. If ``per_transmission`` is True and the model
    ``Retransmits``, the rule is asked for each transmission of each packet, and not once per frame.
    It drops or passes."""

    @property
    def per_transmission(self) -> bool:
        """Whether it does, known as soon as the rule is made."""


@runtime_checkable
class PassesMany(Protocol):
    """A rule that can tell at once of many frames that it has nothing to say."""

    def all_pass(self, frames: Frames) -> bool:
        """Whether ``judge`` would let each of the frames pass unchanged now. False: it has to be
        asked. Changes nothing."""


@runtime_checkable
class TakesBack(Protocol):
    """A rule that counts what hosts send."""

    def refused(self, host: int, size_bytes: int) -> None:
        """The model has refused so many bytes of a frame that the rule has judged in this instant
        (``Refuses``): ``host`` has not sent them."""


@runtime_checkable
class Queues(Protocol):
    """A rule whose delays are the waits in a queue. If its scope ends (``until``), its medium keeps
    in front of the network model what waits, and hands over all of it at the end."""

    def emptied(self) -> None:
        """Its scope has ended, and nothing waits any more."""


@runtime_checkable
class SendsMany(Protocol):
    """A network model that takes many frames at once, and so saves calls."""

    def send_many(self, frames: Frames) -> Sequence[int | None]:
        """Take the first of the frames, as many as you like, and return for each what ``send``
        would: its delay, or None if it is settled later, when this call has returned. The others
        will be sent by ``send``."""


@runtime_checkable
class Retransmits(Protocol):
    """A network model whose MAC repeats lost packets, if ``judges_transmissions`` is True. It then
    asks ``Context.judge_transmission`` for each transmission."""

    @property
    def judges_transmissions(self) -> bool:
        """Whether it does, known as soon as the model is made."""


@runtime_checkable
class Refuses(Protocol):
    """A network model that can refuse a frame before sending it. The bytes of a frame that is
    dropped for one of these of its ``reasons`` do not count as sent."""

    @property
    def refuses(self) -> Sequence[str] | frozenset[str]:
        """Some of its reasons."""


@runtime_checkable
class KnowsDepartures(Protocol):
    """A rule or a network model that knows at once when frames leave their senders, before or
    after it settles them. Until then they are in the send buffers of UDP sockets."""

    def departure_ns(self, host: int) -> int:
        """The time when all frames that ``host`` has sent so far have left it."""


@runtime_checkable
class FollowsHosts(Protocol):
    """A network model that wants to know which hosts run. All run before the first call."""

    def switched(self, host: int, up: bool) -> None:
        """The host starts, or has stopped."""


@runtime_checkable
class CountsAttempts(Protocol):
    """A network model that counts transmissions."""

    def attempts(self) -> tuple[int, int]:
        """Transmissions of data so far, and those of any kind that had no reply (RTS too)."""


@runtime_checkable
class CountsControl(Protocol):
    """A network model whose protocols send frames of their own."""

    def control(self) -> tuple[int, int]:
        """Those frames so far, and their bytes."""


class Handover(NamedTuple):
    """A host hangs on ``access_point`` from ``time_ns`` on, after ``gap_ns`` on none; before on
    ``left`` (None: on none yet)."""

    time_ns: int
    host: int
    left: str | None
    access_point: str
    gap_ns: int


@runtime_checkable
class KnowsHandovers(Protocol):
    """A network model whose hosts hang on access points."""

    @property
    def handovers(self) -> Sequence[Handover]:
        """All so far, in order of time."""


@runtime_checkable
class CountsBusyTime(Protocol):
    """A network model that knows how long its channels were in use. A channel carries one thing at
    a time: the air around a host, a host's port, the one cable."""

    def busy_ns(self, hosts: Sequence[int]) -> Sequence[int]:
        """The time so far, ns, for which the channel of each of ``hosts`` was in use (indices of
        those attached to the medium); or that of the one channel that all share."""


@runtime_checkable
class NamesChannels(Protocol):
    """A network model that names the channels of ``CountsBusyTime``. Without this capability they
    have the names of the hosts, or the medium's if all share one."""

    def channels(self, hosts: Sequence[int]) -> Sequence[str]:
        """The name of each channel of ``busy_ns``, in its order."""


@runtime_checkable
class CountsAirtime(Protocol):
    """A network model of radios that knows how long each was sending and receiving. The energy of
    robots depends on it (``robot.power``)."""

    def airtime_ns(self, hosts: Sequence[int]) -> Sequence[tuple[int, int]]:
        """For each of ``hosts``, the indices of those attached to the medium, the time so far, ns,
        for which it was sending, and for which it heard others send."""


@runtime_checkable
class Itemizes(Protocol):
    """A network model that enters the parts of each frame's time in a ledger. ``itemize`` is called
    once, before ``start``, and only for a run that keeps a ledger. Without this capability a frame
    has the one part "on the medium"."""

    def itemize(self, ledger: Ledger) -> None:
        """Enter the parts by ``ledger.spent`` from now on."""


@runtime_checkable
class KnowsLinks(Protocol):
    """A network model that knows at any time how well each host hears each other one. Static
    routing finds its shortest paths by it."""

    def links(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """From whom [k], to whom [k], and the share of packets [k] that arrive."""


class Signal(NamedTuple):
    """``power_dbm`` [n] received, and ``delivery`` [n], the share of full packets (1518 B with
    Ethernet's headers) that get through when each is sent once and nobody else is on the air."""

    power_dbm: np.ndarray
    delivery: np.ndarray


@runtime_checkable
class HearsAntennas(Protocol):
    """A network model in which the hosts' antennas count. Strategies see its signals of their
    teammates; of a model without it, those of ``PredictsSignal``."""

    def link_signal(self, sender: int, receiver: int, ends_m: np.ndarray, obstacles: Obstacles
                    ) -> Signal:
        """The signal of one host at another, arrays of one element, when they stood at ``ends_m``
        [2, 2] m with ``obstacles`` between them."""


@runtime_checkable
class PredictsSignal(Protocol):
    """A network model that can say what a sender's signal is like anywhere. ``desim
    coverage`` draws it."""

    def signal(self, from_m: np.ndarray, to_m: np.ndarray) -> Signal:
        """The signal now at ``to_m`` [n, 2] m of a sender at ``from_m`` [2] m."""

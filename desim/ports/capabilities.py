"""The capabilities of networks: what a rule or a network model *may* have beside its contract.

A class claims one by having its members; nobody has to name the protocol. desim asks once, when the
medium is made.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from desim.ports.frames import Frames
from desim.ports.networks import Obstacles
from desim.ports.time_parts import Ledger


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
    """A host hangs on ``access_point`` from ``time_ns`` on, after ``gap_ns`` on none that runs;
    before on ``left`` (None: on none yet)."""

    time_ns: int
    host: int
    left: str | None
    access_point: str
    gap_ns: int


class PlacedAccessPoint(NamedTuple):
    """An access point at ``x_m``, ``y_m``, on a ``channel``."""

    name: str
    x_m: float
    y_m: float
    channel: int


@runtime_checkable
class KnowsHandovers(Protocol):
    """A network model whose hosts hang on access points. The trace, the summary and the replay
    have who hangs on whom."""

    @property
    def access_points(self) -> Sequence[PlacedAccessPoint]:
        """All, known as soon as the model is made."""

    @property
    def handovers(self) -> Sequence[Handover]:
        """All so far, in order of time."""

    def follow(self, note: Callable[[int, str | None], object]) -> None:
        """Call ``note(host, access_point)`` now for each host that may hang on one, and from now on
        whenever a host comes to one or leaves it. None: it hangs on none."""


@runtime_checkable
class ChecksHosts(Protocol):
    """Parameters of a network model that know before it starts what does not fit: loading a
    scenario asks them, and ``start`` has the same check."""

    def check_hosts(self, hosts: tuple[str, ...]) -> None:
        """Raises ``InputError`` as ``NetworkModel.start`` would with these ``hosts``."""


@runtime_checkable
class NamesAccessPoints(Protocol):
    """Parameters of a network model that is one of ``SwitchesAccessPoints``."""

    def access_point_names(self) -> Sequence[str]:
        """The names of its access points (none: they cannot fail)."""


@runtime_checkable
class SwitchesAccessPoints(Protocol):
    """A network model of ``KnowsHandovers`` whose access points can fail (``faults``)."""

    def switch_access_point(self, name: str, up: bool) -> None:
        """The access point stops, and knows no host any more, or starts."""


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

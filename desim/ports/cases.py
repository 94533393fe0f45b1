"""The contracts of ``desim net`` and ``desim validate``.

A case describes hosts and flows of a network without robots; desim plays it. A validation compares
the results with published numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Literal, NamedTuple, Protocol, runtime_checkable

from desim.ports import parameters
from desim.ports.antenna import Antenna
from desim.ports.networks import NetworkModel, Rule
from desim.ports.terrain import Walled

NOWHERE = (float("nan"), float("nan"))

Arrivals = Literal["saturated", "poisson", "periodic", "zero"]
Waypoint = tuple[int, float, float]  # ns, x m, y m


class Flow(NamedTuple):
    """The frames of one sender: of ``size_bytes`` with all headers, each a packet that carries
    ``payload_bytes``.

    There is one every ``every_ns``, on average (``poisson``) or exactly: from a random phase
    (``periodic``) or from the beginning (``zero``). Unicast flows may also be ``saturated``: two
    frames are in the network at any time. What a full queue drops on the way, such a flow sends
    anew 10 ms later, one at a time; what is refused at once, never. ``backlog``: frames sent at
    once at the beginning, in addition. ``train``: so many go together, as one frame of so many
    packets, whose delay they all have; saturated, as many trains as ``backlog`` and two frames
    fill. It is measured to a train. ``dscp``: the mark of packets of UDP. ``echo``: the receiver
    sends each frame back; it counts as arrived when it is back at the sender. Unicast frames go
    over the hosts ``via`` in their order, each of which sends them anew. The beginning is
    ``begin_ns``.

    A flow over ``tcp`` has a connection of its own, which is opened again when it ends, from its
    source to its one receiver. It writes messages of ``payload_bytes`` into it: saturated, as many
    as the socket takes; else one that it does not take is lost (``queue_full``). ``size_bytes`` is
    a message with its headers, in segments of its own.
    """

    source: str
    receivers: tuple[str, ...]
    size_bytes: int
    payload_bytes: int
    arrivals: Arrivals = "saturated"
    every_ns: int = 0
    backlog: int = 0
    broadcast: bool = False
    echo: bool = False
    begin_ns: int = 0
    via: tuple[str, ...] = ()
    dscp: int = 0
    protocol: Literal["udp", "tcp"] = "udp"
    train: int = 1


class Setup(NamedTuple):
    """A network without robots. ``places``: host to x, y in m (``NOWHERE``: it has none). Fates of
    frames in the first ``warm_up_ns`` are not counted. ``compared``: another network; this one's
    goodput is given as a share of that one's.

    A host with ``motion`` goes straight from its place to each way point in turn, to be there at
    its time, and stays at the last one. ``antennas``: of hosts that have not the usual one."""

    model: NetworkModel
    places: Mapping[str, tuple[float, float]]
    flows: Sequence[Flow]
    duration_ns: int
    warm_up_ns: int = 0
    rules: Sequence[Rule] = ()
    compared: Setup | None = None
    terrain: Walled = Walled()
    motion: Mapping[str, Sequence[Waypoint]] = {}
    antennas: Mapping[str, Antenna] = {}


class Case(Protocol):
    """A network to try out: ``desim net NAME --key value``, the keys being those of its ``Params``.
    Built as ``Case(params)``.

    A number without a unit has that of the parameter's default, or of its first example where the
    default has none: ``Field(None, examples=["54 Mb/s"], description=...)``.
    """

    @property
    def Params(self) -> type[parameters.Params]:
        """The class of its parameters, inside the plug-in's class."""

    def setup(self) -> Setup:
        """Made anew each time. Raises ``InputError`` for parameters that do not fit each other; a
        line begins with a dot and the parameter, ``.rate: ...``."""


# Plays a setup, ``play(setup, seed=1)``: the measures that ``desim net --json`` prints, by name. A
# measure is a number, or a table of numbers.
Play = Callable[..., Mapping[str, Any]]


@runtime_checkable
class ShowsSettings(Protocol):
    """Parameters of a case of which something follows that stands in the place of what is given."""

    def shown(self) -> dict[str, str]:
        """By key, the words for it."""


class Check(NamedTuple):
    """One comparison. It holds if measured and published differ by ``tolerance`` at most."""

    what: str
    measured: float
    published: float
    tolerance: float
    unit: str = ""

    @property
    def holds(self) -> bool:
        return abs(self.measured - self.published) <= self.tolerance  # not if it is NaN


class Validation(Protocol):
    """A group of ``desim validate``. Built without arguments."""

    @property
    def source(self) -> str:
        """An attribute of the class."""

    def checks(self, play: Play) -> Iterator[Check]:
        """Each is measured when it is asked for."""

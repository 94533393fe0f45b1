"""The sender of frames, which hears of their fates."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeAlias, TypeVar

if TYPE_CHECKING:
    from desim.network.medium import Medium

BEFORE_NS = -1

T_contra = TypeVar("T_contra", contravariant=True)


class Carrier(Generic[T_contra]):
    """The sender of frames. It gives a ``token`` along with each frame, and gets it back
    with the frame's fate, once, and with each copy.

    A class that inherits from this one defines the fates that concern it; the others have no
    effect.
    """

    __slots__ = ()

    ahead = False
    """Whether it wants to be told of an arrival ahead of time (``expected``), because nobody waits
    for it: the medium then books no event. It may change from frame to frame."""

    def expected(self, token: T_contra, receiver: int, arrival_ns: int) -> object:
        """A frame will be at ``receiver`` at ``arrival_ns``. After that the carrier calls
        ``Medium.flights.landed``. If somebody begins to wait for it before, the carrier calls
        ``Medium.flights.book``, and its ``arrived`` is called at that time."""

    continues = False
    """Whether its frame goes on with what has just arrived: a host forwards it."""

    protocol = "udp"
    """The protocol whose headers its packets bear: udp, tcp or arp."""

    @property
    def conversation(self) -> object:
        """Equal for carriers of one connection, in both directions; else the socket."""
        return self.socket

    @property
    def socket(self) -> object:
        """Equal for carriers that send by the same socket; the carrier itself, unless its class
        says otherwise. To the queues of interfaces all frames from one socket to one receiver are
        one flow, as those of a connection are."""
        return self

    def topics(self, token: T_contra) -> tuple[str, ...]:
        """The topics of whose messages the frame carries data; none of a control frame. Asked where
        a rule acts on some topics only."""
        return ()

    def first_sent(self, token: T_contra, now_ns: int) -> int:
        """The time when what the frame carries was first sent, maybe in another frame;
        ``BEFORE_NS`` if it can only complete messages that were sent before. Called where a ledger
        is kept, when the frame is sent (``now_ns``)."""
        return now_ns

    def arrived(self, token: T_contra, receiver: int) -> object:
        """All of the frame is at ``receiver``."""

    def arrived_in_part(self, token: T_contra, receiver: int, lost: dict[int, str]) -> object:
        """The train is at ``receiver`` without the packets ``lost``: number from 0 to reason, at
        least one of them and never all."""

    def lost(self, token: T_contra, receiver: int, reason: str) -> object:
        """Nothing of the frame arrives at ``receiver``."""

    def settled(self, token: T_contra, receiver: int, packets: int, lost: dict[int, str]) -> None:
        """The train of so many ``packets`` is at ``receiver`` without those ``lost``: one of the
        three fates above."""
        if not lost:
            self.arrived(token, receiver)
        elif len(lost) < packets:
            self.arrived_in_part(token, receiver, dict(sorted(lost.items())))
        else:
            self.lost(token, receiver, lost[0])

    def repeated(self, token: T_contra, receiver: int) -> object:
        """A copy of a frame that has arrived whole, where a rule makes copies."""

    def unresolved(self, token: T_contra) -> object:
        """A frame was lost because nobody has answered for the receiver's address."""

    def arrived_many(self, token: T_contra, receivers: Sequence[int]) -> None:
        """A broadcast is whole at several ``receivers`` in one instant, which are in the order of
        their trace ids: what ``arrived`` says of each."""
        for receiver in receivers:
            self.arrived(token, receiver)

    def missed(self, token: T_contra, receivers: Collection[int], reason: str,
               medium: Medium) -> object:
        """One fate of several receivers of a broadcast frame. They are best counted: to list them
        may take a search."""


AnyCarrier: TypeAlias = Carrier[Any]  # its tokens are its own


class WrappedCarrier(Carrier[T_contra]):
    """A carrier around another one, whose protocol, connection and socket its frames have, and
    which hears of what ends them."""

    __slots__ = ("_carrier",)

    _carrier: AnyCarrier

    @property
    def protocol(self) -> str:  # type: ignore[override] # that of the carrier inside
        return self._carrier.protocol

    @property
    def conversation(self) -> object:
        return self._carrier.conversation

    @property
    def socket(self) -> object:
        return self._carrier.socket

    def topics(self, token: T_contra) -> tuple[str, ...]:
        return self._carrier.topics(token)

    def first_sent(self, token: T_contra, now_ns: int) -> int:
        return self._carrier.first_sent(token, now_ns)

    def lost(self, token: T_contra, receiver: int, reason: str) -> object:
        return self._carrier.lost(token, receiver, reason)

    def repeated(self, token: T_contra, receiver: int) -> object:
        return self._carrier.repeated(token, receiver)

    def unresolved(self, token: T_contra) -> object:
        return self._carrier.unresolved(token)

    def missed(self, token: T_contra, receivers: Collection[int], reason: str,
               medium: Medium) -> object:
        return self._carrier.missed(token, receivers, reason, medium)


class Carriers(Protocol[T_contra]):
    """The senders of frames that set out together, one each: ``members``."""

    @property
    def members(self) -> Sequence[Carrier[T_contra]]: ...

    def expected_many(self, token: T_contra, delays_ns: Sequence[int]) -> object:
        """Frame i, for as many as there are delays, will be at its receiver ``delays_ns[i]`` from
        now: what ``Carrier.expected`` says of one frame. A delay may be 0."""

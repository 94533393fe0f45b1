"""Who sends frames over a medium, and hears what became of them."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

if TYPE_CHECKING:
    from desim.network.medium import Medium


@runtime_checkable
class Carrier(Protocol):
    """The sender of unicast frames. ``token`` is whatever it gave along with the frame. It hears
    once of each frame, and of copies besides.

    To the queues of interfaces its frames to one receiver are one flow, as those of a connection
    are. Carriers that send by the same socket say so: they have an equal ``socket``.
    """

    def arrived(self, token: Any, receiver: int) -> None:
        """All of the frame is at ``receiver``."""

    def arrived_in_part(self, token: Any, receiver: int, lost: dict[int, str]) -> None:
        """The train is at ``receiver`` without the packets ``lost``: number from 0 to reason, at
        least one of them and never all."""

    def lost(self, token: Any, receiver: int, reason: str) -> None:
        """Nothing of the frame arrives at ``receiver``."""

    def repeated(self, token: Any, receiver: int) -> None:
        """A copy of a frame that has arrived whole, where a rule makes copies."""


@runtime_checkable
class BroadcastCarrier(Carrier, Protocol):
    """The sender of broadcast frames."""

    def missed(self, token: Any, receivers: Collection[int], reason: str,
               medium: Medium) -> None:
        """One fate of several receivers of a broadcast frame. They are best counted: who they are
        may have to be found out."""

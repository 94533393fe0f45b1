"""Who sends frames over a medium."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from desim.middleware.medium import Medium


class Carrier(Protocol):
    """Who sent a frame, and wants to know. ``token`` is whatever it gave along."""

    def arrived(self, token: Any, receiver: int) -> None: ...

    def lost(self, token: Any, receiver: int, reason: str) -> None: ...

    def missed(self, token: Any, receivers: Collection[int], reason: str,
               medium: Medium) -> None:
        """One fate of several receivers of a broadcast frame. They are best counted: who they are
        may have to be found out."""

    def repeated(self, token: Any, receiver: int) -> None:
        """A copy of a frame that has arrived, where a rule makes them."""

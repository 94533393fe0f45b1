"""A robot that carries loads, as the task counts its work."""

from __future__ import annotations

from desim.ports.delivery import TransportOrder


class CarryingRobot:
    """The work of a robot. It is busy from when it begins to wait at a pick until its load is off.
    """

    def __init__(self) -> None:
        self.load: TransportOrder | None = None
        self.busy_ns = self.delivered = self.wasted = 0
        self.loaded_m, self._loaded_m = 0.0, 0.0  # so far; where its way stood when it was loaded
        self._since_ns: int | None = None

    def begin(self, now_ns: int) -> None:
        """It is busy from now on."""
        if self._since_ns is None:
            self._since_ns = now_ns

    def end(self, now_ns: int) -> None:
        """It has nothing more to do."""
        if self._since_ns is not None:
            self.busy_ns, self._since_ns = self.busy_ns + now_ns - self._since_ns, None

    def take(self, order: TransportOrder, travelled_m: float) -> None:
        """It has a load now."""
        self.load, self._loaded_m = order, travelled_m

    def leave(self, travelled_m: float) -> None:
        """It has no load any more."""
        self.loaded_m, self.load = self.way_m(travelled_m), None
        self.delivered += 1

    def way_m(self, travelled_m: float) -> float:
        """The way with a load so far."""
        return self.loaded_m + (travelled_m - self._loaded_m if self.load else 0.0)

    def busy_until_ns(self, now_ns: int) -> int:
        """The time for which it has been busy so far."""
        return self.busy_ns + (0 if self._since_ns is None else now_ns - self._since_ns)

"""The moments at which frames leave their senders, for those who wait for them."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from desim.ports import Frame, KnowsDepartures


class Departures:
    """The departures of the frames of one medium's ``model``, with ``rules`` in front of it.

    ``known``: whether the model knows them at once (``ports.KnowsDepartures``). If not, a frame
    leaves when it is settled; ``held``: what to call then, and with what, by the frame's number.
    """

    __slots__ = ("known", "held", "_parts", "foretold")

    def __init__(self, model: object, rules: Iterable[object]) -> None:
        self.known = isinstance(model, KnowsDepartures)
        self.held: dict[int, tuple[Callable[[int], object], int]] = {}
        self._parts = [part.departure_ns for part in (model, *rules)
                       if isinstance(part, KnowsDepartures)]
        self.foretold = bool(self._parts)  # by the model or a rule

    def last_ns(self, host: int) -> int:
        """The time when all that ``host`` has sent so far has left it, as far as the model and the
        rules know; 0: they do not."""
        last_ns = 0
        for departure_ns in self._parts:
            last_ns = max(last_ns, departure_ns(host))
        return last_ns

    def left(self, frame: Frame) -> None:
        """``frame`` has left its sender."""
        if frame.id in self.held:
            call, arg = self.held.pop(frame.id)
            call(arg)

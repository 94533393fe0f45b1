"""The memory of a host: the quality of its links, and of the routes through its neighbours."""

from __future__ import annotations


class LinkQuality:
    """The link to a neighbour, by the numbers of messages: ``heard``, the neighbour's own that
    came straight from it, and ``echoed``, this host's that it passed on. Windows are bit masks, bit
    0 for the last number."""

    def __init__(self, window: int) -> None:
        self._window = window
        self._whole = (1 << window) - 1
        self._heard = self._first_heard = self._last_heard = 0
        self._echoed = self._last_echoed = 0

    def heard(self, number: int) -> None:
        """Note a message of the neighbour's own."""
        self._first_heard = self._first_heard or number
        self._heard = (self._heard << number - self._last_heard | 1) & self._whole
        self._last_heard = number

    def echoed(self, number: int) -> None:
        """Note a message of this host's that the neighbour has passed on."""
        if number <= self._last_echoed:  # two echoes may overtake each other
            self._echoed |= 1 << self._last_echoed - number & self._whole
            return
        self._echoed = (self._echoed << number - self._last_echoed | 1) & self._whole
        self._last_echoed = number

    def quality(self, own_number: int) -> float:
        """Of sending to it, 0 to 1: echoes / heard * (1 - (1 - heard / sent)^3), sent being those
        of the window since it was heard first. ``own_number`` is the last one that may have an
        echo."""
        heard = self._heard.bit_count()
        echoes = (self._echoed << own_number - self._last_echoed & self._whole).bit_count()
        if not heard or not echoes:
            return 0.0
        sent = min(self._last_heard - self._first_heard + 1, self._window)
        return min(echoes / heard, 1.0) * (1 - (1 - heard / sent) ** 3)


class Routes:
    """The routes to one originator, by their first hop. ``best``: the neighbour to take |
    ``heard_ns``: when anything was heard last | ``passed_on``: number of the last message that this
    host passed on as the best route's."""

    def __init__(self, memory: int) -> None:
        self._memory = memory
        self._first = 0  # numbers begin with 1
        self._newest = 0
        self._heard: dict[int, dict[int, float]] = {}  # by neighbour and number
        self.best: int | None = None
        self.heard_ns = 0
        self.passed_on = 0

    def hear(self, neighbour: int, number: int, quality: float, now_ns: int) -> bool:
        """A message came from ``neighbour``. Returns whether that is the first hop of
        the best route."""
        if number < self._newest - self._memory:
            return False
        self._first = self._first or number
        self.heard_ns = now_ns
        self._newest = max(self._newest, number)
        heard = self._heard.setdefault(neighbour, {})
        heard[number] = max(quality, heard.get(number, 0.0))
        if len(heard) > self._memory + 1:
            del heard[min(heard)]
        if self.best is None or (neighbour != self.best
                                 and self.quality(neighbour) > self.quality(self.best)):
            self.best = neighbour
        return neighbour == self.best

    def quality(self, neighbour: int) -> float:
        """The mean of the last numbers; those not heard count 0. The newest one does not count (but
        for the very first), since it may still be on its way through others."""
        last = self._newest - (self._newest > self._first)
        before = max(last - self._memory, self._first - 1)
        return sum(quality for number, quality in self._heard[neighbour].items()
                   if before < number <= last) / (last - before)

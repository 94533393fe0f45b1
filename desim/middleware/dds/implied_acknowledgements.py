"""Implied acknowledgements (``acks: implied``): the reader informs the writer without a frame.

Heartbeats are sent by themselves only where a sample does not arrive soon.
"""

from __future__ import annotations

from desim.middleware.dds.reader import Reader, ReliableSample
from desim.middleware.dds.reliable import SOON_NS, ReliableLink
from desim.middleware.dds.wire import SampleTrain
from desim.middleware.timers import NEVER


class ImpliedReader(Reader):
    """A reader whose acknowledgements are no frames, unless it asks for missing fragments."""

    __slots__ = ()

    _link: ImpliedLink

    def take(self, sample: ReliableSample, part: range, first: int, beat: int) -> bool:
        number = sample.number
        if number == self._next and len(part) == sample.parts and self._known <= number \
                and not self._parts:  # as nearly always
            remote = self._match()
            if remote is None:
                return False
            remote.received_ns = self._kernel.now_ns
            self._known = number
            self._deliver(sample)
            self._link.has_all(number + 1)
            return True
        return super().take(sample, part, first, beat)

    def _respond(self, beat: int) -> None:
        if self._next > self._known:
            self._acknowledge()
        else:
            super()._respond(beat)

    def _acknowledge(self) -> None:
        self._asked = False
        self._link.has_all(self._next)


class ImpliedLink(ReliableLink):
    """A writer's end of a link that knows at once what the reader has."""

    __slots__ = ()

    read_by = ImpliedReader

    def has_all(self, base: int) -> None:
        """The reader has all before ``base``."""
        if self._closed is None:
            self._release(base)
            if not self._history:
                self._timer.deadline_ns = NEVER

    def lose(self, sample: ReliableSample, reason: str) -> None:
        super().lose(sample, reason)
        if self._closed is None:
            self._expect_heartbeat()

    def _transmit_new(self, sample: ReliableSample, trains: tuple[SampleTrain, ...],
                      beat: int) -> None:
        soon_ns = self._beat_ns + SOON_NS
        soon = True
        for train in trains:
            due_ns = self._transmit(sample, train, beat, self._node)
            soon = soon and due_ns is not None and due_ns <= soon_ns
        if self._greeted and not soon:
            self._expect(self._beat_ns + self._period_ns)

    def _after_arrival(self, sample: ReliableSample, reason: str) -> None:
        super()._after_arrival(sample, reason)
        self._expect_heartbeat()  # if the sample is still kept, fragments are missing

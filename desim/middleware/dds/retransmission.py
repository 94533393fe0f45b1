"""Retransmission of samples: the requests of a reader, and when they are met."""

from __future__ import annotations

from collections import deque

from desim.middleware.dds.parameters import DdsConstants
from desim.middleware.dds.wire import RtpsVendor
from desim.middleware.dds.writer_proxy import Missing, ReliableSample


class RequestedChanges:
    """The last request of one reader. ``missing``: the fragments that were not sent since then.

    A request may have been on its way when a fragment was sent again, and the more waits in a
    medium, the longer it is on its way. So the pause after a repetition of the same fragment
    doubles each time.
    """

    def __init__(self, constants: DdsConstants, cut: RtpsVendor) -> None:
        self._constants, self._cut = constants, cut
        self.missing: dict[int, tuple[int, ...]] = {}

    def request(self, missing: Missing) -> None:
        self.missing = dict(missing)

    def acknowledged(self, base: int) -> None:
        """The reader has all before ``base``."""
        self.missing = {number: indices for number, indices in self.missing.items()
                        if number >= base}

    def take(self, history: deque[ReliableSample], first: int, now_ns: int
             ) -> tuple[list[tuple[ReliableSample, range]], bool, int | None]:
        """Take the fragments of ``history``, which begins with number ``first``, that are to be
        sent now: parts of samples, each in a frame. A sample of several messages of which the
        reader has nothing goes in trains once, all others by fragments. Returns also whether some
        fragments are gone, and when more are due if nothing changes (None: never)."""
        missing, self.missing = self.missing, {}
        parts: list[tuple[ReliableSample, range]] = []
        next_ns = None
        for number in sorted(missing):
            if not first <= number < first + len(history):
                continue
            sample, indices = history[number - first], missing[number]
            if not (indices or sample.again) and sample.parts > self._constants.message_fragments:
                parts += ((sample, train.part) for train in self._cut.trains(
                    sample.message.size_bytes, self._constants.fragment_bytes, 1, ()))
                sample.again = dict.fromkeys(range(sample.parts), self._after(now_ns, 0))
                continue
            waits = []
            again = sample.again = sample.again or {}
            for index in indices or range(sample.parts):
                from_ns, pause_ns = again.get(index, (0, 0))
                if from_ns > now_ns:
                    waits.append(index)
                    next_ns = from_ns if next_ns is None else min(next_ns, from_ns)
                else:
                    again[index] = self._after(now_ns, pause_ns)
                    parts.append((sample, range(index, index + 1)))
            if waits:
                self.missing[number] = tuple(waits)
        return parts, any(number < first for number in missing), next_ns

    def _after(self, now_ns: int, pause_ns: int) -> tuple[int, int]:
        """The end and the length of the pause that follows one of ``pause_ns``."""
        constants = self._constants
        pause_ns = min(constants.heartbeat_limit_ns, 2 * pause_ns) or constants.nack_suppression_ns
        return now_ns + pause_ns, pause_ns

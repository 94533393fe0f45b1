"""The SACK scoreboard of a sender: which sent bytes are in flight, lost or received (RFC 6675)."""

from __future__ import annotations

from collections.abc import Iterable

IN_FLIGHT, SACKED, LOST = range(3)


class SentRange:
    """Bytes ``start`` to ``end``, sent at ``sent_ns`` for the last time, ``retransmitted`` if that
    was not the first."""

    __slots__ = ("start", "end", "sent_ns", "state", "retransmitted")

    def __init__(self, start: int, end: int, sent_ns: int, state: int = IN_FLIGHT,
                 retransmitted: bool = False) -> None:
        self.start, self.end = start, end
        self.sent_ns = sent_ns
        self.state = state
        self.retransmitted = retransmitted


class Scoreboard:
    """The runs between the first byte that is not acknowledged and the last one that was sent
    (RFC 6675), and which of those that arrived was sent last (RFC 8985).

    Of the last acknowledgement: ``newly_sacked`` bytes behind its number are new in it;
    ``measured_ns`` is when the first bytes that it is the first to cover were sent, if they show
    the round trip (-1: none do); ``original``: some of its news went once, before the last timeout.
    """

    def __init__(self, una: int, trains: Iterable[tuple[int, int]]) -> None:
        self.runs: list[SentRange] = []
        self.bytes = [0, 0, 0]  # by state
        self.rack = -1, -1  # when the last that arrived was sent (RACK.xmit_ts), and RACK.end_seq
        self.rack_rtt_ns = 0
        self.newly_sacked, self.measured_ns, self.original = 0, -1, False
        for end, sent_ns in trains:
            self.send(una, end, sent_ns)
            una = end

    @property
    def in_flight(self) -> int:
        """The bytes that seem to be in the network (pipe of RFC 6675)."""
        return self.bytes[IN_FLIGHT]

    def send(self, start: int, end: int, now_ns: int) -> None:
        """New bytes are on their way."""
        self.runs.append(SentRange(start, end, now_ns))
        self.bytes[IN_FLIGHT] += end - start

    def send_again(self, run: SentRange, end: int, now_ns: int) -> None:
        """Lost bytes from the start of ``run`` are on their way again."""
        if end < run.end:
            self._cut(self.runs.index(run), end)
        self._set_state(run, IN_FLIGHT)
        run.sent_ns = now_ns
        run.retransmitted = True

    def acknowledge(self, una: int, ranges: Iterable[tuple[int, int]], now_ns: int,
                    min_rtt_ns: int, high: int) -> int:
        """Take an acknowledgement: all before ``una`` has arrived, and ``ranges``. Returns the
        number of bytes that were not known to have arrived. ``high``: what had been sent at the
        last timeout."""
        runs, news, done = self.runs, 0, 0
        self.newly_sacked, self.original, again = 0, False, False
        measured_ns = selected_ns = -1
        for run in runs:
            if run.start >= una:
                break
            if run.end > una:
                self._cut(done, una)
            again |= run.retransmitted
            if run.state != SACKED:
                news += run.end - run.start
                self._advance_rack(run, now_ns, min_rtt_ns)
                if not run.retransmitted:
                    self.original |= run.end <= high
                    if measured_ns < 0:
                        measured_ns = run.sent_ns
            self.bytes[run.state] -= run.end - run.start
            done += 1
        del runs[:done]
        at = 0
        for start, end in ranges:
            while at < len(runs) and runs[at].end <= start:
                at += 1
            while at < len(runs) and runs[at].start < end:
                run = runs[at]
                if run.state != SACKED:
                    if run.start < start:
                        self._cut(at, start)
                        at += 1
                        run = runs[at]
                    if run.end > end:
                        self._cut(at, end)
                    self.newly_sacked += run.end - run.start
                    self._advance_rack(run, now_ns, min_rtt_ns)
                    self._set_state(run, SACKED)
                    if not run.retransmitted:
                        self.original |= run.end <= high
                        if selected_ns < 0:
                            selected_ns = run.sent_ns
                at += 1
        self.measured_ns = selected_ns if again or measured_ns < 0 else measured_ns
        return news + self.newly_sacked

    def tail(self, most: int, now_ns: int) -> SentRange:
        """The last segment, of ``most`` bytes at most, goes again."""
        run = self.runs[-1]
        start = run.start + (run.end - 1 - run.start) // most * most
        if start > run.start:
            self._cut(len(self.runs) - 1, start)
        run = self.runs[-1]
        self.send_again(run, run.end, now_ns)
        return run

    def detect_losses(self, patience_ns: int, now_ns: int) -> tuple[int, int, int]:
        """Mark ranges as lost that were sent before one that has arrived, and are ``patience_ns``
        later than that was. Returns the number of their bytes, how many of them had gone again, and
        how long (ns) to wait for ranges that are not that late yet."""
        lost = again = wait_ns = 0
        late_ns = now_ns - self.rack_rtt_ns - patience_ns
        for run in self.runs:
            if run.state == IN_FLIGHT and (run.sent_ns, run.end) < self.rack:
                if run.sent_ns <= late_ns:
                    lost += run.end - run.start
                    again += run.retransmitted * (run.end - run.start)
                    self._set_state(run, LOST)
                else:
                    wait_ns = max(wait_ns, run.sent_ns - late_ns)
        return lost, again, wait_ns

    def mark_lost(self, late_ns: int) -> None:
        """Mark ranges as lost that were sent up to ``late_ns``, and the first one in any case."""
        for number, run in enumerate(self.runs):
            if run.state == IN_FLIGHT and (not number or run.sent_ns <= late_ns):
                self._set_state(run, LOST)

    def unmark_lost(self) -> None:
        """Take all lost ranges for in flight again (a false timeout)."""
        for run in self.runs:
            if run.state == LOST:
                self._set_state(run, IN_FLIGHT)

    def first_lost(self) -> SentRange | None:
        """The first run that is to be sent again."""
        if self.bytes[LOST]:
            for run in self.runs:
                if run.state == LOST:
                    return run
        return None

    def _advance_rack(self, run: SentRange, now_ns: int, min_rtt_ns: int) -> None:
        """A run has arrived. Of one that was sent again, it may have been the first copy."""
        rtt_ns = now_ns - run.sent_ns
        if (run.sent_ns, run.end) > self.rack and not (run.retransmitted and rtt_ns < min_rtt_ns):
            self.rack = run.sent_ns, run.end
            self.rack_rtt_ns = rtt_ns

    def _set_state(self, run: SentRange, state: int) -> None:
        size_bytes = run.end - run.start
        self.bytes[run.state] -= size_bytes
        self.bytes[state] += size_bytes
        run.state = state

    def _cut(self, number: int, at: int) -> None:
        run = self.runs[number]
        self.runs.insert(number + 1, SentRange(at, run.end, run.sent_ns, run.state,
                                               run.retransmitted))
        run.end = at

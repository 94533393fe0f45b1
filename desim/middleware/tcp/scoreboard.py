"""What has become of the bytes that a sender has on their way, as far as it knows."""

from __future__ import annotations

from collections.abc import Iterable

FLYING, ARRIVED, LOST = range(3)


class Run:
    """Bytes ``start`` to ``end``, sent at ``sent_ns`` for the last time, ``again`` if not for the
    first."""

    __slots__ = ("start", "end", "sent_ns", "state", "again")

    def __init__(self, start: int, end: int, sent_ns: int, state: int = FLYING,
                 again: bool = False) -> None:
        self.start, self.end = start, end
        self.sent_ns = sent_ns
        self.state = state
        self.again = again


class Scoreboard:
    """The runs between the first byte that is not acknowledged and the last one that was sent
    (RFC 6675), and which of those that arrived was sent last (RFC 8985)."""

    __slots__ = ("runs", "bytes", "newest", "newest_rtt_ns")

    def __init__(self, una: int, trains: Iterable[tuple[int, int]]) -> None:
        self.runs: list[Run] = []
        self.bytes = [0, 0, 0]  # by state
        self.newest = -1, -1  # when the last of them was sent, and where it ends
        self.newest_rtt_ns = 0
        for end, sent_ns in trains:
            self.send(una, end, sent_ns)
            una = end

    @property
    def flying(self) -> int:
        return self.bytes[FLYING]

    def send(self, start: int, end: int, now_ns: int) -> None:
        """New bytes are on their way."""
        self.runs.append(Run(start, end, now_ns))
        self.bytes[FLYING] += end - start

    def send_again(self, run: Run, end: int, now_ns: int) -> None:
        """Lost bytes from the start of ``run`` are on their way again."""
        if end < run.end:
            self._split(self.runs.index(run), end)
        self._become(run, FLYING)
        run.sent_ns = now_ns
        run.again = True

    def hear(self, una: int, ranges: Iterable[tuple[int, int]], now_ns: int,
             least_rtt_ns: int) -> int:
        """An acknowledgement says that all before ``una`` has arrived, and ``ranges``. Returns how
        many bytes of it are news."""
        runs, news, done = self.runs, 0, 0
        for run in runs:
            if run.start >= una:
                break
            if run.end > una:
                self._split(done, una)
            if run.state != ARRIVED:
                news += run.end - run.start
                self._came(run, now_ns, least_rtt_ns)
            self.bytes[run.state] -= run.end - run.start
            done += 1
        del runs[:done]
        at = 0
        for start, end in ranges:
            while at < len(runs) and runs[at].end <= start:
                at += 1
            while at < len(runs) and runs[at].start < end:
                run = runs[at]
                if run.state != ARRIVED:
                    if run.start < start:
                        self._split(at, start)
                        at += 1
                        run = runs[at]
                    if run.end > end:
                        self._split(at, end)
                    news += run.end - run.start
                    self._came(run, now_ns, least_rtt_ns)
                    self._become(run, ARRIVED)
                at += 1
        return news

    def tail(self, most: int, now_ns: int) -> Run:
        """The last segment, of ``most`` bytes at most, goes again."""
        run = self.runs[-1]
        start = run.start + (run.end - 1 - run.start) // most * most
        if start > run.start:
            self._split(len(self.runs) - 1, start)
        run = self.runs[-1]
        self.send_again(run, run.end, now_ns)
        return run

    def overtaken(self, patience_ns: int, now_ns: int) -> tuple[int, int]:
        """Take for lost what was sent before something that has arrived, and is ``patience_ns``
        later than that was. Returns how many bytes these are, and how long (ns) to wait for what is
        not that late yet."""
        lost = wait_ns = 0
        late_ns = now_ns - self.newest_rtt_ns - patience_ns
        for run in self.runs:
            if run.state == FLYING and (run.sent_ns, run.end) < self.newest:
                if run.sent_ns <= late_ns:
                    lost += run.end - run.start
                    self._become(run, LOST)
                else:
                    wait_ns = max(wait_ns, run.sent_ns - late_ns)
        return lost, wait_ns

    def lose(self, late_ns: int) -> None:
        """Take for lost what was sent up to ``late_ns``, and the first bytes in any case."""
        for number, run in enumerate(self.runs):
            if run.state == FLYING and (not number or run.sent_ns <= late_ns):
                self._become(run, LOST)

    def find(self) -> None:
        """Undo: take all that was marked lost for in flight again (a false timeout)."""
        for run in self.runs:
            if run.state == LOST:
                self._become(run, FLYING)

    def first_lost(self) -> Run | None:
        """The first run that is to be sent again."""
        if self.bytes[LOST]:
            for run in self.runs:
                if run.state == LOST:
                    return run
        return None

    def _came(self, run: Run, now_ns: int, least_rtt_ns: int) -> None:
        """A run has arrived. Of one that was sent again, it may have been the first copy."""
        rtt_ns = now_ns - run.sent_ns
        if (run.sent_ns, run.end) > self.newest and not (run.again and rtt_ns < least_rtt_ns):
            self.newest = run.sent_ns, run.end
            self.newest_rtt_ns = rtt_ns

    def _become(self, run: Run, state: int) -> None:
        size_bytes = run.end - run.start
        self.bytes[run.state] -= size_bytes
        self.bytes[state] += size_bytes
        run.state = state

    def _split(self, number: int, at: int) -> None:
        run = self.runs[number]
        self.runs.insert(number + 1, Run(at, run.end, run.sent_ns, run.state, run.again))
        run.end = at

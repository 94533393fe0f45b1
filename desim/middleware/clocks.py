"""The clocks of hosts: what a host takes for the present time.

A clock starts with an offset from the true time, and drifts. NTP steps it, or slews it: lets it run
at another rate until the offset is gone. Stamps, ages by a stamp and agreed times go by the host's
clock. Timers do not: they would differ by some 10 us a second.
"""

from __future__ import annotations

from bisect import bisect_right

PPB = 10**9  # parts per billion, of a rate
SLEW_PPB = 500_000  # adjtime(3) of Unix kernels: 0.5 ms a second (the manual page of ntpd, -x)


class HostClock:
    """The clock of a host, ``ahead_ns`` ahead at time 0, which runs ``drift_ppb`` too fast.

    It can be read at any time up to the present: a content that is computed late has the stamp of
    its message's birth.
    """

    __slots__ = ("_since_ns", "_ahead_ns", "_rates_ppb", "_drift_ppb", "_trim_ppb", "_slew_ppb",
                 "_slew_ends_ns")

    def __init__(self, ahead_ns: int, drift_ppb: int) -> None:
        # Pieces of a line: from each of these times on, how far it is ahead, and at which rate that
        # grows.
        self._since_ns, self._ahead_ns, self._rates_ppb = [0], [ahead_ns], [drift_ppb]
        self._drift_ppb = drift_ppb
        self._trim_ppb = 0  # what NTP corrects of the rate
        self._slew_ppb, self._slew_ends_ns = 0, 0

    def read(self, time_ns: int) -> int:
        """The time that it shows at ``time_ns``."""
        return time_ns + self.ahead_ns(time_ns)

    def ahead_ns(self, time_ns: int) -> int:
        """The lead over the true time at ``time_ns``, below 0 where it is behind."""
        i = bisect_right(self._since_ns, time_ns) - 1
        return self._ahead_ns[i] + (time_ns - self._since_ns[i]) * self._rates_ppb[i] // PPB

    def unslewed_ns(self, now_ns: int) -> int:
        """By how much it is still to be slewed: below 0 where it is to lose time."""
        return max(0, self._slew_ends_ns - now_ns) * self._slew_ppb // PPB

    def step(self, now_ns: int, by_ns: int) -> None:
        """Set it ``by_ns`` ahead of what it shows. What was still to be slewed is void."""
        self._go_on(now_ns, self.ahead_ns(now_ns) + by_ns, 0)
        self._slew_ends_ns = now_ns

    def slew(self, now_ns: int, by_ns: int) -> None:
        """Let it run at another rate until it is ``by_ns`` ahead of what it would have shown at
        the end of the slew under way."""
        rest_ns = self.unslewed_ns(now_ns) + by_ns
        self._slew_ppb = SLEW_PPB if rest_ns > 0 else -SLEW_PPB
        self._slew_ends_ns = now_ns + abs(rest_ns) * PPB // SLEW_PPB
        self._go_on(now_ns, self.ahead_ns(now_ns), self._slew_ppb)
        self._go_on(self._slew_ends_ns, self.ahead_ns(self._slew_ends_ns), 0)

    def trim(self, by_ppb: int) -> None:
        """Correct its rate by so much from the next ``step`` or ``slew`` on."""
        self._trim_ppb += by_ppb

    def _go_on(self, since_ns: int, ahead_ns: int, slew_ppb: int) -> None:
        """From ``since_ns`` on it is ``ahead_ns`` ahead; later pieces of the line are void."""
        kept = bisect_right(self._since_ns, since_ns)
        for column, value in ((self._since_ns, since_ns), (self._ahead_ns, ahead_ns),
                              (self._rates_ppb, self._drift_ppb + self._trim_ppb + slew_ppb)):
            del column[kept:]
            column.append(value)

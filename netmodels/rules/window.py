"""The times at which a rule holds."""

from __future__ import annotations

from pydantic import Field, model_validator

from desim import ports
from desim.units import DURATION, Duration, Period


class TimeWindow(ports.Params):
    """From ``from`` until ``until``, the latter not included, and where ``every`` is set again and
    again. A schedule without a period is several rules."""

    start_ns: Duration = Field("0 ns", alias="from", description="(the beginning)")
    until_ns: Duration | None = Field(None, description="null: for good")
    every_ns: Period | None = Field(None, description="from one beginning to the next (null: it "
                                                      "happens once)")

    @model_validator(mode="after")
    def _comes_to_an_end(self) -> TimeWindow:
        if self.until_ns is None:
            if self.every_ns is not None:
                raise ValueError("what happens every so often needs until")
        elif self.until_ns <= self.start_ns:
            raise ValueError(f"until must be later than from, got {DURATION.format(self.start_ns)} "
                             f"to {DURATION.format(self.until_ns)}")
        elif self.every_ns is not None and self.every_ns <= self.until_ns - self.start_ns:
            raise ValueError(f"every must be longer than what lies between from and until, "
                             f"{DURATION.format(self.until_ns - self.start_ns)}, got "
                             f"{DURATION.format(self.every_ns)}")
        return self

    def holds(self, now_ns: int) -> bool:
        """Whether the rule acts now."""
        since_ns = now_ns - self.start_ns
        if since_ns < 0:
            return False
        if self.every_ns is not None:
            since_ns %= self.every_ns
        return self.until_ns is None or since_ns < self.until_ns - self.start_ns

"""The periods of measurements: one for all, and some of their own (``measure.periods``)."""

from __future__ import annotations

from collections.abc import Mapping

from desim.monitor.meters.meter import Due
from desim.scenario.quantities import ALWAYS


class Periods:
    """The period ``every_ns`` of all measurements except those in ``own_ns``, by name. Each is due
    at the multiples of its period."""

    def __init__(self, every_ns: int, own_ns: Mapping[str, int]) -> None:
        self._every_ns, self._own_ns = every_ns, own_ns
        self._all_ns = sorted({every_ns, *own_ns.values()})

    def due(self, now_ns: int) -> Due:
        """Whether the measurement of a name is due."""
        own_ns, every_ns = self._own_ns, self._every_ns
        if not own_ns:
            return all_due
        return lambda name: name in ALWAYS or now_ns % own_ns.get(name, every_ns) == 0

    def next_ns(self, now_ns: int) -> int:
        """The next instant at which one is due."""
        return min(now_ns - now_ns % period_ns + period_ns for period_ns in self._all_ns)


def all_due(_: str) -> bool:
    """Every measurement is due: for samples with another cause than a period."""
    return True

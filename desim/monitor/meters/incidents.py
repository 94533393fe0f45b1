"""Incidents: collisions, and robots that had to free themselves."""

from __future__ import annotations

from collections.abc import Callable

from desim.monitor.meters.meter import Meter
from desim.monitor.samples import Sample


class Incidents(Meter):
    """Counts what befalls ``robots``, by index; ``happened`` gets what is worth a sample."""

    def __init__(self, robots: tuple[str, ...], happened: Callable[[str], object]) -> None:
        self._robots, self._happened = robots, happened
        self.collisions = 0
        self.collisions_of = [0] * len(robots)
        self.recoveries_of = [0] * len(robots)
        self.listeners = {"recovery": self._recovered}

    def collided(self, robot: int, other: int) -> None:
        """A collision episode of ``robot`` with robot ``other``, or with a wall (-1), began."""
        self.collisions += 1
        self.collisions_of[robot] += 1
        if other >= 0:
            self.collisions_of[other] += 1
        self._happened("collision")

    def _recovered(self, robot: str, *_: int) -> None:
        self.recoveries_of[self._robots.index(robot)] += 1
        self._happened("recovery")

    def quantities(self, now_ns: int) -> Sample:
        return {"collisions": self.collisions, "recoveries": sum(self.recoveries_of)}

    def by_host(self, now_ns: int) -> dict[str, Sample]:
        return {name: {"collisions": collisions, "recoveries": recoveries}
                for name, collisions, recoveries in zip(
                    self._robots, self.collisions_of, self.recoveries_of, strict=True)}

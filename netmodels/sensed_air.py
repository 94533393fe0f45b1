"""Radios on the unit disk that sense each other, and corrupt what they overlap."""

from __future__ import annotations

from dataclasses import dataclass

from desim import ports
from netmodels.shared_disk import UnitDiskRadio


@dataclass(eq=False)
class Sending:
    """A transmission. Bit masks of hosts: those that it reaches, those that hear its energy, and
    those where others have corrupted it."""

    source: int
    begin_ns: int
    end_ns: int
    reached: int
    heard: int
    corrupted: int = 0

    def got(self, host: int) -> bool:
        """Whether the host has it, at its end."""
        return bool((self.reached & ~self.corrupted) >> host & 1)


class SensedAir(UnitDiskRadio):
    """The air of radios on the unit disk: who is within ``interference_m`` of a sender hears it,
    and gets nothing else meanwhile. Places are those at the begin of a transmission. What ended
    less than ``memory_ns`` ago may still be asked for."""

    def __init__(self, range_m: float, interference_m: float, memory_ns: int) -> None:
        super().__init__(range_m, interference_m)
        self._memory_ns = memory_ns

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        super().start(context, hosts)
        self._air: list[Sending] = []

    def _begin_sending(self, host: int, air_ns: int) -> Sending:
        """The host sends from now on."""
        self._refresh()
        now_ns = self._context.now_ns
        own = Sending(host, now_ns, now_ns + air_ns, self._reached[host], self._disturbed[host])
        for other in self._air:
            if other.end_ns > now_ns:
                own.corrupted |= other.heard
                other.corrupted |= own.heard
        self._air.append(own)
        return own

    def _has_heard(self, host: int) -> bool:
        """Whether the host has heard energy, or sent, within the last ``memory_ns``."""
        now_ns = self._context.now_ns
        self._air = [one for one in self._air if one.end_ns > now_ns - self._memory_ns]
        return any(one.begin_ns < now_ns and one.heard >> host & 1 for one in self._air)
